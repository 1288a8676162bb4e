"""From a case file and its measurements to a case that can be fitted."""

from pathlib import Path

import numpy as np
import pytest

from unmodeled.core.earth_orientation import icrf_from_itrf
from unmodeled.core.ephemeris import load_ephemeris
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.datasets.bodies import heliocentric_orbits, load_body
from unmodeled.datasets.measurement_csv import write_measurements
from unmodeled.datasets.measurements import Measurements
from unmodeled.pipeline.cases.case_config import CaseConfig
from unmodeled.pipeline.cases.load_case import Ground, case_from_mapping, load_case
from unmodeled.pipeline.cases.read_data import stations_of
from unmodeled.pipeline.cases.write_case import write_case

EPOCH = "2019-01-01T00:00:00 TDB"  # of the mapping in conftest.py
STATE = np.array([620.0, 0.0, 350.0, 0.01, 0.07, 0.045])  # and its true state


def test_the_orbit_is_found_from_positions_alone(mapping, folder):
    case = load_case(write_case(mapping, folder / "case.yaml"))
    fit = case.fit()
    assert case.arcs[0].epoch == 600.0
    truth = case.dynamics.propagate(STATE, np.array([0.0, 600.0]))[-1]
    error = fit.states[0] - truth
    assert error @ np.linalg.solve(fit.covariance[:6, :6], error) < 26.0  # chi2(6), 1 in 5000
    assert 0.9 < fit.cost / fit.freedom < 1.1
    assert fit.iterations <= 5  # the first guess was near


@pytest.mark.parametrize("known", [[{"effect": "point_mass", "GM": "5.1 m3/s2"}]])
def test_a_poor_model_still_starts(mapping, folder, known):
    """Without J2 and with GM 4 % off: residuals of many sigmas, but an orbit."""
    case = case_from_mapping({**mapping, "known": known, "arcs": {"length": "1 d"}}, folder)
    assert len(case.arcs) == 3
    fit = case.fit()
    assert fit.cost / fit.freedom > 10
    assert np.abs(fit.residuals["residual"]).max() < 0.5 * np.linalg.norm(STATE[:3])


def test_arcs_and_what_is_held_out(mapping, folder):
    case = case_from_mapping({**mapping, "arcs": {"length": "1 d", "held_out": "last"}}, folder)
    assert [len(a.measurements[0].times) for a in case.arcs] == [144, 144]
    assert [a.name for a in case.held_out] == ["arc 3"]
    listed = [
        {"start": "0 h", "end": "12 h", "name": "first"},
        {"start": "2019-01-02T00:00:00 TDB", "end": "2 d", "role": "held_out"},
    ]
    case = case_from_mapping({**mapping, "arcs": listed}, folder)
    assert case.arcs[0].measurements[0].times[-1] == 12 * 3600.0
    assert case.held_out[0].measurements[0].times[[0, -1]].tolist() == [86_400.0, 172_800.0]


def test_an_initial_state_is_taken_at_the_epoch(mapping, folder):
    state = {"position": "620, 0, 350 m", "velocity": ["10 mm/s", "70 mm/s", "45 mm/s"]}
    case = case_from_mapping({**mapping, "initial_state": state}, folder)
    assert case.arcs[0].epoch == 0.0
    np.testing.assert_allclose(case.arcs[0].state, STATE, rtol=1e-15)


def test_few_positions_and_no_positions_are_refused(mapping, folder):
    few = [{**mapping["measurements"][0], "end": "50 min"}]
    with pytest.raises(DataError, match=r"arc 1 has 5 positions\. Allowed: 6 or more"):
        case_from_mapping({**mapping, "measurements": few}, folder)
    station = {"a": {"xyz": "0, 0, 290 m"}}
    m = Measurements(
        "range",
        np.arange(10.0),
        np.ones(10),
        1.0,
        station=_station(mapping, station),
    )
    with pytest.raises(DataError, match="arc 1 has range but no positions to start from"):
        case_from_mapping({**mapping, "stations": station}, folder, data=[m])


def _station(mapping, stations):
    config = CaseConfig.resolve({**mapping, "stations": stations})
    return stations_of(config, Ground.of(config, Path()).around)["a"]


def test_a_station_on_a_small_body_turns_with_it(mapping):
    place = {"latitude": "30 deg", "longitude": "40 deg", "height": "10 m"}
    station = _station(mapping, {"a": place})
    body = load_body("bennu")
    times = np.array([0.0, 1000.0])
    turn = body.body_fixed_from_icrf(EPOCH, times) @ body.pole_matrix().T
    fixed = 300.0 * np.array(
        [
            np.cos(np.pi / 6) * np.cos(np.radians(40)),
            np.cos(np.pi / 6) * np.sin(np.radians(40)),
            0.5,
        ]
    )
    expected = np.einsum("nji,j->ni", turn, fixed)
    np.testing.assert_allclose(station.inertial(EPOCH, times)[0], expected, atol=1e-9)


def test_positions_along_icrf_axes_are_turned_to_the_equator(mapping, folder, positions):
    m = positions(600.0 * np.arange(1, 101))
    turn = load_body("bennu").pole_matrix()
    write_measurements(
        [Measurements("position", m.times, m.values @ turn, 0.5, epoch=EPOCH)],
        folder / "icrf.csv",
    )
    entry = {"file": "icrf.csv", "kind": "position", "sigma": "file"}
    read = case_from_mapping({**mapping, "measurements": [entry]}, folder)
    np.testing.assert_allclose(read.arcs[0].measurements[0].values, m.values, atol=1e-9)
    # And the other way: equatorial data in a case along ICRF axes; the orbit is the same.
    back = case_from_mapping({**mapping, "frame": "icrf"}, folder)
    np.testing.assert_allclose(
        back.arcs[0].measurements[0].values[:100], m.values[:100] @ turn, atol=3.0
    )
    costs = [c.fit().cost for c in (back, case_from_mapping(mapping, folder))]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)


