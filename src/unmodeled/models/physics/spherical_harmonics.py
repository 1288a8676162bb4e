"""Full spherical-harmonic gravity field, normalised coefficients, any degree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression, model

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.zonal import REFERENCE_RADIUS

__all__ = ["SphericalHarmonics", "coefficient_names"]


@dataclass(frozen=True)
class SphericalHarmonics(Effect):
    r"""Gravity field in fully normalised spherical harmonics, in body-fixed axes.

    .. math::
        U = \frac{GM}{r} \sum_{n=n_0}^{N} \left(\frac{R}{r}\right)^n \sum_{m=0}^{\min(n,M)}
        \bar P_{nm}(\sin\varphi)\,(\bar C_{nm}\cos m\lambda + \bar S_{nm}\sin m\lambda)

    Source: [MontenbruckGill2000] Eq. 3.13-3.15 and section 3.2.4 (recursion of Cunningham, free
    of singularities at the poles), as implemented by [heyoka]. The coefficients are runtime
    parameters ``C_n_m`` and ``S_n_m``: another field of the same degree needs no compilation.
    With ``min_degree=0`` the field contains the point mass (``C_0_0`` = 1) and must not be
    combined with it; nor with zonals of the same degrees.

    Parameters
    ----------
    degree : int
        Highest degree N.
    order : int, optional
        Highest order M; N if not given, 0 for a zonal field.
    min_degree : int
        Lowest degree; 0 contains the point mass, 2 (default) only what disturbs it.
    """

    degree: int
    order: int | None = None
    min_degree: int = 2
    name: ClassVar[str] = "spherical_harmonics"
    axes: ClassVar[str] = "body"

    def __post_init__(self) -> None:
        if not 0 <= self.min_degree <= self.degree:
            raise ConfigError(
                f"spherical harmonics from degree {self.min_degree} to {self.degree}",
                allowed="0 <= min_degree <= degree",
            )
        if self.order is not None and not 0 <= self.order <= self.degree:
            raise ConfigError(
                f"spherical harmonics of degree {self.degree} and order {self.order}",
                allowed="0 <= order <= degree",
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM, reference radius and all coefficients."""
        return (
            GM,
            REFERENCE_RADIUS,
            *(
                Parameter(
                    name,
                    unit="1",
                    value=1.0 if name == "C_0_0" else 0.0,
                    scale=1.0 if name == "C_0_0" else 1e-5,
                    description="normalised coefficient",
                )
                for name in coefficient_names(self.degree, self.order, self.min_degree)
            ),
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of the field."""
        ax, ay, az = model.sh_gravity_acc(
            list(s.position), self._coefficients(s), mu=s["GM"], a=s["R_ref"], **self._limits()
        )
        return ax, ay, az

    def potential(self, s: Symbols) -> expression:
        """Return the force function."""
        return model.sh_gravity_pot(
            list(s.position), self._coefficients(s), mu=s["GM"], a=s["R_ref"], **self._limits()
        )

    @property
    def terms(self) -> frozenset[str]:
        """One term for each coefficient."""
        return frozenset(
            "gravity {}({},{})".format(*name.split("_"))
            for name in coefficient_names(self.degree, self.order, self.min_degree)
        )

    def _limits(self) -> dict[str, int]:
        return {
            "max_degree": self.degree,
            "max_order": self.degree if self.order is None else self.order,
        }

    def _coefficients(self, s: Symbols) -> list[tuple[expression, expression]]:
        """C and S of every degree and order from 0 on; those not in the model are zero."""
        zero = expression(0.0)
        return [
            (s.parameters.get(f"C_{n}_{m}", zero), s.parameters.get(f"S_{n}_{m}", zero))
            for n in range(self.degree + 1)
            for m in range(n + 1)
        ]


def coefficient_names(degree: int, order: int | None = None, min_degree: int = 0) -> list[str]:
    """Return the names of the coefficients, by degree, then order, C before S.

    Examples
    --------
    >>> coefficient_names(2, min_degree=2)
    ['C_2_0', 'C_2_1', 'S_2_1', 'C_2_2', 'S_2_2']
    """
    top = degree if order is None else order
    return [
        f"{kind}_{n}_{m}"
        for n in range(min_degree, degree + 1)
        for m in range(min(n, top) + 1)
        for kind in ("CS" if m else "C")
    ]
