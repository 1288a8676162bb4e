"""Which pushes are offered, in which air, behind which shadows."""

import itertools

import numpy as np
import pytest

from unmodeled.core.constants import ASTRONOMICAL_UNIT
from unmodeled.core.ephemeris import load_ephemeris
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics, ExponentialDrag, PointMass
from unmodeled.models.physics.tracks import Tracks
from unmodeled.pipeline.cases.catalogue import default_candidates
from unmodeled.pipeline.cases.push_catalogue import air, occulter
from unmodeled.pipeline.cases.setting import Setting
from unmodeled.pipeline.cases.simulate_case import simulate
from unmodeled.pipeline.fit_problem import Arc
from unmodeled.pipeline.linearisation import Linearisation

EARTH, MOON = load_body("earth"), load_body("moon")


def arc(state, hours=24.0):
    times = np.linspace(60.0, hours * 3600.0, 50)
    m = Measurements("position", times, np.zeros((50, 3)), 1.0)
    return Arc(0.0, np.asarray(state, dtype=float), (m,), "one")


def ellipse(perigee, apogee):
    """State at *apogee* of an orbit between two altitudes."""
    low, high = perigee + EARTH.reference_radius, apogee + EARTH.reference_radius
    speed = np.sqrt(EARTH.gm * 2 * low / (high * (low + high)))
    return np.array([high, 0.0, 0.0, 0.0, speed, 0.0])


def test_the_air_is_that_of_the_periapsis():
    """Energy lost in a revolution, against the whole table: the first state says nothing of it."""
    state = ellipse(250e3, 5_000e3)
    known = Dynamics([PointMass()], {"GM": EARTH.gm})
    setting = Setting(EARTH, known, (arc(state),))
    assert setting.periapsis == pytest.approx(EARTH.reference_radius + 250e3, rel=1e-9)
    period = 2 * np.pi * np.sqrt((0.5 * (setting.periapsis + state[0])) ** 3 / EARTH.gm)
    times = np.linspace(0.0, period, 4001)
    orbit = known.propagate(state, times)
    speed = np.linalg.norm(orbit[:, 3:], axis=1)
    height = np.linalg.norm(orbit[:, :3], axis=1) - EARTH.reference_radius
    table = np.trapezoid(EARTH.atmosphere.density(height) * speed**3, times)

    def lost(values):
        drag = Dynamics([ExponentialDrag()], values | {"drag_B": 2.0, "drag_omega": 0.0})
        power = -np.sum(drag.acceleration(orbit) * orbit[:, 3:], axis=1)
        return np.trapezoid(power, times)

    # One layer in the place of several: the scale height grows upwards, by 10 % within it.
    assert lost(air(setting)) == pytest.approx(table, rel=0.15)
    layer = EARTH.atmosphere.layer(5_000e3)
    first = {
        "drag_rho0": layer.density,
        "drag_r0": EARTH.reference_radius + layer.altitude,
        "drag_H": layer.scale_height,
    }
    assert not 0.1 < lost(first) / table < 10.0


def test_winds_need_air_in_the_model():
    state = ellipse(500e3, 550e3)
    bare = Dynamics([PointMass()], {"GM": EARTH.gm})
    values = {"GM": EARTH.gm, "drag_B": 0.01} | air(Setting(EARTH, bare, (arc(state),)))
    drag = Dynamics([PointMass(), ExponentialDrag()], values)
    names = {
        key: {c.name for c in default_candidates(EARTH, model, [arc(state)])}
        for key, model in (("bare", bare), ("drag", drag))
    }
    assert "air_rotation" not in names["bare"]
    assert "air_rotation" in names["drag"]
    assert "lift" in names["bare"] & names["drag"]


def test_panels_are_for_high_satellites():
    sun = Tracks(-1.0, 1e6, {"sun": np.array([[ASTRONOMICAL_UNIT.value, 0.0, 0.0]])})
    model = Dynamics([PointMass()], {"GM": EARTH.gm}, tracks=sun)
    low, high = (
        {c.name: c for c in default_candidates(EARTH, model, [arc(ellipse(h, h + 1e5))])}
        for h in (800e3, 20_200e3)
    )
    assert "y_bias" not in low
    # A hundredth of 9e-8 m/s2: what GPS satellites show, 1e-9.
    assert 5e-10 < high["y_bias"].priors[0] < 2e-9
    assert not set(high["y_bias"].estimate) & set(high["panel_light"].estimate)


@pytest.mark.parametrize(("date", "found"), [("2025-03-14", "earth"), ("2025-04-14", "")])
def test_the_earth_throws_a_shadow_on_orbits_of_the_moon_at_eclipses(date, found):
    epoch = f"{date}T00:00:00 UTC"
    sky = load_ephemeris()
    places = {b: lambda t, b=b: sky.position(b, "moon", epoch, t) for b in ("sun", "earth")}
    model = Dynamics([PointMass()], {"GM": MOON.gm}, tracks=Tracks.fit(places, -10.0, 9e4))
    setting = Setting(MOON, model, (arc([1.9e6, 0.0, 0.0, 0.0, 0.0, 1.6e3]),))
    assert occulter(setting) == found
    names = {c.name: c for c in default_candidates(MOON, model, setting.arcs)}
    assert names["srp"].effect.occulter == found
    assert ("occulter_radius" in names["srp"].values) is bool(found)


def test_no_default_candidate_is_a_copy_of_another():
    """Columns of all candidates of the three-day Bennu case, what the orbit absorbs taken out."""
    made = simulate("bennu", 4)
    linear = Linearisation(made.case, made.case.fit())
    assert len(made.case.candidates) <= 32
    columns = {}
    for c in made.case.candidates:
        flat = linear.project(linear.candidate_columns(c)[-1])
        columns[c.name] = np.linalg.qr(flat)[0]
    for one, other in itertools.combinations(columns, 2):
        a, b = columns[one], columns[other]
        if a.shape[1] == b.shape[1]:
            alike = np.linalg.svd(a.T @ b, compute_uv=False).min()
            assert alike < 1.0 - 1e-5, (one, other, alike)
