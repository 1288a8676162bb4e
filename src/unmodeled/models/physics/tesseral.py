"""One pair of tesseral coefficients, for models that name them one by one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression, model

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.zonal import REFERENCE_RADIUS

__all__ = ["Tesseral"]


@dataclass(frozen=True)
class Tesseral(Effect):
    r"""The pair :math:`\bar C_{nm}, \bar S_{nm}` of a gravity field, fully normalised, m > 0.

    The term (n, m) of `SphericalHarmonics`: [MontenbruckGill2000] Eq. 3.13-3.15. In body axes,
    parameters ``C_n_m`` and ``S_n_m``.

    Size: Kaula's rule, 1e-5 / n^2 for the Earth, 1e-2 and more on small bodies.

    Confused with: nothing over a day and more, unless the orbit is resonant with the spin. Not to
    be combined with a field that contains the pair.

    Parameters
    ----------
    degree, order : int
        n >= 2 and 1 <= m <= n.
    """

    degree: int
    order: int
    name: ClassVar[str] = "tesseral"
    axes: ClassVar[str] = "body"

    def __post_init__(self) -> None:
        if self.degree < 2 or not 1 <= self.order <= self.degree:
            raise ConfigError(
                f"tesseral of degree {self.degree} and order {self.order}",
                allowed="degree 2 or more, order from 1 to the degree",
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM, reference radius and the pair."""
        return (
            GM,
            REFERENCE_RADIUS,
            *(
                Parameter(n, unit="1", scale=1e-5, description="normalised coefficient")
                for n in self._names
            ),
        )

    @property
    def terms(self) -> frozenset[str]:
        """The two terms."""
        return frozenset(f"gravity {kind}({self.degree},{self.order})" for kind in "CS")

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of the pair's potential."""
        ax, ay, az = model.sh_gravity_acc(
            list(s.position), self._coefficients(s), mu=s["GM"], a=s["R_ref"], **self._limits
        )
        return ax, ay, az

    def potential(self, s: Symbols) -> expression:
        """Return the force function of the pair."""
        return model.sh_gravity_pot(
            list(s.position), self._coefficients(s), mu=s["GM"], a=s["R_ref"], **self._limits
        )

    @property
    def _names(self) -> tuple[str, str]:
        return f"C_{self.degree}_{self.order}", f"S_{self.degree}_{self.order}"

    @property
    def _limits(self) -> dict[str, int]:
        return {"max_degree": self.degree, "max_order": self.order}

    def _coefficients(self, s: Symbols) -> list[tuple[expression, expression]]:
        zero = expression(0.0)
        wanted = (self.degree, self.order)
        c, sine = self._names
        return [
            (s[c], s[sine]) if (n, m) == wanted else (zero, zero)
            for n in range(self.degree + 1)
            for m in range(n + 1)
        ]
