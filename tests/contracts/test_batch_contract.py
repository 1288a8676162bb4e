"""What a batch must do, for every learner: each member is its solo fit, whatever the batch."""

from functools import cache

import numpy as np
import pytest
import torch
from tests.contracts.learner_factories import LEARNER_FACTORIES
from tests.models.learned.problem import acceleration, orbit

from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.models.learned import ExactGP, NoiseLevel, SpectralMLP, fit_batch

pytestmark = pytest.mark.parametrize("key", LEARNER_FACTORIES)

#: Two sizes, mixed: the members of one size are trained side by side.
_SIZES = (60, 61, 60, 60, 61)
_HELD = orbit(2.0, 0.2, 70.0, 10.0, samples=15)


@cache
def problems():
    rng = np.random.default_rng(5)
    Xs, ys = [], []
    for k, n in enumerate(_SIZES):
        X = orbit(1.8 + 0.1 * k, 0.1 + 0.05 * k, 40.0 + 10 * k, 20.0 * k, samples=n)
        Xs.append(X)
        ys.append(acceleration(X) + 0.02 * rng.normal(size=X.shape))
    return Xs, ys, [NoiseLevel(acceleration=0.02 * (k % 2)) for k in range(len(_SIZES))]


@cache
def solos(key):
    make = LEARNER_FACTORIES[key].make
    return [make().fit(X, y, n) for X, y, n in zip(*problems(), strict=True)]


def same(a, b):
    """Equal to the last bit in everything that is saved and reported."""
    ours, theirs = a._arrays(), b._arrays()
    return (
        ours.keys() == theirs.keys()
        and all(np.array_equal(ours[k], theirs[k]) for k in ours)
        and a.facts() == b.facts()
        and np.array_equal(a.predict(_HELD), b.predict(_HELD))
    )


def test_a_member_is_its_solo_fit(key):
    learner = LEARNER_FACTORIES[key].make()
    before = repr(learner)
    members = fit_batch(learner, *problems())
    assert all(same(m, s) for m, s in zip(members, solos(key), strict=True))
    assert repr(learner) == before
    assert not hasattr(learner, "n_samples_")
    assert [m.n_samples_ for m in members] == list(_SIZES)


@pytest.mark.parametrize("order", [(3,), (4, 1), (2, 0, 3, 1)])
def test_order_and_neighbours_do_not_matter(key, order):
    given = ([column[k] for k in order] for column in problems())
    members = fit_batch(LEARNER_FACTORIES[key].make(), *given)
    assert all(same(m, solos(key)[k]) for m, k in zip(members, order, strict=True))


def test_threads_do_not_matter(key):
    members = fit_batch(LEARNER_FACTORIES[key].make(), *problems(), threads=3)
    assert all(same(m, s) for m, s in zip(members, solos(key), strict=True))


def test_progress_rises_to_one(key):
    told = []
    fit_batch(LEARNER_FACTORIES[key].make(), *problems(), progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_bad_batches_are_refused_with_a_reason(key):
    learner = LEARNER_FACTORIES[key].make()
    Xs, ys, noises = problems()
    with pytest.raises(DataError, match="5 sets of positions, 4 of accelerations"):
        fit_batch(learner, Xs, ys[:-1], noises)
    with pytest.raises(DataError, match="X has 60 samples and y has 61"):
        fit_batch(learner, Xs[:1], ys[1:2])
    with pytest.raises(ConfigError, match=r'device is "abacus"\. Allowed: cpu, cuda'):
        fit_batch(learner, Xs, ys, device="abacus")
    with pytest.raises(ConfigError, match=r"threads is 0\. Allowed: 1 or more"):
        fit_batch(learner, Xs, ys, threads=0)
    if not torch.cuda.is_available():
        with pytest.raises(ConfigError, match="torch finds 0 graphics cards"):
            fit_batch(learner, Xs, ys, device="cuda")
    assert fit_batch(learner, [], []) == []


def test_a_failure_stays_with_its_member(key):
    learner = LEARNER_FACTORIES[key].make()
    if not isinstance(learner, SpectralMLP | ExactGP):
        pytest.skip("a fit in closed form does not diverge")
    Xs, ys, _ = problems()
    if isinstance(learner, SpectralMLP):
        # float32 overflows at the first member, whose rate is absurd
        bad = SpectralMLP(layers=3, width=32, epochs=20, learning_rate=1e300)
        good = SpectralMLP(layers=3, width=32, epochs=20)
        members = fit_batch([bad, good], Xs[:2], ys[:2])
        assert same(members[1], good.fit(Xs[1], ys[1]))
        return
    # sixty times the same two points, and a floor that does not lift them apart
    X = np.repeat(Xs[0][:2], 30, axis=0) * (1 + 1e-16)
    singular = ExactGP(epochs=3, noise_floor=1e-300, optimizer=learner.optimizer)
    members = fit_batch([singular, learner], [X, Xs[0]], [acceleration(X), ys[0]])
    assert isinstance(members[0], NumericalError) or members[0].jitter_ >= 0
    assert same(members[1], fit_batch(learner, Xs[:1], ys[:1])[0])
