import math
import time

import numpy as np
import pandas as pd
import pytest

from unmodeled.core.errors import ConfigError, OrbitError
from unmodeled.core.seeds import Streams
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.elements import ELEMENT_NAMES, kepler_period
from unmodeled.datasets.initial_conditions import (
    SCREENING_PERIODS,
    TABLE_3,
    collision_free,
    require_collision_free,
    sample_elements,
    states_of,
)
from unmodeled.datasets.simulation import gravity_of

BODY = load_body("bennu")
R = BODY.brillouin_radius


def bennu():
    return gravity_of(BODY)


def draw(count, seed=1, ranges=None, **options):
    return collision_free(bennu(), R, count, Streams(seed), ranges, **options)


def test_ranges_of_the_paper():
    assert {k: tuple(v) for k, v in TABLE_3.items()} == {
        "semi_major_axis": (1.25, 3.0),
        "eccentricity": (0.05, 0.75),
        "inclination": (0.0, 180.0),
        "node": (0.0, 180.0),
        "periapsis": (0.0, 180.0),
        "true_anomaly": (0.0, 180.0),
    }
    assert SCREENING_PERIODS == 50.0


def test_samples_fill_their_ranges():
    n = 4000
    table = sample_elements(n, np.random.default_rng(0))
    assert list(table.columns) == list(ELEMENT_NAMES)
    for name, (low, high) in TABLE_3.items():
        share = (table[name] - low) / (high - low)
        assert share.between(0, 1).all()
        # uniform: mean 1/2 and variance 1/12; 6 standard errors
        assert abs(share.mean() - 0.5) < 6 * math.sqrt(1 / 12 / n)
        assert abs((share < 0.1).mean() - 0.1) < 6 * math.sqrt(0.09 / n)
    correlation = np.corrcoef(table.to_numpy().T)[np.triu_indices(6, 1)]
    assert np.abs(correlation).max() < 6 / math.sqrt(n)


def test_replaced_ranges():
    ranges = {"eccentricity": (0.1, 0.1), "node": (-20.0, 20.0)}
    table = sample_elements(50, np.random.default_rng(0), ranges)
    assert (table["eccentricity"] == 0.1).all()
    assert table["node"].between(-20, 20).all()
    assert table["semi_major_axis"].between(1.25, 3.0).all()
    assert (table["node"] < 0).any()


def test_a_shorter_list_is_the_head_of_a_longer_one():
    long = draw(40)
    assert len(long.elements) == 40
    assert long.states.shape == (40, 6)
    for count in (1, 3, 10, 16, 17):
        short = draw(count)
        pd.testing.assert_frame_equal(short.elements, long.elements.iloc[:count])
        assert np.array_equal(short.states, long.states[:count])
    assert not draw(3, seed=2).elements.equals(draw(3).elements)


def test_all_of_them_stay_outside():
    """Propagated again at full accuracy and sampled densely."""
    found = draw(12)
    for k in range(12):
        a = found.elements["semi_major_axis"].iloc[k] * R
        times = np.linspace(0, SCREENING_PERIODS * float(kepler_period(a, BODY.gm)), 50 * 400)
        radius = np.linalg.norm(bennu().propagate(found.states[k], times)[:, :3], axis=1)
        # Between two of 400 samples a period the radius dips below both by less than
        # r'' dt^2 / 8, r'' < 4 gm / R^2 and dt = 2 pi sqrt(a^3 / gm) / 400, a < 3 R: 4e-3 R.
        # The entry event itself is exact; this guards against one that was missed.
        assert radius.min() > R
    assert found.tried >= 12
    assert found.tried % 16 == 0


def test_states_belong_to_the_elements():
    found = draw(5)
    assert np.array_equal(found.states, states_of(found.elements, BODY.gm, R))
    x, v = found.states[:, :3], found.states[:, 3:]
    energy = 0.5 * np.sum(v**2, axis=1) - BODY.gm / np.linalg.norm(x, axis=1)
    a = -BODY.gm / (2 * energy) / R
    np.testing.assert_allclose(a, found.elements["semi_major_axis"], rtol=1e-13)


def test_share_of_free_orbits_about_bennu():
    """63.5 % of 200 (shared notes, GRAVITY.md); both counts within 6 standard errors."""
    n = 640
    table = sample_elements(n, Streams(3).generator("initial_conditions"))
    a = table["semi_major_axis"].to_numpy() * R
    entry = bennu().first_collision(states_of(table, BODY.gm, R), 50 * kepler_period(a, BODY.gm), R)
    share = np.isnan(entry).mean()
    error = math.sqrt(0.635 * 0.365 * (1 / 200 + 1 / n))
    assert abs(share - 0.635) < 6 * error
    # an orbit whose periapsis is outside by far never comes down; one inside always does
    periapsis = a * (1 - table["eccentricity"].to_numpy()) / R
    assert np.isnan(entry[periapsis > 1.3]).all()
    assert not np.isnan(entry[periapsis < 0.8]).any()


