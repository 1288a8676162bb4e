"""Independent orbit solutions for the physics tests."""

from __future__ import annotations

import math

import numpy as np


def kepler_orbit(state, gm, times):
    """States (n, 6) on the conic through ``state``, by mean anomaly; numpy only, e < 1.

    Positions and velocities come from Lagrange's f and g in the eccentric anomaly difference.
    """
    r0, v0 = np.array(state[:3], dtype=float), np.array(state[3:], dtype=float)
    radius = np.linalg.norm(r0)
    a = 1 / (2 / radius - v0 @ v0 / gm)
    n = math.sqrt(gm / a**3)
    e_cos, e_sin = 1 - radius / a, r0 @ v0 / math.sqrt(gm * a)
    out = []
    for t in times:
        mean = n * (t - times[0])
        d = mean  # eccentric anomaly since the start
        for _ in range(100):
            f = d - e_cos * math.sin(d) + e_sin * (1 - math.cos(d)) - mean
            step = f / (1 - e_cos * math.cos(d) + e_sin * math.sin(d))
            d -= step
            if abs(step) < 1e-15 * max(1.0, abs(d)):
                break
        r = a * (1 - e_cos * math.cos(d) + e_sin * math.sin(d))
        f = 1 - a / radius * (1 - math.cos(d))
        g = mean / n - (d - math.sin(d)) / n
        fdot = -math.sqrt(gm * a) / (r * radius) * math.sin(d)
        gdot = 1 - a / r * (1 - math.cos(d))
        out.append(np.concatenate([f * r0 + g * v0, fdot * r0 + gdot * v0]))
    return np.array(out)
