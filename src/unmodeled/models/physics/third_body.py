"""Attraction of another body, relative to the central one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, dot, norm

__all__ = ["ThirdBody", "attraction", "attraction_potential", "third_body_gm"]


def third_body_gm(body: str) -> Parameter:
    """Return the gravitational parameter of another body, shared by all effects of that body."""
    return Parameter(
        f"GM_{body}",
        unit="m3 s-2",
        scale=1e10,
        lower=0.0,
        description=f"gravitational parameter of {body}",
    )


@dataclass(frozen=True)
class ThirdBody(Effect):
    r"""Third body as a point mass, in axes that fall with the central body.

    .. math::
        \mathbf a = \mu_b \left(\frac{\mathbf d}{d^3} - \frac{\mathbf s}{s^3}\right), \qquad
        \mathbf d = \mathbf s - \mathbf r

    s is the position of the body relative to the centre. The difference of the two nearly equal
    vectors is taken in Battin's form, which loses no digits however far the body is. Source:
    [MontenbruckGill2000] Eq. 3.37; [Battin1999] section 8.4. Parameter: ``GM_<body>``.

    Size: on a satellite of the Earth at 6,878 km the Moon 1.2e-6, the Sun 5.5e-7 m/s2;
    grows with r.

    Confused with: the solid tide of the same body (the same angle, another power of r); the Sun
    with the Moon over less than half a month. Not to be combined with a body that the tracks'
    centre already contains (the Moon with the Earth-Moon barycentre).

    Parameters
    ----------
    body : str
        Name of the body, for which the model needs a track.
    """

    body: str
    name: ClassVar[str] = "third_body"
    position_only: ClassVar[bool] = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM of the body."""
        return (third_body_gm(self.body),)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The body."""
        return (self.body,)

    @property
    def terms(self) -> frozenset[str]:
        """The attraction of this body."""
        return frozenset({f"third body {self.body}"})

    def acceleration(self, s: Symbols) -> Vector:
        """Return the difference of the attractions on spacecraft and centre."""
        return attraction(s[f"GM_{self.body}"], s.position, s.bodies[self.body])

    def potential(self, s: Symbols) -> expression:
        """Return mu (1/d - r.s / s^3)."""
        return attraction_potential(s[f"GM_{self.body}"], s.position, s.bodies[self.body])


def attraction(gm: expression, position: Vector, place: Vector) -> Vector:
    """Return the attraction of a mass at ``place`` less that on the origin."""
    d = combine([expression(1.0), expression(-1.0)], [place, position])
    # With q = (r.r - 2 r.s) / s.s: d^3 = s^3 (1 + q)^(3/2), and 1 - 1/(1+q)^(3/2) below is
    # exact for small q.
    q = dot(position, combine([expression(1.0), expression(-2.0)], [position, place]))
    q = q / dot(place, place)
    root = norm(d) / norm(place)
    share = q * (3.0 + q * (3.0 + q)) / (1.0 + root * root * root)
    cube = norm(d) * norm(d) * norm(d)
    factor = gm / cube
    return combine([-factor, -factor * share], [position, place])


def attraction_potential(gm: expression, position: Vector, place: Vector) -> expression:
    """Return mu (1/d - r.s / s^3)."""
    d = combine([expression(1.0), expression(-1.0)], [place, position])
    size = norm(place)
    along = dot(position, place) / (size * size * size)
    return gm * (1.0 / norm(d) - along)
