"""Scores, thresholds and search on synthetic signals, where the right answer is known."""

import numpy as np
import pytest
import scipy.stats
from numpy.testing import assert_allclose
from tests.pipeline.diagnosis.synthetic import Lin, N, pool_of

from unmodeled.models.physics import ConstantInertial, ScaledField, Tesseral
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.diagnosis.alternatives import other_sets
from unmodeled.pipeline.diagnosis.pool import Pool, log_p
from unmodeled.pipeline.diagnosis.search import best_set
from unmodeled.pipeline.diagnosis.threshold import (
    chi_square_threshold,
    needed_noncentrality,
    smallest_p_threshold,
)


def directions(seed, *names):
    rng = np.random.default_rng(seed)
    return {n: rng.standard_normal((N, 1)) for n in names}


def test_score_is_least_squares():
    table = directions(0, "a", "b")
    r = 2.0 * table["a"][:, 0] - table["b"][:, 0] + np.random.default_rng(1).standard_normal(N)
    pool = pool_of(table, r)
    both = np.hstack(list(table.values()))
    theta, left = np.linalg.lstsq(both, r)[:2]
    score = pool.score((0, 1))
    assert_allclose(score.estimate, theta, rtol=1e-10)
    assert_allclose(score.drop, r @ r - left[0], rtol=1e-10)
    assert_allclose(score.noise**2, left[0] / (N - 2), rtol=1e-10)
    assert_allclose(score.covariance, np.linalg.inv(both.T @ both) * left[0] / (N - 2), rtol=1e-8)
    # What b adds beside a is the difference of the two.
    drops, _ = pool.gains((0,))
    assert_allclose(drops[1], score.drop - pool.score((0,)).drop, rtol=1e-8)


def test_p_value_is_that_of_the_f_test_and_does_not_underflow():
    f = (30.0 / 2) / ((700.0 - 30.0) / 598)
    expected = scipy.stats.f.logsf(f, 2, 598)
    assert_allclose(log_p(np.array([30.0]), np.array([2]), 700.0, 600), expected, rtol=1e-8)
    huge = log_p(np.array([1e9, 2e9]), np.array([1, 1]), 2e9 + 600, 600)
    assert np.all(np.isfinite(huge))
    assert huge[1] < -4000 < huge[0] == pytest.approx(300 * np.log(0.5), rel=0.02)


