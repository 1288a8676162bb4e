"""Geodetic precession: what the Sun's field does to orbits about a planet that moves in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.relativity import LIGHT
from unmodeled.models.physics.third_body import third_body_gm
from unmodeled.models.physics.vectors import combine, cross, norm

__all__ = ["DeSitter"]

SCALE = Parameter(
    "de_sitter_scale", unit="1", value=1.0, description="geodetic precession; 1: relativity"
)
MOTION = Parameter(
    "de_sitter_h",
    unit="m2 s-1",
    # Of the Earth, [Simon1994]: a = 1.0000010178 au, e = 0.01670863.
    value=4.455107e15,
    scale=1e15,
    description="angular momentum of the central body about the Sun, per mass",
)
#: Unit vector of the ecliptic pole of J2000 in ICRF axes.
POLE = tuple(
    Parameter(
        f"de_sitter_{k}",
        unit="1",
        value=value,
        description=f"{k} of the pole of the orbit about the Sun; default: ecliptic, ICRF axes",
    )
    for k, value in zip("xyz", (0.0, -0.39777715593191371, 0.91748206206918181), strict=True)
)


@dataclass(frozen=True)
class DeSitter(Effect):
    r"""De Sitter (geodetic) term of the Earth's, or the Moon's, motion about the Sun.

    .. math::
        \mathbf a = 2 s\, \boldsymbol\Omega \times \mathbf v, \qquad
        \boldsymbol\Omega = \frac32\, \mathbf V \times
        \left(-\frac{GM_\odot \mathbf R}{c^2 R^3}\right), \qquad
        \mathbf R \times \mathbf V = h\,\mathbf w

    Source: [IERS2010] Eq. 10.12, third line, with :math:`\gamma = 1`; R and V are position and
    velocity of the central body relative to the Sun: R from the track of the Sun; h, which an
    ellipse keeps, is ``de_sitter_h``, and w, the pole of the orbit, ``de_sitter_x``, ``_y``,
    ``_z``: by default those of the Earth, and of the Moon within 1e-3 (its motion about the Earth
    left out), in ICRF axes. In other axes give the pole. *s* is ``de_sitter_scale``: 1 for
    relativity. Axes that do not turn against the stars, as those of the ICRF: there the gyroscope
    precesses and orbits feel this Coriolis force. ``GM_sun`` is the Sun's; ``c`` in the units of
    everything else.

    Size: Omega is 19.2 milliarcseconds a year; 4e-11 m/s2 in low Earth orbit.

    Confused with: `LenseThirring` and the node rate of even zonals, on one orbit; an error of the
    frame's rotation rate. Not to be combined with a free rotation rate of the frame.
    """

    name: ClassVar[str] = "de_sitter"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The Sun's GM, the speed of light, the scale, and the motion about the Sun."""
        return (third_body_gm("sun"), LIGHT, SCALE, MOTION, *POLE)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The Sun."""
        return ("sun",)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the Coriolis force of the precession."""
        distance = norm(s.bodies["sun"])
        axis: Vector = (s["de_sitter_x"], s["de_sitter_y"], s["de_sitter_z"])
        cube = distance * distance * distance
        rate = 1.5 * s["de_sitter_h"] * s["GM_sun"] / (s["c"] * s["c"] * cube)
        size = norm(axis)
        factor = 2.0 * s["de_sitter_scale"] * rate / size
        return combine([factor], [cross(axis, s.velocity)])
