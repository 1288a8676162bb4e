"""Sets that explain as much, signs that nature does not have, residuals that are not white."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats
from tests.pipeline.diagnosis.synthetic import Lin, N, pool_of

from unmodeled.pipeline.diagnosis.alternatives import ODDS, as_good, other_sets
from unmodeled.pipeline.diagnosis.pool import Pool
from unmodeled.pipeline.diagnosis.stretches import DOUBTFUL, strength_by_stretches

LIMIT = float(np.log(1e-3))


def noise(seed):
    return np.random.default_rng(seed).standard_normal(N)


def sum_like(seed, share=0.999):
    """Return a, b, and c that is nearly their sum; unit norm each."""
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.standard_normal((N, 3)))
    a, b, other = q.T
    c = share * (a + b) / np.sqrt(2.0) + np.sqrt(1.0 - share**2) * other
    return {"a": a[:, None], "b": b[:, None], "c": c[:, None]}


def test_two_effects_whose_sum_is_like_a_third_are_an_alternative_to_it():
    table = sum_like(0)
    r = 20.0 * (table["a"] + table["b"])[:, 0] + noise(1)
    pool = pool_of(table, r, prior=30.0)
    chosen = pool.score((2,))
    (other,) = other_sets(pool, chosen, LIMIT)
    assert pool.names(other) == {"a", "b"}
    # And the other way round: the third alone explains as much as the two.
    both = pool.score((0, 1))
    assert {"c"} in [pool.names(s) for s in other_sets(pool, both, LIMIT)]


def test_a_set_that_explains_clearly_less_is_none():
    table = sum_like(0, share=0.8)
    r = 20.0 * (table["a"] + table["b"])[:, 0] + noise(1)
    pool = pool_of(table, r, prior=30.0)
    both = pool.score((0, 1))
    assert [pool.names(s) for s in other_sets(pool, both, LIMIT)] == []
    assert not as_good(pool.score((2,)), both)


def test_every_member_is_needed_and_no_set_contains_the_chosen_one():
    table = sum_like(3) | {"d": np.random.default_rng(9).standard_normal((N, 1))}
    r = 15.0 * (table["a"] + table["b"])[:, 0] + noise(2)
    pool = pool_of(table, r, prior=30.0)
    chosen = pool.score((2,))
    for s in other_sets(pool, chosen, LIMIT):
        assert not pool.names(s) >= {"c"}
        assert "d" not in pool.names(s)  # explains nothing


def test_nothing_found_has_no_alternatives():
    pool = pool_of(sum_like(0), noise(1))
    assert other_sets(pool, pool.score(()), LIMIT) == ()


def test_an_estimate_of_the_wrong_sign_counts_against_a_label():
    table = sum_like(0)
    r = -8.0 * table["a"][:, 0] + noise(4)
    free = pool_of(table, r, prior=10.0)
    held = [replace(m.candidate, positive=m.candidate.estimate) for m in free.members]
    pool = Pool(Lin(table, r), held)
    z = free.score((0,)).estimate[0] / np.sqrt(free.score((0,)).covariance[0, 0])
    expected = scipy.stats.norm.logcdf(z) + np.log(2.0)
    assert pool.score((0,)).wrong_sign == pytest.approx(expected, rel=1e-10)
    assert pool.score((0,)).evidence == pytest.approx(
        free.score((0,)).evidence + expected, rel=1e-10
    )
    # With the right sign nothing changes: the half of the prior that is lost was empty.
    r = -r
    assert Pool(Lin(table, r), held).score((0,)).wrong_sign == 0.0


def test_the_price_of_a_parameter():
    table = sum_like(0)
    s = pool_of(table, noise(5)).score((0, 1))
    assert s.worth == pytest.approx(s.drop / s.noise**2 - 4.0)
    assert as_good(replace(s, evidence=-1e9), s)
    worse = replace(s, evidence=-1e9, drop=s.drop - 2.01 * ODDS * s.noise**2)
    assert not as_good(worse, s)


@pytest.mark.parametrize(("colour", "stands"), [(0.0, True), (0.97, False)])
def test_white_residuals_keep_their_significance_and_coloured_ones_lose_it(colour, stands):
    """Slow noise imitates a slow signal; by stretches its significance is that of a few draws."""
    found = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        white = rng.standard_normal(N)
        slow = np.empty(N)
        slow[0] = white[0]
        for k in range(1, N):
            slow[k] = colour * slow[k - 1] + np.sqrt(1.0 - colour**2) * white[k]
        t = np.linspace(-1.0, 1.0, N)
        table = {"line": (t / np.linalg.norm(t))[:, None]}
        strength = 8.0 if stands else 0.0
        pool = pool_of(table, strength * table["line"][:, 0] + slow, prior=10.0)
        s = pool.score((0,))
        naive = float(np.sqrt(s.drop) / s.noise)
        found.append((naive, strength_by_stretches(pool, s, 0)))
    naive, robust = np.median(found, axis=0)
    if stands:
        assert robust == pytest.approx(naive, rel=0.25)  # 24 stretches: sigma of a sigma is 14 %
        assert robust > DOUBTFUL
    else:
        assert naive > DOUBTFUL  # what a test of white noise would believe
        assert robust < DOUBTFUL