def test_the_sun_is_where_the_ephemeris_says(mapping, folder):
    known = [*mapping["known"], {"effect": "third_body", "body": "sun"}]
    case = case_from_mapping({**mapping, "known": known}, folder)
    times = np.array([1e3, 1e5])
    sun = load_ephemeris(None, heliocentric_orbits()).position("sun", "bennu", EPOCH, times)
    turned = sun @ load_body("bennu").pole_matrix().T
    np.testing.assert_allclose(case.dynamics.tracks.position("sun", times), turned, rtol=1e-9)


def test_the_earth_turns_as_its_orientation_says(mapping):
    """Earth-fixed positions in, the same out: tracks and orientation of an Earth case."""
    t = 120.0 * np.arange(1, 100)
    angle = t * np.sqrt(3.986e14 / 7e6**3)
    values = 7e6 * np.stack([np.cos(angle), np.sin(angle), 0 * t], axis=1)
    m = Measurements("position", t, values, 10.0, epoch="2016-03-13T00:00:00 UTC")
    earth = {
        **mapping,
        "body": "earth",
        "frame": "icrf",
        "epoch": m.epoch,
        "known": [{"effect": "point_mass"}],
    }
    case = case_from_mapping(earth, data=[m])
    found = case.dynamics.orientation.matrices(t)
    np.testing.assert_allclose(found, np.swapaxes(icrf_from_itrf(m.epoch, t), 1, 2), atol=1e-7)
    assert sorted(case.dynamics.tracks.coefficients) == ["moon", "sun"]


def test_a_body_written_out(mapping, folder):
    body = {
        "name": "rock",
        "gm": "4.89e-9 km3/s2",
        "brillouin_radius": "0.29 km",
        "zonals": {2: 0.0193},
    }
    case = case_from_mapping({**mapping, "body": body}, folder)
    assert (case.body.gm, case.body.radius) == (pytest.approx(4.89), 290.0)
    assert case.dynamics.tracks is None  # nobody knows where it is
    assert case.dynamics.orientation is None
    with pytest.raises(ConfigError, match=r"body\.gm is 4\.89 without a unit"):
        case_from_mapping({**mapping, "body": {**body, "gm": 4.89}}, folder)
    with pytest.raises(ConfigError, match='body has an unknown key "mass"'):
        case_from_mapping({**mapping, "body": {**body, "mass": 1}}, folder)


def test_candidates_can_be_named_or_left_out(mapping, folder):
    named = case_from_mapping({**mapping, "candidates": ["srp", "zonal_3"]}, folder)
    assert sorted(c.name for c in named.candidates) == ["srp", "zonal_3"]
    most = case_from_mapping({**mapping, "candidates": {"exclude": ["srp"]}}, folder)
    every = case_from_mapping({**mapping, "candidates": "default"}, folder)
    assert {c.name for c in every.candidates} - {c.name for c in most.candidates} == {"srp"}


def test_data_are_looked_for_in_further_folders(mapping, folder, tmp_path_factory):
    other = tmp_path_factory.mktemp("other")
    path = write_case(mapping, other / "case.yaml")
    assert len(load_case(path, [folder]).arcs) == 1
    with pytest.raises(DataError, match=r"looked for as .*Check the path, or name the folder"):
        load_case(path)


def test_directions_along_icrf_axes_are_turned_to_the_equator(mapping, folder, positions):
    """Right ascensions in a case along the body's equator: the same orbit as from positions."""
    m = positions(600.0 * np.arange(1, 101), noise=False)
    turn = load_body("bennu").pole_matrix()
    x, y, z = (m.values @ turn).T
    angles = np.stack([np.mod(np.arctan2(y, x), 2 * np.pi), np.arctan2(z, np.hypot(x, y))], axis=1)
    kind = "right_ascension_declination"
    for name, sigma in (("even.csv", 1e-4), ("uneven.csv", [1e-4, 2e-4])):
        write_measurements([Measurements(kind, m.times, angles, sigma, epoch=EPOCH)], folder / name)
    start = {"position": "620, 0, 350 m", "velocity": "1, 7, 4.5 cm/s"}
    entry = {"file": "even.csv", "kind": kind, "sigma": "file"}
    case = case_from_mapping({**mapping, "measurements": [entry], "initial_state": start}, folder)
    (read,) = case.arcs[0].measurements
    ra, dec = read.values.T
    lines = np.stack([np.cos(ra) * np.cos(dec), np.sin(ra) * np.cos(dec), np.sin(dec)], axis=1)
    size = np.linalg.norm(m.values, axis=1, keepdims=True)
    np.testing.assert_allclose(lines * size, m.values, atol=1e-9)
    # EME2000 for ICRF: 23 mas in any axes.
    eme = case_from_mapping(
        {**mapping, "measurements": [{**entry, "frame": "EME2000"}], "initial_state": start}, folder
    )
    off = eme.arcs[0].measurements[0].residuals(np.hstack([m.values, 0 * m.values]))
    assert 0.2 < np.linalg.norm(off, axis=1).max() / 1.1e-7 < 1.1
    for changes, message in (
        ({"frame": "ITRF"}, r"ITRF\. Allowed: ICRF, EME2000 \(23 mas from it\), body_equator"),
        ({"astrometric": True}, "reduced against stars, in a case whose frame is body_equator"),
        ({"file": "uneven.csv"}, "sigma differs between right ascension and declination"),
    ):
        with pytest.raises((ConfigError, DataError), match=message):
            case_from_mapping(
                {**mapping, "measurements": [{**entry, **changes}], "initial_state": start}, folder
            )
