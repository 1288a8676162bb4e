"""Ladder: states and transition of a filter's integrator against heyoka's."""

from __future__ import annotations

import numpy as np

from unmodeled.models.physics import Dynamics, PointMass, Zonal
from unmodeled.pipeline.filters.catalogue_model import CatalogueModel
from unmodeled.pipeline.filters.runge_kutta import RungeKutta


def test_transition_is_that_of_the_variational_equations_in_heyoka():
    values = {"GM": 3.986004418e14, "R_ref": 6378137.0, "J2": 1.08263e-3}
    dynamics = Dynamics([PointMass(), Zonal((2,))], values)
    start = np.array([[7.0e6, 1.0e5, 0.0, 100.0, 1.0e3, 7.5e3], [8.0e6, 0, 1e5, 0, 7e3, 1e3]])
    model = RungeKutta(CatalogueModel(dynamics), 2.0)
    x, F = model.propagate(start, 0.0, 600.0)
    scale = np.array([7e6] * 3 + [7.5e3] * 3)
    for i in range(2):
        orbit = dynamics.propagate_variational(start[i], [0.0, 600.0])
        # fourth order: (2 s x 1e-3 1/s)^4 = 2e-11 for the step, less over a tenth of an orbit
        np.testing.assert_allclose(x[i] / scale, orbit.states[-1] / scale, rtol=0, atol=1e-10)
        unit = orbit.transition[-1] * scale / scale[:, None]
        np.testing.assert_allclose(F[i] * scale / scale[:, None], unit, rtol=0, atol=1e-8)
