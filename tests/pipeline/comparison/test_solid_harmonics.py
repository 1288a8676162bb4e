"""Terms of potentials: Laplace's equation, no curl, and the zonal effect as truth."""

from __future__ import annotations

import numpy as np
import pytest

from unmodeled.models.physics import Dynamics, Zonal
from unmodeled.pipeline.comparison.solid_harmonics import (
    outer_gradients,
    surface_harmonics,
    tidal_gradients,
)

POINTS = np.array([[2.0, 0.3, -0.7], [-1.2, 1.9, 0.8], [0.4, -1.0, 2.2]])


@pytest.mark.parametrize(
    "gradients", [lambda r: outer_gradients(r, 5, 1.3), lambda r: tidal_gradients(r, 1.3)]
)
def test_no_divergence_and_no_curl(gradients):
    h = 1e-5
    jacobian = np.stack(
        [(gradients(POINTS + h * e) - gradients(POINTS - h * e)) / (2 * h) for e in np.eye(3)],
        axis=2,
    )
    # Truncation h^2 f''' / 6 and rounding 1e-16 / h, both below 1e-9 of the largest derivative.
    tolerance = 1e-8 * np.abs(jacobian).max()
    assert np.abs(np.einsum("niip->np", jacobian)).max() < tolerance
    assert np.abs(jacobian - np.swapaxes(jacobian, 1, 2)).max() < tolerance


def test_degree_two_is_j2():
    model = Dynamics([Zonal((2,))], {"GM": 3.0, "R_ref": 1.3, "J2": 1e-2})
    states = np.hstack([POINTS, np.zeros_like(POINTS)])
    own = -1e-2 * 3.0 / 1.3 * outer_gradients(POINTS, 2, 1.3, 2)[:, :, 0] * 1.3
    np.testing.assert_allclose(own / 1.3, model.acceleration(states), rtol=1e-12)


def test_counts():
    assert outer_gradients(POINTS, 4, 1.0, 2).shape == (3, 3, 5 + 7 + 9)
    assert surface_harmonics(POINTS / np.linalg.norm(POINTS, axis=1)[:, None], 3).shape == (3, 16)
