"""Orbits with known accelerations, and the folder of real files."""

import os
from pathlib import Path

import heyoka as hy
import numpy as np
import pytest

GM, RADIUS, J2 = 3.986004415e14, 6378136.3, 1.0826e-3


def j2_acceleration(r):
    x, y, z = r.T
    d = np.linalg.norm(r, axis=1)
    k = 1.5 * J2 * GM * RADIUS**2 / d**5
    f = 5 * z**2 / d**2
    return np.stack(
        [
            -GM * x / d**3 - k * x * (1 - f),
            -GM * y / d**3 - k * y * (1 - f),
            -GM * z / d**3 - k * z * (3 - f),
        ],
        axis=1,
    )


@pytest.fixture(scope="session")
def j2_orbit():
    """A function (a, e, times) -> positions, velocities, accelerations; a Taylor integration."""
    x, y, z, vx, vy, vz = hy.make_vars("x", "y", "z", "vx", "vy", "vz")
    d2 = x * x + y * y + z * z
    d3 = hy.sqrt(d2) * d2
    k = 1.5 * J2 * GM * RADIUS**2 / (d3 * d2)
    f = 5.0 * z * z / d2
    integrator = hy.taylor_adaptive(
        [
            (x, vx),
            (y, vy),
            (z, vz),
            (vx, -GM * x / d3 - k * x * (1.0 - f)),
            (vy, -GM * y / d3 - k * y * (1.0 - f)),
            (vz, -GM * z / d3 - k * z * (3.0 - f)),
        ],
        [1.0] * 6,
    )

    def orbit(a, e, times, inclination=0.9):
        periapsis = a * (1 - e)
        v = np.sqrt(GM * (1 + e) / periapsis)
        integrator.time = float(times[0])
        integrator.state[:] = [
            periapsis, 0, 0, 0, v * np.cos(inclination), v * np.sin(inclination)
        ]  # fmt: skip
        states = integrator.propagate_grid(list(times))[-1]
        assert len(states) == len(times)
        return states[:, :3], states[:, 3:], j2_acceleration(states[:, :3])

    return orbit


@pytest.fixture(scope="session")
def real_folder():
    """The folder of real measurements; skips where it is absent."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "real"
    folder = Path(os.environ.get("UNMODELED_DATA", beside))
    if not folder.is_dir():
        pytest.skip(f"no folder of real measurements at {folder}: set UNMODELED_DATA")
    return folder
