"""Daily and half-daily variations of the Earth's pole and UT1, which daily tables do not hold.

Causes: tides of the oceans, and the pull of Sun and Moon on an Earth that is not round about its
axis (libration). A table such as that of the IERS leaves them out, by convention; a satellite sees
them: 1 mas is 6 cm at the distance of LAGEOS. Waves of less than 1.5 microarcseconds in the pole
and 0.2 microseconds in UT1 are left out.
"""

from __future__ import annotations

from collections.abc import Sequence

import erfa
import numpy as np

from unmodeled.core.arrays import Array

__all__ = ["LIBRATION", "subdaily_rotation", "tidal_arguments"]

_J2000, _CENTURY = 2_451_545.0, 36_525.0
_MICROARCSECOND = np.pi / 648_000e6
_MICROSECOND = 1e-6

# Multipliers of GMST + pi, l, l', F, D, Omega; then sine and cosine of x_p and of y_p
# (microarcseconds) and of UT1 (microseconds).
_OCEAN: Sequence[tuple[float, ...]] = (  # [IERS2010] Tables 8.2a, 8.2b, 8.3a, 8.3b
    (1, -2, 0, -2, 0, -2, 0.30, 3.42, -3.42, 0.30, 1.034, -0.314),
    (1, 0, 0, -2, -2, -2, 0.46, 4.15, -4.15, 0.45, 1.187, -0.387),
    (1, -1, 0, -2, 0, -1, 1.19, 4.96, -4.96, 1.19, 0.966, -0.474),
    (1, -1, 0, -2, 0, -2, 6.24, 26.31, -26.31, 6.23, 5.118, -2.499),  # Q1
    (1, 1, 0, -2, -2, -2, 1.28, 4.99, -4.99, 1.28, 0.911, -0.475),
    (1, 0, 0, -2, 0, -1, 9.22, 25.06, -25.06, 9.22, 3.025, -2.280),
    (1, 0, 0, -2, 0, -2, 48.82, 132.91, -132.90, 48.82, 16.020, -12.069),  # O1
    (1, 0, 0, 0, -2, 0, -0.66, -1.72, 1.72, -0.66, -0.194, 0.154),
    (1, 1, 0, -2, 0, -2, -1.61, -3.46, 3.46, -1.61, -0.308, 0.271),
    (1, -1, 0, 0, 0, 0, -4.48, -9.61, 9.61, -4.48, -0.856, 0.751),  # M1
    (1, -1, 0, 0, 0, -1, -0.90, -1.93, 1.93, -0.90, -0.172, 0.151),
    (1, 1, 0, 0, -2, 0, -0.86, -1.81, 1.81, -0.86, -0.161, 0.137),
    (1, 0, -1, -2, 2, -2, 1.54, 3.03, -3.03, 1.54, 0.315, -0.189),
    (1, 0, 0, -2, 2, -2, 26.13, 51.25, -51.25, 26.13, 5.512, -3.095),  # P1
    (1, 0, 0, 0, 0, 1, 1.54, 3.00, -3.00, 1.54, 0.348, -0.171),
    (1, 0, 0, 0, 0, 0, -77.48, -151.74, 151.74, -77.48, -17.620, 8.548),  # K1
    (1, 0, 0, 0, 0, -1, -10.52, -20.56, 20.56, -10.52, -2.392, 1.159),
    (1, 0, 0, 2, -2, 2, -1.09, -2.11, 2.11, -1.09, -0.267, 0.111),
    (1, -1, 0, 0, 2, 0, -0.69, -1.43, 1.43, -0.69, -0.288, 0.043),
    (1, 1, 0, 0, 0, 0, -3.46, -7.28, 7.28, -3.46, -1.610, 0.187),  # J1
    (1, 1, 0, 0, 0, -1, -0.69, -1.44, 1.44, -0.69, -0.320, 0.037),
    (1, 0, 0, 0, 2, 0, -0.37, -1.06, 1.06, -0.37, -0.407, -0.005),
    (1, 0, 0, 2, 0, 2, -1.10, -3.42, 3.42, -1.09, -1.436, -0.037),  # OO1
    (1, 0, 0, 2, 0, 1, -0.70, -2.19, 2.19, -0.70, -0.921, -0.023),
    (1, 1, 0, 2, 0, 2, -0.03, -0.59, 0.59, -0.03, -0.396, -0.024),
    (2, -1, 0, -2, -2, -2, -1.33, -0.17, 1.53, 0.68, -0.224, -0.032),
    (2, -2, 0, -2, 0, -2, -6.08, -1.61, 3.13, 3.35, -0.637, -0.177),
    (2, 0, 0, -2, -2, -2, -7.59, -2.05, 3.44, 4.23, -0.745, -0.222),
    (2, -1, 0, -2, 0, -1, 2.12, 0.49, -0.41, -1.23, 0.141, 0.058),
    (2, -1, 0, -2, 0, -2, -56.87, -12.93, 11.15, 32.88, -3.795, -1.556),  # N2
    (2, 1, 0, -2, -2, -2, -11.01, -2.40, 1.89, 6.41, -0.698, -0.298),
    (2, 0, 0, -2, 0, -1, 12.32, 1.00, -1.41, -7.31, 0.605, 0.266),
    (2, 0, 0, -2, 0, -2, -330.15, -26.96, 37.58, 195.92, -16.195, -7.140),  # M2
    (2, -1, 0, -2, 2, -2, 2.47, -0.28, -0.44, -1.48, 0.111, 0.034),
    (2, 1, 0, -2, 0, -2, 9.40, -1.44, -1.88, -5.65, 0.425, 0.117),
    (2, -1, 0, 0, 0, 0, -2.35, 0.37, 0.47, 1.41, -0.106, -0.029),
    (2, 0, -1, -2, 2, -2, -8.51, 3.50, 3.29, 5.11, -0.437, -0.019),
    (2, 0, 0, -2, 2, -2, -144.13, 63.56, 59.23, 86.56, -7.547, -0.159),  # S2
    (2, 0, 0, 0, 0, 0, -38.48, 19.14, 17.72, 23.11, -2.104, 0.041),  # K2
    (2, 0, 0, 0, 0, -1, -11.44, 5.75, 5.32, 6.87, -0.627, 0.015),
    (2, 1, 0, 0, 0, 0, -1.77, 1.79, 1.71, 1.04, -0.146, 0.037),
)
#: The same columns.
LIBRATION: Sequence[tuple[float, ...]] = (  # [IERS2010] Tables 5.1a, 5.1b
    (1, -1, 0, -2, 0, -2, -2.3, 1.3, -1.3, -2.3, 0.0, 0.0),
    (1, 0, 0, -2, 0, -1, -2.1, 1.2, -1.2, -2.1, 0.0, 0.0),
    (1, 0, 0, -2, 0, -2, -11.4, 6.5, -6.5, -11.4, 0.0, 0.0),
    (1, 0, 0, -2, 2, -2, -4.8, 2.7, -2.7, -4.8, 0.0, 0.0),
    (1, 0, 0, 0, 0, 0, 14.3, -8.2, 8.2, 14.3, 0.0, 0.0),
    (1, 0, 0, 0, 0, -1, 1.9, -1.1, 1.1, 1.9, 0.0, 0.0),
    (2, -1, 0, -2, 0, -2, 0.0, 0.0, 0.0, 0.0, 0.35, -0.20),
    (2, 0, 0, -2, 0, -2, 0.0, 0.0, 0.0, 0.0, 1.75, -1.01),
    (2, 0, 0, -2, 2, -2, 0.0, 0.0, 0.0, 0.0, 0.76, -0.44),
    (2, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.21, -0.12),
)
_WAVES = np.array([*_OCEAN, *LIBRATION])


