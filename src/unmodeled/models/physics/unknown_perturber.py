"""Attraction of a body that nobody has seen, on a circle about the central body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import cos, expression, sin, sqrt

from unmodeled.core.constants import OBLIQUITY_J2000
from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.third_body import attraction, attraction_potential

__all__ = ["UnknownPerturber"]


@dataclass(frozen=True)
class UnknownPerturber(Effect):
    r"""Third body on a circular orbit whose size and phase are parameters.

    .. math::
        \mathbf a = \mu \left(\frac{\mathbf d}{d^3} - \frac{\mathbf s}{s^3}\right), \qquad
        \mathbf s(t) = a\,[\mathbf p \cos\lambda + \mathbf q \sin\lambda], \qquad
        \lambda = \lambda_0 + \sqrt{GM / a^3}\,(t - t_0)

    with d = s - r: `ThirdBody` without an ephemeris. Source: [MontenbruckGill2000] Eq. 3.37. GM is
    that of the central body; the perturber's own mass is neglected in its motion, so that the
    force is linear in it (Neptune: 3e-5 of its mean motion). Parameters, for index 1:
    ``perturber1_GM`` (mu), ``perturber1_a`` (a), ``perturber1_longitude`` (lambda_0 at
    ``perturber1_t0``), and the plane: ``perturber1_node`` turns about z, then
    ``perturber1_inclination`` about the node. Longitude counts from x along z's equator to the
    node, then along the orbit. By default the plane is the ecliptic of J2000 in ICRF axes.

    Size: Neptune on Uranus at conjunction 2e-9 m/s2; in 84 years that leaves 4 arcseconds of
    longitude after the orbit is fitted.

    Confused with: itself. The direction of the perturber is determined, its distance against its
    mass is not: a nearer lighter body does nearly the same. A distance comes from a second planet,
    or from finding the body. With mu = 0 the place has no influence and cannot be estimated.
    Not to be combined with a `ThirdBody` that is the same body.

    Parameters
    ----------
    index : int
        Number of the perturber, 1 or more; part of its parameters' names.
    """

    index: int = 1
    name: ClassVar[str] = "unknown_perturber"

    def __post_init__(self) -> None:
        if self.index < 1:
            raise ConfigError(f"unknown_perturber index is {self.index}", allowed="1 or more")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM of the central body; GM, size, phase and plane of the perturber."""
        key = f"perturber{self.index}"
        return (
            GM,
            Parameter(f"{key}_GM", unit="m3 s-2", scale=1e10, description="GM of the perturber"),
            Parameter(
                f"{key}_a",
                unit="m",
                value=1.0,
                scale=1e11,
                lower=1e-6,
                description="radius of the perturber's circle",
            ),
            Parameter(
                f"{key}_longitude", unit="rad", description="longitude of the perturber at t0"
            ),
            Parameter(f"{key}_t0", unit="s", description="time of the longitude"),
            Parameter(
                f"{key}_inclination",
                unit="rad",
                value=OBLIQUITY_J2000.value,
                description="inclination of the circle; default: ecliptic of J2000 in ICRF axes",
            ),
            Parameter(f"{key}_node", unit="rad", description="node of the circle"),
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the difference of the attractions on spacecraft and centre."""
        return attraction(s[f"perturber{self.index}_GM"], s.position, self._place(s))

    def potential(self, s: Symbols) -> expression:
        """Return mu (1/d - r.s / s^3)."""
        return attraction_potential(s[f"perturber{self.index}_GM"], s.position, self._place(s))

    @property
    def terms(self) -> frozenset[str]:
        """The perturber of this number."""
        return frozenset({f"unknown perturber {self.index}"})

    def _place(self, s: Symbols) -> Vector:
        key = f"perturber{self.index}"
        a, node, tilt = s[f"{key}_a"], s[f"{key}_node"], s[f"{key}_inclination"]
        motion = sqrt(s["GM"] / (a * a * a))
        phase = s[f"{key}_longitude"] - node + motion * (s.time - s[f"{key}_t0"])
        along, across = a * cos(phase), a * sin(phase)
        level = across * cos(tilt)
        return (
            along * cos(node) - level * sin(node),
            along * sin(node) + level * cos(node),
            across * sin(tilt),
        )
