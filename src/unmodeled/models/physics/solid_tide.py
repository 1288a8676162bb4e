"""The tidal bulge that Sun and Moon raise on the central body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.third_body import third_body_gm
from unmodeled.models.physics.vectors import combine, dot, norm
from unmodeled.models.physics.zonal import REFERENCE_RADIUS

__all__ = ["SolidTide"]

LOVE_NUMBER = Parameter(
    "tide_k2", unit="1", scale=0.1, description="Love number k2 of the central body"
)


@dataclass(frozen=True)
class SolidTide(Effect):
    r"""Solid tide of degree 2: what the bulge of the central body adds to its field.

    .. math::
        U = k_2 \sum_b \frac{\mu_b R^5}{s^3 r^3} P_2(\cos\psi), \qquad
        \mathbf a = k_2 \sum_b \frac{\mu_b R^5}{s^3 r^4}
        \left[\tfrac32 (1 - 5\cos^2\psi)\,\hat{\mathbf r} + 3\cos\psi\,\hat{\mathbf s}\right]

    with psi the angle between spacecraft and body b at s. Source: [MontenbruckGill2000] section
    3.7.2; equal to [IERS2010] Eq. 6.6 for n = 2 with one real k2 for all orders. Elastic: the
    bulge points at the body without lag; degree 3 (2 % for the Moon on the Earth), the
    dependence of k2 on frequency and the tide of the oceans are left out. The permanent part is
    contained: a field given as "zero tide" holds it in C(2,0) already, where it would be counted
    twice (-4.2e-9 for the Earth). Parameters: ``tide_k2``, ``R_ref``, ``GM_<body>``.

    Size: Earth, k2 = 0.3, below the body: Moon 3.7e-7, Sun 1.7e-7 m/s2 at 6,878 km; a tenth of
    that at LAGEOS; falls as r^-4; half of it across.

    Confused with: Sun and Moon themselves (same angle, growing with r), J2 over less than the
    period of the body. Not to be combined with a field to which the tide has been added.

    Parameters
    ----------
    tide_raisers : tuple of str
        Bodies that raise the tide; the model needs a track of each.
    """

    tide_raisers: tuple[str, ...] = ("sun", "moon")
    name: ClassVar[str] = "solid_tide"

    def __post_init__(self) -> None:
        object.__setattr__(self, "tide_raisers", tuple(self.tide_raisers))
        if not self.tide_raisers or len(set(self.tide_raisers)) < len(self.tide_raisers):
            raise ConfigError(
                f"the solid tide is raised by {self.tide_raisers}", allowed="different bodies"
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Love number, reference radius and GM of each body."""
        return (LOVE_NUMBER, REFERENCE_RADIUS, *(third_body_gm(b) for b in self.tide_raisers))

    @property
    def bodies(self) -> tuple[str, ...]:
        """The bodies that raise the tide."""
        return self.tide_raisers

    @property
    def terms(self) -> frozenset[str]:
        """One tide for each body."""
        return frozenset(f"solid tide {body}" for body in self.tide_raisers)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of `potential`."""
        r = norm(s.position)
        radial, along = expression(0.0), []
        for body in self.tide_raisers:
            size, distance, c = self._tide(s, body)
            factor = size / (r * r * r * r)
            radial = radial + 1.5 * factor * (1.0 - 5.0 * c * c) / r
            along.append(3.0 * factor * c / distance)
        return combine([radial, *along], [s.position, *(s.bodies[b] for b in self.tide_raisers)])

    def potential(self, s: Symbols) -> expression:
        """Return the force function of the bulge."""
        r, total = norm(s.position), expression(0.0)
        for body in self.tide_raisers:
            size, _, c = self._tide(s, body)
            total = total + size * (1.5 * c * c - 0.5) / (r * r * r)
        return total

    def _tide(self, s: Symbols, body: str) -> tuple[expression, expression, expression]:
        """k2 mu R^5 / s^3, the distance s and the cosine of psi."""
        place = s.bodies[body]
        distance, radius = norm(place), s["R_ref"]
        ratio = radius / distance
        size = s["tide_k2"] * s[f"GM_{body}"] * radius * radius * ratio * ratio * ratio
        return size, distance, dot(s.position, place) / (norm(s.position) * distance)