def test_threshold_holds_its_level_on_overlapping_candidates():
    """The share of noise-only draws that pass is the level, whatever the overlap."""
    rng = np.random.default_rng(3)
    base = rng.standard_normal((N, 12))
    table = {
        f"c{k}": base[:, [k // 2]] + 0.2 * base[:, [6 + k // 2]] * (-1) ** k for k in range(12)
    }
    table |= {"triple": rng.standard_normal((N, 3))}
    limit = smallest_p_threshold(pool_of(table, np.ones(N)), (), 0.05, rng)
    passed = 0
    for _ in range(600):
        _, p = pool_of(table, rng.standard_normal(N)).gains(())
        passed += p.min() < limit
    low, high = scipy.stats.binom.interval(0.999, 600, 0.05)
    assert low <= passed <= high
    # Overlap makes it milder than Bonferroni's.
    assert np.log(0.05 / 13) < limit < np.log(0.05)


def test_noise_that_was_stated_wrongly_changes_no_p_value():
    table = directions(5, "a", "b")
    r = np.random.default_rng(6).standard_normal(N) + 0.2 * table["a"][:, 0]
    _, stated = pool_of(table, r).gains(())
    _, doubled = pool_of(table, 2.0 * r).gains(())
    assert_allclose(stated, doubled, rtol=1e-9)


@pytest.mark.parametrize(("rho", "strength"), [(0.5, 20.0), (0.9, 40.0), (0.98, 100.0)])
def test_right_label_follows_the_rule(rho, strength):
    """P(right of two) = Phi(sqrt(lambda (1 - rho) / 2)), and never more."""
    rng = np.random.default_rng(7)
    u, v = np.linalg.qr(rng.standard_normal((N, 2)))[0].T
    a, b = u, rho * u + np.sqrt(1 - rho**2) * v
    table = {"a": 100 * a[:, None], "b": 100 * b[:, None]}
    right = 0
    for _ in range(600):
        pool = pool_of(table, np.sqrt(strength) * a + rng.standard_normal(N))
        right += pool.score((0,)).evidence > pool.score((1,)).evidence
    expected = scipy.stats.norm.cdf(np.sqrt(0.5 * strength * (1 - rho)))
    low, high = scipy.stats.binom.interval(0.999, 600, expected)
    assert low <= right <= high


def test_power_needs_the_stated_noncentrality():
    limit = np.log(0.01 / 30)
    assert chi_square_threshold(limit, 1) == pytest.approx(12.9, abs=0.05)
    assert needed_noncentrality(limit, 1) == pytest.approx(23.7, abs=0.1)
    assert needed_noncentrality(limit, 3) == pytest.approx(29.0, abs=0.1)


def test_search_undoes_a_blend_of_two():
    """A column between two effects explains most of their sum; both together explain all."""
    table = directions(9, "a", "b", "c", "d")
    table["blend"] = table["a"] + table["b"] + 0.3 * directions(99, "own")["own"]
    r = 2.0 * (table["a"] + table["b"])[:, 0] + np.random.default_rng(10).standard_normal(N)
    pool = pool_of(table, r)
    alone = [pool.score((k,)).drop for k in range(5)]
    assert int(np.argmax(alone)) == 4
    limit = np.log(0.01 / 5)
    assert best_set(pool, (), limit, 2).members == (0, 1)
    # One at a time, too: the blend is split.
    assert best_set(pool, (), limit, 1).members == (0, 1)
    assert best_set(pool, (4,), limit, 1).members == (0, 1)


def test_two_that_explain_the_same_are_equal_however_strong_the_signal():
    table = directions(11, "a")
    table["b"] = table["a"] + 1e-6 * directions(12, "b")["b"]
    r = 1e4 * table["a"][:, 0] + np.random.default_rng(13).standard_normal(N)
    pool = pool_of(table, r, prior=1e4)
    assert abs(pool.score((0,)).evidence - pool.score((1,)).evidence) < 3.0


def test_what_passes_the_threshold_is_reported_even_if_the_prior_is_wide():
    """Detection is decided by the p-value: a vague prior must not hide an effect."""
    table = directions(14, "a", "b", "c")
    rng = np.random.default_rng(15)
    r = rng.standard_normal(N)
    column = table["a"][:, 0]
    r += (5.5 - column @ r / np.linalg.norm(column)) * column / np.linalg.norm(column)
    pool = pool_of(table, r, prior=1e9)
    assert pool.score((0,)).evidence < 0
    assert best_set(pool, (), np.log(0.01 / 3), 2).members == (0,)


def test_a_harmonic_and_a_field_that_contains_it_are_never_in_one_set():
    table = directions(0, "field", "c41", "push")
    field, single = ScaledField(degree=8, order=8, part="tesserals", min_degree=2), Tesseral(4, 1)
    effects = {"field": field, "c41": single, "push": ConstantInertial()}

    class Labelled(Lin):
        def columns(self, effect, values, names):
            return self.table[next(n for n, e in effects.items() if e == effect)]

    r = 9.0 * sum(c[:, 0] for c in table.values()) + np.random.default_rng(1).standard_normal(N)
    found = [
        Candidate(n, n, e, (e.parameters[0].name,), {e.parameters[0].name: 0.0}, (1.0,), "test")
        for n, e in effects.items()
    ]
    pool = Pool(Labelled(table, r), found)
    assert pool.excluded((0,)) == {"field", "c41"}
    assert pool.excluded((2,)) == {"push"}
    best = best_set(pool, (), float(np.log(1e-4)), 3)
    assert len(best.members) == 2
    assert "push" in pool.names(best)
    for s in other_sets(pool, best, float(np.log(1e-4))):
        assert not pool.names(s) >= {"field", "c41"}