def test_a_longer_screening_finds_no_fewer_collisions():
    table = sample_elements(160, np.random.default_rng(1))
    states = states_of(table, BODY.gm, R)
    period = kepler_period(table["semi_major_axis"].to_numpy() * R, BODY.gm)
    short = bennu().first_collision(states, 5 * period, R)
    long = bennu().first_collision(states, 50 * period, R)
    hit = ~np.isnan(short)
    assert not np.isnan(long[hit]).any()
    # The same entry; only the stretches, and so the steps before it, differ.
    np.testing.assert_allclose(long[hit], short[hit], rtol=0, atol=1e-8 * period.max())
    assert hit.sum() <= (~np.isnan(long)).sum()


def test_collision_is_refused_by_name():
    table = pd.DataFrame(
        [[2.0, 0.2, 30, 0, 0, 0], [2.0, 0.6, 30, 0, 0, 180]], columns=list(ELEMENT_NAMES)
    )
    with pytest.raises(OrbitError) as caught:
        require_collision_free(bennu(), table, R, 10.0)
    text = str(caught.value)
    assert text.startswith(
        "orbit 1 (a = 2 Brillouin radii, e = 0.6) hits the body: it enters the Brillouin sphere "
        "of 290 m after 0."
    )
    assert text.endswith(" periods. Raise its semi-major axis or lower its eccentricity.")
    states = require_collision_free(bennu(), table.iloc[:1], R, 10.0)
    assert np.array_equal(states, states_of(table.iloc[:1], BODY.gm, R))


def test_start_inside_the_body():
    table = pd.DataFrame([[0.9, 0.0, 30, 0, 0, 0]], columns=list(ELEMENT_NAMES))
    with pytest.raises(OrbitError, match=r"after 0\.00 periods"):
        require_collision_free(bennu(), table, R, 1.0)


def test_ranges_without_a_free_orbit():
    with pytest.raises(OrbitError) as caught:
        draw(1, ranges={"semi_major_axis": (1.0, 1.05), "eccentricity": (0.3, 0.4)})
    assert str(caught.value) == (
        "none of 2000 orbits drawn in a row stays outside 290 m. "
        "Raise the range of semi_major_axis or lower that of eccentricity."
    )


@pytest.mark.filterwarnings("error")
def test_blocks_without_a_free_orbit_are_passed_over():
    found = draw(2, ranges={"semi_major_axis": (1.25, 1.3), "eccentricity": (0.15, 0.75)})
    assert len(found.elements) == 2
    assert found.tried > 16


@pytest.mark.parametrize(
    ("ranges", "kind", "text"),
    [
        (
            {"eccentricty": (0, 1)},
            ConfigError,
            'unknown orbital element "eccentricty". Did you mean "eccentricity"?',
        ),
        ({"node": (2, 1)}, ConfigError, "range of node is 2 to 1. Allowed: low <= high."),
        (
            {"node": (0, math.nan)},
            ConfigError,
            "range of node is 0 to nan. Allowed: low <= high.",
        ),
        (
            {"eccentricity": (0.1, 1.0)},
            OrbitError,
            "range of eccentricity is 0.1 to 1.0. Allowed: 0 <= e < 1.",
        ),
        (
            {"semi_major_axis": (0.0, 1.0)},
            ConfigError,
            "range of semi_major_axis starts at or below 0. Allowed: numbers > 0.",
        ),
    ],
)
def test_bad_ranges(ranges, kind, text):
    with pytest.raises(kind) as caught:
        draw(1, ranges=ranges)
    assert str(caught.value) == text


def test_bad_count():
    with pytest.raises(ConfigError) as caught:
        draw(0)
    assert str(caught.value) == "0 initial conditions are asked for. Allowed: 1 or more."


@pytest.mark.slow
def test_ten_thousand(capsys):
    """Time is printed, not asserted."""
    start = time.perf_counter()
    found = draw(10_000)
    seconds = time.perf_counter() - start
    with capsys.disabled():
        print(f"\n10,000 collision-free orbits (of {found.tried} drawn): {seconds:.1f} s")
    assert len(found.elements) == 10_000
    assert not found.elements.duplicated().any()
    share = 10_000 / found.tried
    assert abs(share - 0.635) < 6 * math.sqrt(0.635 * 0.365 * (1 / 200 + 1 / found.tried))
