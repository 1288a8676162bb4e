"""Arguments of tidal waves as symbols, linear in time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from heyoka import cos, expression, sin

from unmodeled.core.constants import DAY
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Symbols

__all__ = ["TIDE_DAY", "Coefficients", "harmonics", "wave"]

TIDE_DAY = Parameter(
    "tide_day", unit="d", description="days since J2000.0 (12 h), UT1, at time zero"
)

#: At J2000.0 (degrees) and a day (degrees): GMST + pi, then l, l', F, D, Omega; of [IERS2010] Eq.
#: 5.43 and 5.32 without what is not linear: below 0.01 degrees within fifty years of J2000.
_AT_J2000 = (460.46061837, 134.96340251, 357.52910918, 93.27209062, 297.85019547, 125.04455501)
_A_CENTURY_ARCSEC = (
    1717915923.2178,
    129596581.0481,
    1739527262.8478,
    1602961601.2090,
    -6962890.5431,
)
_A_DAY = (360.98564736629, *(rate / 3600.0 / 36525.0 for rate in _A_CENTURY_ARCSEC))

#: Pairs C, S by degree and order.
Coefficients = Mapping[tuple[int, int], tuple[expression, expression]]


def wave(
    s: Symbols, multipliers: Sequence[int], beside: Mapping[int, float] | None = None
) -> tuple[expression, expression]:
    """Return cosine and sine of a tidal argument, with what the node splits off.

    Parameters
    ----------
    s : Symbols
        With the parameter ``tide_day``.
    multipliers : sequence of int
        Of GMST + pi, then of l, l', F, D, Omega as in the tables of [IERS2010] section 6.2, where
        those five are subtracted.
    beside : mapping of int to float
        Sizes, as a share of the wave, of waves with so many Omega more. The node (19 years) is
        taken where it is at time zero: 0.05 degrees a day.
    """
    now = s["tide_day"] + s.time / DAY.value
    angle = _angle(multipliers, now)
    c, sine = cos(angle), sin(angle)
    if not beside:
        return c, sine
    real, imaginary = expression(1.0), expression(0.0)
    for step, share in beside.items():
        turn = _angle((0, 0, 0, 0, 0, step), s["tide_day"])
        real, imaginary = real + share * cos(turn), imaginary + share * sin(turn)
    return real * c - imaginary * sine, real * sine + imaginary * c


def _angle(multipliers: Sequence[int], day: expression) -> expression:
    m, *rest = multipliers
    signed = (m, *(-n for n in rest))
    start = sum(n * a for n, a in zip(signed, _AT_J2000, strict=True)) % 360.0
    rate = sum(n * a for n, a in zip(signed, _A_DAY, strict=True))
    return math.radians(start) + math.radians(rate) * day


def harmonics(found: Coefficients, degree: int) -> list[tuple[expression, expression]]:
    """Return C and S of every degree and order from 0 on; those not found are zero."""
    zero = expression(0.0)
    return [found.get((n, m), (zero, zero)) for n in range(degree + 1) for m in range(n + 1)]