def subdaily_rotation(tt1: float, tt2: Array) -> Array:
    """Return what to add to daily values of the pole and UT1.

    Parameters
    ----------
    tt1, tt2 : float, ndarray (n,)
        Julian dates, TT, in two parts.

    Returns
    -------
    ndarray (n, 3)
        Pole x and y, rad; UT1, s.

    Notes
    -----
    [IERS2010] sections 5.5.1, 5.5.3 and 8.2, of which the waves below the limits are left out:
    together up to 15 microarcseconds, 1 mm at the distance of LAGEOS.
    """
    angles = tidal_arguments(tt1, tt2) @ _WAVES[:, :6].T
    sine, cosine = np.sin(angles), np.cos(angles)
    amplitudes = _WAVES[:, 6:].reshape(-1, 3, 2)
    total = sine @ amplitudes[:, :, 0] + cosine @ amplitudes[:, :, 1]
    found: Array = total * [_MICROARCSECOND, _MICROARCSECOND, _MICROSECOND]
    return found


def tidal_arguments(tt1: float, tt2: Array) -> Array:
    """Return GMST + pi and the Delaunay arguments l, l', F, D, Omega, rad, (n, 6).

    GMST is taken with TT for UT1: a minute, 0.3 degrees, is nothing to a tide but would be to the
    longitude of a place. Source: [IERS2010] Eq. 5.43 and 5.32.

    Parameters
    ----------
    tt1, tt2 : float, ndarray (n,)
        Julian dates, TT, in two parts.
    """
    day = np.asarray(tt2, dtype=np.float64)
    t = ((tt1 - _J2000) + day) / _CENTURY
    columns = (
        erfa.gmst06(tt1, day, tt1, day) + np.pi,
        erfa.fal03(t),
        erfa.falp03(t),
        erfa.faf03(t),
        erfa.fad03(t),
        erfa.faom03(t),
    )
    return np.stack(columns, axis=-1)
