"""The state-transition matrix by collocation against heyoka's variational equations."""

import numpy as np
from numpy.testing import assert_allclose

from unmodeled.models.physics import (
    Dynamics,
    PointMass,
    SolarRadiationPressure,
    SphericalHarmonics,
)
from unmodeled.models.physics.tracks import Tracks
from unmodeled.pipeline.partials import ArcPartials
from unmodeled.pipeline.transition import Panels, Transition


def test_harmonic_oscillator_is_exact():
    """G = -w^2: the matrix of sines and cosines, also between the nodes and at the end."""
    w, panels = 0.7, Panels(np.linspace(0.0, 9.0, 19))
    gradient = np.zeros((panels.nodes.size, 3, 6))
    gradient[:, :, :3] = -(w**2) * np.eye(3)
    times = np.array([0.0, 0.31, 4.5, 7.77, 9.0])
    # Position in units of 2 m, speed of 5 m/s: the blocks off the diagonal are 5/2 and 2/5 times.
    phi = Transition(panels, gradient, 2.0, 5.0).at(times)
    c, s = np.cos(w * times), np.sin(w * times)
    # Eight nodes over w h = 0.35: the interpolation between nodes is good to (w h / 4)^8.
    assert_allclose(phi[:, 0, 0], c, atol=1e-13)
    assert_allclose(phi[:, 4, 4], c, atol=1e-13)
    assert_allclose(phi[:, 1, 4], 2.5 * s / w, atol=1e-13)
    assert_allclose(phi[:, 5, 2], -0.4 * w * s, atol=1e-13)


def test_damping_is_exact():
    """D = -k: speeds fall exponentially."""
    k, panels = 0.3, Panels(np.linspace(0.0, 5.0, 11))
    gradient = np.zeros((panels.nodes.size, 3, 6))
    gradient[:, :, 3:] = -k * np.eye(3)
    phi = Transition(panels, gradient, 1.0, 1.0).at(np.array([5.0]))[0]
    assert_allclose(phi[3, 3], np.exp(-5.0 * k), atol=1e-14)
    assert_allclose(phi[0, 3], (1.0 - np.exp(-5.0 * k)) / k, atol=1e-14)


def test_panels_integrate_polynomials():
    panels = Panels(np.array([0.0, 1.0, 3.0]))
    panel, weights = panels.rules(np.array([0.4, 2.5]))
    nodes = panels.nodes[panel]
    found = np.sum(weights * nodes**7, axis=1)
    assert_allclose(found, [0.4**8 / 8, (2.5**8 - 1.0) / 8], rtol=1e-13)


def test_rough_field_that_turns_and_a_shadow():
    """A field of degree 12 in body axes, and a shadow that matters: light a tenth of gravity."""
    rng = np.random.default_rng(3)
    field = SphericalHarmonics(12)
    values = {p.name: 1e-3 * rng.standard_normal() for p in field.parameters if p.name[0] in "CS"}
    values |= {"GM": 4.0, "R_ref": 1.0, "spin_rate": 0.9, "shadow_radius": 1.0}
    values |= {"au": 100.0, "sun_radius": 1.0, "srp_pressure": 1.0, "srp_CrA_m": 2e-3}
    sun = Tracks(-1.0, 30.0, {"sun": np.array([[100.0, 0.0, 0.0]])})
    model = Dynamics(
        [PointMass(), field, SolarRadiationPressure()], values, spinning=True, tracks=sun
    )
    state, times = np.array([1.9, 0.3, 0.2, -0.1, 1.35, 0.3]), np.linspace(0.0, 20.0, 77)
    reference = model.propagate_variational(state, times, ["srp_CrA_m", "C_9_5"])
    arc = ArcPartials(model, 0.0, state, times)
    assert len(model.fly(state, 0.0, 0.0, 20.0).stops) >= 4  # it does go through the shadow
    size = np.abs(reference.transition).max()
    # A panel resolves the twelfth harmonic to 1e-7, half a penumbra to 1e-4 of the light.
    assert_allclose(arc.transition / size, reference.transition / size, atol=3e-6)
    answer = arc.response(
        model.parameter_partials(arc.node_states, ["srp_CrA_m", "C_9_5"], arc.nodes)
    )
    size = np.abs(reference.sensitivity).max(axis=(0, 1))
    assert_allclose(answer / size, reference.sensitivity / size, atol=1e-4)
