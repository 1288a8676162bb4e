"""How much of the Sun is seen beside the body: smooth, with partials everywhere."""

from __future__ import annotations

import math

from heyoka import expression, sqrt

from unmodeled.core.constants import RADIUS_OF
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Symbols
from unmodeled.models.physics.vectors import combine, dot, norm

__all__ = ["OCCULTER_RADIUS", "SHADOW_RADIUS", "SUN_RADIUS", "shadow_edges", "sunlit_share"]

#: Radius of the central body, as a sphere that throws a shadow and shines.
SHADOW_RADIUS = Parameter(
    "shadow_radius",
    unit="m",
    value=1.0,
    scale=1e3,
    lower=0.0,
    description="radius of the sphere that throws the shadow",
)
OCCULTER_RADIUS = Parameter(
    "occulter_radius",
    unit="m",
    value=1.0,
    scale=1e3,
    lower=0.0,
    description="radius of another body that throws a shadow",
)
SUN_RADIUS = Parameter(
    "sun_radius",
    unit="m",
    value=RADIUS_OF["sun"].value,
    scale=1e6,
    lower=1e-6,
    description="radius of the Sun",
)

# Half the Sun's disc is hidden where u = 0; there the first factor gives the exact slope behind a
# straight edge, 2/pi. The second makes the largest deviation least (see `sunlit_share`).
SLOPE, CUBIC = 4.0 / math.pi, 1.866
EDGE = 1.5


def sunlit_share(s: Symbols, occulter: str = "") -> expression:
    r"""Return the share of the Sun's disc that the central body leaves free, 0 to 1.

    .. math::
        \nu = \tfrac12\left(1 + \frac{v}{\sqrt{1+v^2}}\right), \quad
        v = \frac{4}{\pi} u + 1.866\,u^3, \quad u = \frac{c - b}{a}

    with c the angle between the centres of Sun and body seen from the spacecraft, b and a the
    angular radii of body and Sun: the penumbra is :math:`-1 < u < 1`, as in
    [MontenbruckGill2000] section 3.4.2, whose overlap of two discs has a kink at either end. Here
    the overlap behind a straight edge is approached by a function without kinks and with an
    algebraic tail. It deviates from the overlap by at most 0.024 (at u = 0.6 and at the edges of
    the penumbra) and by 1e-4 at u = 3, the push through the whole penumbra by 5e-4 of its
    half-width. A body of finite width in the sky adds to this: the largest deviation is 0.026 up to
    geostationary orbit and 0.045 at the distance of the Moon. The body must be wider than the Sun
    in the sky: there is no antumbra here. Where it is about as wide (the Moon from orbits of the
    Earth) the share is off by up to 0.15.

    The difference c - b comes, to third order in itself, from
    :math:`w = \cos b - \cos c` as :math:`2w / (\sin b + \sqrt{\sin^2 b + 2 w\cos b})`, where the
    root is the far side of a triangle and never zero. Inside the sphere there is no value.

    Parameters
    ----------
    s : Symbols
        With the body "sun" and the parameters of `SHADOW_RADIUS` (`OCCULTER_RADIUS`) and
        `SUN_RADIUS`.
    occulter : str
        Another body of the symbols that throws the shadow; the central one if empty.
    """
    u = _penumbra(s, occulter)
    v = u * (SLOPE + CUBIC * u * u)
    return 0.5 * (1.0 + v / sqrt(1.0 + v * v))


def shadow_edges(s: Symbols, occulter: str = "") -> expression:
    """Return an expression that is zero shortly before and after the penumbra (u = -1.5, 1.5).

    A Taylor step in low orbit is a hundred times longer than the penumbra and the light is a
    billionth of the attraction: the step sees neither and passes over. An integrator that stops
    here steps through the penumbra as slowly as it must.
    """
    u = _penumbra(s, occulter)
    return u * u - EDGE * EDGE


def _penumbra(s: Symbols, occulter: str) -> expression:
    """Distance u from the middle of the penumbra in its half-widths; positive in the light."""
    signs = [expression(1.0), expression(-1.0)]
    to_sun = combine(signs, [s.bodies["sun"], s.position])
    place = combine(signs, [s.position, s.bodies[occulter]]) if occulter else s.position
    r, d = norm(place), norm(to_sun)
    cos_c = -dot(place, to_sun) / (r * d)
    sin_b = s["occulter_radius" if occulter else "shadow_radius"] / r
    cos_b = sqrt((1.0 - sin_b) * (1.0 + sin_b))
    w = cos_b - cos_c
    gap = 2.0 * w / (sin_b + sqrt(sin_b * sin_b + 2.0 * w * cos_b))
    return gap * d / s["sun_radius"]
