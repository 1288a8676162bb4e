"""A point mass at a place fixed in the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, norm

__all__ = ["Mascon"]


@dataclass(frozen=True)
class Mascon(Effect):
    r"""Mass concentration: a point mass added at :math:`\mathbf r_0`, in body axes.

    .. math::
        \mathbf a = -\mu \frac{\mathbf r - \mathbf r_0}{|\mathbf r - \mathbf r_0|^3}, \qquad
        U = \frac{\mu}{|\mathbf r - \mathbf r_0|}

    Source: [Scheeres2012] Eq. 2.1 about a shifted centre. The parameters are ``mascon1_GM``
    (:math:`\mu`, negative for a lack of mass) and ``mascon1_x``, ``mascon1_y``, ``mascon1_z``;
    the number is ``index``, so that a model can hold several. It is a pure addition: neither its
    monopole nor its dipole is taken out, so the total mass becomes GM + mu and the centre of mass
    moves by mu r0 / (GM + mu) away from the origin. Reduce GM by hand if the total is known.
    With mu = 0 the place has no influence and cannot be estimated.

    Size: 2e-5 of the Moon's mass at a depth of 170 km gives 3.4e-3 m/s2 at the surface above it
    and 1.3e-3 m/s2 at 100 km altitude.

    Confused with: GM (its monopole), degree 1 (its dipole), tesserals of low degree seen from far
    away; depth against mass. Not to be combined with a free degree-0 or degree-1 coefficient, nor
    with a full field of high degree that was fitted to the same body.

    Parameters
    ----------
    index : int
        Number of the mascon, 1 or more; part of its parameters' names.
    """

    index: int = 1
    name: ClassVar[str] = "mascon"
    axes: ClassVar[str] = "body"

    def __post_init__(self) -> None:
        if self.index < 1:
            raise ConfigError(f"mascon index is {self.index}", allowed="1 or more")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM of the mascon and its place."""
        key = f"mascon{self.index}"
        return (
            Parameter(f"{key}_GM", unit="m3 s-2", description="GM of the mascon"),
            *(
                Parameter(f"{key}_{k}", unit="m", description=f"{k} of the mascon, body axes")
                for k in "xyz"
            ),
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the attraction of the mascon."""
        d = self._offset(s)
        r = norm(d)
        return combine([-s[f"mascon{self.index}_GM"] / (r * r * r)], [d])

    def potential(self, s: Symbols) -> expression:
        """Return mu / distance."""
        return s[f"mascon{self.index}_GM"] / norm(self._offset(s))

    @property
    def terms(self) -> frozenset[str]:
        """The mascon of this number."""
        return frozenset({f"mascon {self.index}"})

    def _offset(self, s: Symbols) -> Vector:
        x, y, z = (r - s[f"mascon{self.index}_{k}"] for r, k in zip(s.position, "xyz", strict=True))
        return x, y, z
