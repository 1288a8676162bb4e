"""Kernels against closed forms and finite differences; the posterior against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

from unmodeled.pipeline.comparison.force_inference import (
    ForceData,
    gradient_root,
    smooth_root,
    wave_root,
)
from unmodeled.pipeline.comparison.force_inputs import ForceInputs
from unmodeled.pipeline.comparison.left_out import skill_and_error


def kernel(x, y, length):
    return np.exp(-0.5 * np.sum((x - y) ** 2) / length**2)


def test_roots_are_roots_of_the_kernel():
    x = np.random.default_rng(0).normal(size=(12, 3))
    root = smooth_root(x, 0.7)
    wanted = [[kernel(a, b, 0.7) for b in x] for a in x]
    np.testing.assert_allclose(root @ root.T, wanted, atol=1e-7)  # eigenvalues below 1e-8 are cut


def test_waves_are_the_kernel_on_the_circle():
    angle = np.linspace(0, 7, 15)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    root, full = wave_root(angle, 0.7, 12), smooth_root(circle, 0.7)
    # I_13(2) / exp(2) is 4e-11.
    np.testing.assert_allclose(root @ root.T, full @ full.T, atol=1e-7)


def test_gradient_kernel_is_minus_the_second_derivative():
    x = np.random.default_rng(1).normal(size=(4, 3))
    length, h = 0.9, 1e-3
    root = gradient_root(x, length)
    full = (root @ root.T).reshape(4, 3, 4, 3)
    for i in range(3):
        for j in range(3):
            di, dj = h * np.eye(3)[i], h * np.eye(3)[j]
            mixed = sum(
                s * t * kernel(x[0] + s * di, x[1] + t * dj, length)
                for s in (-1, 1)
                for t in (-1, 1)
            ) / (4 * h * h)
            # Of unit variance: times l^2. The step's own error is h^2.
            assert full[0, i, 1, j] == pytest.approx(length**2 * mixed, abs=1e-5)


def test_posterior_is_that_of_dense_algebra(noise_lin):
    data = ForceData(noise_lin, 78000.0)
    inputs = ForceInputs("inertial", "inertial", scale=(800.0,) * 3)
    turn, root = data.turn(inputs), smooth_root(data.inputs(inputs), 0.5)
    rng = np.random.default_rng(0)
    true = 3e-9 * np.kron(root, np.eye(3)) @ rng.normal(size=3 * root.shape[1])
    data.lin.residuals, kept = (
        data.rows(turn, true[:, None])[:, 0] + data.residual,
        data.lin.residuals,
    )
    try:
        data = ForceData(noise_lin, 78000.0)
    finally:
        noise_lin.residuals = kept
    smooth = data.weigh(data.turned(turn), root)
    B = data.rows(turn, smooth.root)
    s2 = smooth.found.size**2
    dense = np.linalg.solve(B.T @ B + np.eye(B.shape[1]) / s2, B.T @ data.residual)
    wanted = (smooth.root @ dense).reshape(-1, 3)
    # Directions that show less than 3e-4 of the best are left out.
    assert np.linalg.norm(smooth.mean() - wanted) < 1e-2 * np.linalg.norm(wanted)
    pull = (smooth.mean() - true.reshape(-1, 3)) / smooth.sigma()
    # Errors of neighbours are correlated: some twenty independent ones an axis.
    assert np.sqrt(np.mean(pull**2)) == pytest.approx(1.0, abs=0.4)


def test_skill_and_its_error_by_hand():
    # Skills of the three jackknife samples are 1/2, 3/4, 1/2.
    skill, error = skill_and_error(np.array([1.0, 3.0, 1.0]), np.array([4.0, 4.0, 4.0]))
    values = np.array([1 - 4 / 8, 1 - 2 / 8, 1 - 4 / 8])
    assert skill == pytest.approx(7 / 12)
    assert error == pytest.approx(np.sqrt(2 / 3 * np.sum((values - values.mean()) ** 2)))
    assert skill_and_error(np.ones(1), np.ones(1))[1] == np.inf
