"""The test problem of the learners: samples along orbits about a Bennu-like body, normalised.

Positions follow a Kepler ellipse whose node and periapsis drift; accelerations are exact for the
zonal field gm/r - gm sum_n J_n r^-(n+1) P_n(z/r), written here independently of the package.
"""

from __future__ import annotations

import numpy as np

GM = 4 * np.pi**2
ZONALS = {2: 1.93e-2, 3: -1.22e-3, 4: -6.5e-3, 5: 6.73e-5}


def acceleration(X):
    r = np.linalg.norm(X, axis=1)[:, None]
    up, s = X / r, X[:, 2:] / r
    axis = np.array([0.0, 0.0, 1.0])
    total = -GM / r**2 * up
    for n, j in ZONALS.items():
        legendre = np.polynomial.Legendre.basis(n)
        radial = (n + 1) * legendre(s) * up
        total += GM * j * r ** -(n + 2) * (radial - legendre.deriv()(s) * (axis - s * up))
    return total


def orbit(a, e, inclination, node, samples=250, drift=0.05):
    """Positions at 25 equal steps a period; angles in degrees, drift in rad a period."""
    mean = 2 * np.pi * np.arange(samples) / 25
    eccentric = mean.copy()
    for _ in range(50):
        eccentric -= (eccentric - e * np.sin(eccentric) - mean) / (1 - e * np.cos(eccentric))
    x, y = a * (np.cos(eccentric) - e), a * np.sqrt(1 - e**2) * np.sin(eccentric)
    turn = drift * mean / (2 * np.pi)
    w, o, i = 0.3 + turn, np.radians(node) - turn, np.radians(inclination)
    u, v = np.cos(w) * x - np.sin(w) * y, np.sin(w) * x + np.cos(w) * y
    return np.stack(
        [
            np.cos(o) * u - np.sin(o) * np.cos(i) * v,
            np.sin(o) * u + np.cos(o) * np.cos(i) * v,
            np.sin(i) * v,
        ],
        axis=1,
    )


def samples(noise=0.0):
    """Training positions and accelerations (238, 3), and held-out ones (12, 3)."""
    X = orbit(1.9, 0.3, 60.0, 0.0)
    generator = np.random.default_rng(7)
    held = np.isin(np.arange(250), generator.choice(np.arange(1, 249), 12, replace=False))
    y = acceleration(X)
    noisy = y + noise * generator.normal(size=y.shape)
    return X[~held], noisy[~held], X[held], y[held]


def other_orbit():
    """Positions and accelerations (75, 3) of an orbit that was not sampled."""
    X = orbit(2.4, 0.45, 120.0, 100.0, samples=75)
    return X, acceleration(X)


def fractional_error(predicted, truth):
    """Median of |da| / |a|."""
    error = np.linalg.norm(predicted - truth, axis=1)
    return float(np.median(error / np.linalg.norm(truth, axis=1)))


def finite_difference_jacobian(predict, X, step=1e-5):
    """Central differences, (n, 3, 3)."""
    moves = step * np.eye(3)
    return np.stack([(predict(X + m) - predict(X - m)) / (2 * step) for m in moves], axis=-1)
