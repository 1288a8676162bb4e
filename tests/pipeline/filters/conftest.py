"""Small models that several filter tests share; nothing here comes from the package's dynamics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest


@dataclass(frozen=True)
class ThreeBody:
    """Circular restricted three-body problem, rotating axes, normalised units [Szebehely1967]."""

    mu: float = 0.012150584269542
    size: int = 6

    def rates(self, x, t):
        mu, r = self.mu, x[:, :3]
        first, second = r + np.array([mu, 0, 0]), r + np.array([mu - 1, 0, 0])
        r1 = np.linalg.norm(first, axis=1)[:, None]
        r2 = np.linalg.norm(second, axis=1)[:, None]
        rate = np.empty_like(x)
        rate[:, :3] = x[:, 3:]
        rate[:, 3:] = -(1 - mu) * first / r1**3 - mu * second / r2**3
        rate[:, 3] += x[:, 0] + 2 * x[:, 4]
        rate[:, 4] += x[:, 1] - 2 * x[:, 3]
        A = np.zeros((len(x), 6, 6))
        A[:, :3, 3:] = np.eye(3)
        for d, s, m in ((first, r1, 1 - mu), (second, r2, mu)):
            A[:, 3:, :3] += (
                m * (3 * d[:, :, None] * d[:, None, :] / s[:, :, None] ** 5)
                - m * np.eye(3) / s[:, :, None] ** 3
            )
        A[:, 3, 0] += 1
        A[:, 4, 1] += 1
        A[:, 3, 4], A[:, 4, 3] = 2, -2
        return rate, A


@dataclass(frozen=True)
class RangeAndRate:
    """Distance from the origin and its rate, as in [Fereoli2024]."""

    R: np.ndarray

    def h(self, x, t):
        r, v = x[:, :3], x[:, 3:6]
        d = np.linalg.norm(r, axis=1)[:, None]
        u = r / d
        rate = (u * v).sum(axis=1)[:, None]
        H = np.zeros((len(x), 2, x.shape[1]))
        H[:, 0, :3] = u
        H[:, 1, :3] = (v - rate * u) / d
        H[:, 1, 3:6] = u
        return np.hstack([d, rate]), H


def clohessy_wiltshire(n):
    """System matrix (6, 6) of relative motion, x radial, y along the track [Curtis2020]."""
    A = np.zeros((6, 6))
    A[:3, 3:] = np.eye(3)
    A[3, 0], A[5, 2] = 3 * n * n, -n * n
    A[3, 4], A[4, 3] = 2 * n, -2 * n
    return A


def simulate(F, Q, H, R, x, steps, rng):
    """Return true states (k, b, n) and measurements (k, b, m) of a linear model."""
    root_Q, root_R = np.linalg.cholesky(Q), np.linalg.cholesky(R)
    truth, z = [], []
    for _ in range(steps):
        x = x @ F.T + rng.normal(size=x.shape) @ root_Q.T
        truth.append(x)
        z.append(x @ H.T + rng.normal(size=(len(x), len(R))) @ root_R.T)
    return np.array(truth), np.array(z)


@pytest.fixture
def three_body():
    return ThreeBody


@pytest.fixture
def range_and_rate():
    return RangeAndRate


@pytest.fixture
def relative_motion():
    return clohessy_wiltshire


@pytest.fixture
def simulated():
    return simulate
