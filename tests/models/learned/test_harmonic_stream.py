"""Fit of the harmonic GP from chunks of samples."""

import numpy as np
import pytest
from tests.models.learned.problem import acceleration, other_orbit, samples

from unmodeled.core.errors import DataError, InputError
from unmodeled.models.learned import HarmonicGP, NoiseLevel


@pytest.fixture(scope="module")
def many():
    """More than two blocks."""
    rng = np.random.default_rng(4)
    X = rng.normal(size=(5000, 3))
    X *= (rng.uniform(1.2, 3.0, len(X)) / np.linalg.norm(X, axis=1))[:, None]
    deviations = rng.uniform(0.01, 0.1, X.shape)
    return X, acceleration(X) + deviations * rng.normal(size=X.shape), deviations


@pytest.mark.parametrize("sizes", [(5000,), (1, 2047, 2952), (37,) * 135 + (5,)])
@pytest.mark.parametrize("weighted", [False, True])
def test_a_stream_is_the_fit_in_memory_to_the_last_bit(many, sizes, weighted):
    X, y, deviations = many
    cuts = np.cumsum(sizes)[:-1]
    parts = [np.split(a, cuts) for a in ((X, y, deviations) if weighted else (X, y))]
    noise = NoiseLevel(acceleration=0.01)
    streamed = HarmonicGP(degree=4).fit_stream(zip(*parts, strict=True), noise)
    level = NoiseLevel(acceleration=0.01, samples=deviations if weighted else None)
    whole = HarmonicGP(degree=4).fit(X, y, level)
    ours, theirs = streamed._arrays(), whole._arrays()
    assert all(np.array_equal(ours[key], theirs[key]) for key in theirs)
    assert streamed.n_samples_ == whole.n_samples_ == 5000
    other = other_orbit()[0]
    assert np.array_equal(streamed.predict(other), whole.predict(other))


def test_chunks_are_taken_one_by_one_and_let_go(many):
    """No more than a block and a chunk is alive at any time."""
    X, y, _ = many
    alive = 0

    class Chunk(tuple):
        def __del__(self):
            nonlocal alive
            alive -= 1

    def chunks():
        nonlocal alive
        for k in range(0, 5000, 500):
            assert alive <= 1
            alive += 1
            yield Chunk((X[k : k + 500], y[k : k + 500]))

    HarmonicGP(degree=3).fit_stream(chunks())
    assert alive == 0


def test_bad_streams_are_refused_with_a_reason():
    X, y, _, _ = samples()
    learner = HarmonicGP()
    with pytest.raises(DataError, match=r"was given 2 training samples. Allowed: at least 4"):
        learner.fit_stream([(X[:2], y[:2])])
    with pytest.raises(DataError, match=r"was given 0 training samples"):
        learner.fit_stream([])
    with pytest.raises(DataError, match=r"chunk 1 has 1 parts. Allowed: \(positions, acc"):
        learner.fit_stream([(X, y), (X,)])
    with pytest.raises(DataError, match=r"X of chunk 1 has 238 samples and y has 237"):
        learner.fit_stream([(X, y), (X, y[1:])])
    with pytest.raises(DataError, match=r"X of chunk 0 has shape \(238, 2\)"):
        learner.fit_stream([(X[:, :2], y)])
    with pytest.raises(DataError, match=r"chunk 1 comes without noise.*Allowed: noise with every"):
        learner.fit_stream([(X, y, 0 * y + 1), (X, y)])
    with pytest.raises(DataError, match=r"238 samples and their noise has 2"):
        learner.fit_stream([(X, y, y[:2] * 0 + 1)])
    with pytest.raises(InputError, match=r"noise of positions.*Use fit\(X, y, noise\)"):
        learner.fit_stream([(X, y)], NoiseLevel(position=0.1))
    assert not hasattr(learner, "n_samples_")
