"""Evidence and posterior of ridge columns against the dense Gaussian."""

from __future__ import annotations

import numpy as np
import pytest

from unmodeled.pipeline.comparison.marginal import compress, ridge

RNG = np.random.default_rng(4)
COLUMNS = RNG.normal(size=(60, 5)) * [1.0, 3.0, 0.1, 1.0, 2.0]
RESIDUAL = COLUMNS @ [0.5, -0.2, 0.0, 0.3, 0.1] + RNG.normal(size=60)


def test_evidence_is_that_of_the_dense_gaussian():
    found = ridge(compress(COLUMNS, RESIDUAL), 60)
    # Beyond that the dense matrix has a condition above 1e8.
    for size, log in zip(found.sizes[:16], found.logs[:16], strict=True):
        K = np.eye(60) + size**2 * COLUMNS @ COLUMNS.T
        variance = RESIDUAL @ np.linalg.solve(K, RESIDUAL) / 60
        nothing = RESIDUAL @ RESIDUAL / 60
        # Both exponents are -30 with the variance at its best.
        dense = -0.5 * (60 * np.log(variance) + np.linalg.slogdet(K)[1])
        null = -0.5 * 60 * np.log(nothing)
        assert log == pytest.approx(dense - null, abs=1e-6)


def test_posterior_with_a_root():
    root = np.tril(RNG.normal(size=(5, 5)))
    found = ridge(compress(COLUMNS, RESIDUAL), 60, root)
    prior = found.size**2 * root @ root.T
    dense = np.linalg.solve(COLUMNS.T @ COLUMNS + np.linalg.inv(prior), COLUMNS.T @ RESIDUAL)
    np.testing.assert_allclose(root @ found.mean(), dense, rtol=1e-9)
    left = np.linalg.inv(COLUMNS.T @ COLUMNS + np.linalg.inv(prior))
    scaled = root @ found.right.T * found.size
    np.testing.assert_allclose((scaled * found.shrinkage()) @ scaled.T, left, rtol=1e-8)


def test_columns_of_nothing_are_worth_nothing():
    found = ridge(compress(np.zeros((60, 3)), RESIDUAL), 60)
    assert (found.log_bayes, found.size) == (0.0, 0.0)
    assert found.variance == pytest.approx(RESIDUAL @ RESIDUAL / 60)
