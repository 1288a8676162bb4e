"""Answers of an orbit by quadrature against the variational equations of heyoka."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from unmodeled.models.physics import ConstantRTN, Dynamics, ImpulsiveManoeuvre, PointMass, Zonal
from unmodeled.pipeline.partials import ArcPartials

GM = 3.986004415e14
NAMES = ("GM", "J2", "rtn_a_T")


def earth(*more, **values):
    effects = (PointMass(), Zonal((2,)), ConstantRTN(), *more)
    return Dynamics(effects, {"GM": GM, "R_ref": 6378137.0, "J2": 1.08e-3, **values})


def orbit(eccentricity):
    r = 7.2e6
    v = np.sqrt(GM / r * (1 + eccentricity))
    return np.array([r, 1e5, 2e5, 0.0, 0.6 * v, 0.8 * v])


def quadrature(model, epoch, state, times, names=NAMES):
    p = ArcPartials(model, epoch, state, times)
    return p, p.response(model.parameter_partials(p.node_states, names, p.nodes))


@pytest.mark.parametrize("eccentricity", [0.001, 0.7])
def test_response_equals_the_variational_equations(eccentricity):
    model, times = earth(), np.linspace(0.0, 86400.0, 200)
    reference = model.propagate_variational(orbit(eccentricity), times, NAMES)
    p, answer = quadrature(model, 0.0, orbit(eccentricity), times)
    size = np.abs(reference.sensitivity).max(axis=(0, 1))
    assert_allclose(answer / size, reference.sensitivity / size, atol=1e-10)
    size = np.abs(reference.transition).max()
    assert_allclose(p.transition / size, reference.transition / size, atol=1e-11)


def test_epoch_inside_the_arc():
    model, times = earth(), np.linspace(0.0, 40000.0, 81)
    reference = model.propagate_variational(orbit(0.1), times, NAMES)
    k = 30
    expected = reference.sensitivity - reference.transition @ np.linalg.solve(
        reference.transition[k], reference.sensitivity[k]
    )
    p, answer = quadrature(model, times[k], reference.states[k], times)
    size = np.abs(expected).max(axis=(0, 1))
    assert_allclose(answer / size, expected / size, atol=1e-9)
    assert_allclose(p.transition[k], np.eye(6), atol=1e-9)


def test_kick_is_the_limit_of_a_short_push():
    times = np.linspace(0.0, 20000.0, 60)
    p = ArcPartials(earth(), 0.0, orbit(0.05), times)
    columns, epochs = p.kicks(np.array([8123.0]), "rtn")
    pushed = earth(
        ImpulsiveManoeuvre(), manoeuvre1_t0=epochs[0], manoeuvre1_width=2.0, manoeuvre1_dv_T=1e-3
    )
    still = pushed.with_values({"manoeuvre1_dv_T": 0.0})
    moved = pushed.propagate(orbit(0.05), times) - still.propagate(orbit(0.05), times)
    size = np.abs(moved).max(axis=0)
    assert_allclose(1e-3 * columns[:, :, 1] / size, moved / size, atol=3e-3)


def test_abrupt_forces_get_finer_panels():
    """The partial of a pulse of 2 s is right although nodes are half a minute apart elsewhere."""
    values = {"manoeuvre1_t0": 9000.0, "manoeuvre1_width": 2.0, "manoeuvre1_dv_T": 1e-2}
    model, times = earth(ImpulsiveManoeuvre(), **values), np.linspace(0.0, 20000.0, 40)
    names = ("manoeuvre1_dv_T", "manoeuvre1_t0")
    reference = model.propagate_variational(orbit(0.05), times, names).sensitivity
    _, answer = quadrature(model, 0.0, orbit(0.05), times, names)
    size = np.abs(reference).max(axis=(0, 1))
    assert_allclose(answer / size, reference / size, atol=1e-3)
