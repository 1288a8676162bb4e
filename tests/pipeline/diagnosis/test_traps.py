"""Known traps: what these data cannot tell apart, and instruments that look like physics."""

import numpy as np
import pytest
from tests.pipeline.diagnosis.conftest import DAY, EARTH, EPOCH, case_of, model, positions, state_of

from unmodeled.core.constants import GM_OF
from unmodeled.datasets.measurement_effects import FrameRotation, RangeBias, TimeTag
from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.slips import explain_rotation
from unmodeled.datasets.station import Station
from unmodeled.models.physics import ExponentialDrag, ThirdBody
from unmodeled.pipeline.diagnosis.diagnose import diagnose

AIR = {
    "drag_B": 2e-3,
    "drag_rho0": EARTH.atmosphere.layer(499e3).density,
    "drag_r0": EARTH.reference_radius + EARTH.atmosphere.layer(499e3).altitude,
    "drag_H": EARTH.atmosphere.layer(499e3).scale_height,
    "drag_omega": 7.292115e-5,
}
RIVALS = {"drag", "constant_transverse", "constant_radial", "zonal_3", "srp", "gm_error"}


@pytest.mark.parametrize(
    ("eccentricity", "sigma", "together"), [(0.0005, 30.0, True), (0.2, 1.0, False)]
)
def test_drag_is_a_constant_push_on_a_circular_orbit_only(
    surroundings, eccentricity, sigma, together
):
    a = 6877e3 / (1 - eccentricity)
    state = state_of(a, eccentricity, 1.1)
    truth = model(surroundings, [ExponentialDrag()], AIR)
    known = model(surroundings)
    answer = diagnose(case_of(known, state, [positions(truth, state, sigma, seed=2)], RIVALS))
    (finding,) = answer.findings
    assert "drag" in finding.class_names
    assert ("constant_transverse" in finding.class_names) is together
    if not together:
        assert finding.name == "drag"
        return
    pair = {"drag", "constant_transverse"}
    named = answer.further[["finding", "rival"]].to_numpy()
    advice = answer.further[[set(names) == pair for names in named]].set_index("data")
    # An eccentric arc samples the air at other heights; four times as many such data do not.
    apart = advice.loc["an arc with periapsis here and eccentricity 0.3 more"]
    more = advice.loc["four times as many such data"]
    assert more["correlation"] > 0.99
    assert more["probability"] < 0.9 < apart["probability"]


def earth_fixed(truth, state, offset):
    """Positions in Earth-fixed axes whose tags are late by an offset, noise 5 cm."""
    times = np.arange(300.0, DAY - 100, 300.0)
    plain = Measurements(
        "position", times, np.zeros((len(times), 3)), 0.05, "file", epoch=EPOCH, axes="earth_fixed"
    )
    real = TimeTag("file").applied(plain, {"time_tag[file]": offset})
    states = truth.propagate(state, np.concatenate([[0.0], real.times]))[1:]
    noise = 0.05 * np.random.default_rng(3).standard_normal((len(times), 3))
    values = real.observed(states) + noise
    return Measurements("position", times, values, 0.05, "file", epoch=EPOCH, axes="earth_fixed")


def test_time_scale_slip_is_named(surroundings):
    # Data in Earth-fixed axes hide a wrong clock from the field, which turns along; Sun and Moon
    # do not, and high up they are strong.
    state = state_of(2.0e7, 0.05, 1.0)
    bodies = {f"GM_{n}": GM_OF[n].value for n in ("sun", "moon")}
    truth = model(surroundings, [ThirdBody("sun"), ThirdBody("moon")], bodies)
    # GPS tags read as UTC: in 2015 they are 16 s ahead.
    case = case_of(truth, state, [earth_fixed(truth, state, -16.0)])
    answer = diagnose(case)
    assert answer.findings[0].family == "instrument"
    assert answer.findings[0].name == "time_tag"
    (offset,) = answer.findings[0].estimates
    assert offset.value == pytest.approx(-16.0, abs=4 * offset.sigma)
    assert any("GPS" in remark for remark in answer.findings[0].remarks)


def test_frame_slip_is_named(surroundings):
    state = state_of(7.2e6, 0.01, 1.2)
    truth = model(surroundings)
    clean = positions(truth, state, 0.5, seed=5)
    # Mean equator and equinox of date read as ICRF: precession over 15.16 years.
    angles = _precession()
    values = dict(zip(("x", "y", "z"), angles, strict=True))
    turned = FrameRotation().applied(clean, {f"frame_rotation_{k}": v for k, v in values.items()})
    states = truth.propagate(state, np.concatenate([[0.0], clean.times]))[1:]
    noise = clean.values - states[:, :3]
    data = Measurements("position", clean.times, turned.observed(states) + noise, 0.5, "positions")
    answer = diagnose(case_of(truth, state, [data]))
    assert answer.findings[0].name == "frame_rotation"
    assert any("of date" in remark for remark in answer.findings[0].remarks)


def _precession():
    import erfa

    from unmodeled.core.time import terrestrial_time
    from unmodeled.datasets.slips import _vector

    tt = terrestrial_time(EPOCH, 0.0)
    angles = _vector(erfa.bp06(float(tt.jd1), float(tt.jd2))[2])
    assert "of date" in explain_rotation(angles, [1e-8] * 3, EPOCH)
    return angles


def test_station_bias_is_named(surroundings):
    state = state_of(7.2e6, 0.01, 1.2)
    truth = model(surroundings)
    times = np.arange(60.0, DAY, 60.0)
    states = truth.propagate(state, np.concatenate([[0.0], times]))[1:]
    sets = []
    for k, (name, lat, lon) in enumerate((("A", 40.0, 0.0), ("B", -35.0, 149.0), ("C", 35, -117))):
        station = Station.from_geodetic(name, lat, lon, 500.0)
        track = station.track(EPOCH, times)
        line = states[:, :3] - track.positions
        up = np.einsum("nj,nj->n", line, track.north_east_up[:, 2])
        seen = up / np.linalg.norm(line, axis=1) > 0.2
        empty = Measurements("range", times, np.zeros((len(times), 1)), 1.0, name, station, EPOCH)
        m = empty.subset(seen)
        noise = np.random.default_rng(k).standard_normal((len(m.times), 1))
        values = m.observed(states[seen]) + noise + (4.0 if name == "B" else 0.0)
        sets.append(Measurements("range", m.times, values, 1.0, name, station, EPOCH))
    answer = diagnose(case_of(truth, state, sets))
    assert answer.findings[0].name == "range_bias[B]"
    assert len(answer.findings) == 1
    (bias,) = answer.findings[0].estimates
    assert bias.value == pytest.approx(4.0, abs=4 * bias.sigma)
    assert RangeBias("B").parameters[0].name == bias.name
