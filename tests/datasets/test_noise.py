import math

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.core.seeds import Streams
from unmodeled.datasets.noise import Noise, observe

N = 3000


def truth(n=N):
    x = np.random.default_rng(0).normal(size=(n, 3)) + np.array([2.0, 0, 0])
    return x, field(x)


def field(x):
    return np.sin(x) + x[:, [1, 2, 0]] ** 2


def draw(noise, seed=1, label="orbit-0", n=N):
    return observe(*truth(n), noise, field, Streams(seed), label)


def test_zero_sigma_is_the_truth():
    x, a = draw(Noise())
    assert np.array_equal(x, truth()[0])
    assert np.array_equal(a, truth()[1])


def test_zero_sigma_needs_no_field():
    x, a = truth()
    assert observe(x, a, Noise(0.0, 0.1), None, Streams(1), "a")[0] is x


def test_consistent_draws_lie_on_the_field():
    x, a = draw(Noise(state=0.1, draws="consistent"))
    assert np.array_equal(field(x), a)
    assert not np.array_equal(x, truth()[0])


def test_independent_draws_do_not():
    x, a = draw(Noise(state=0.1))
    assert np.abs(field(x) - a).min(axis=0).max() > 0
    # the error of the position and that of the field's argument are uncorrelated
    consistent = draw(Noise(state=0.1, draws="consistent"))[0]
    assert np.array_equal(a, field(consistent))  # Eq. 4's argument is the same in both readings
    r = np.corrcoef((x - truth()[0]).ravel(), (consistent - truth()[0]).ravel())[0, 1]
    assert abs(r) < 6 / math.sqrt(3 * N)


def test_sigma_scales_one_pattern():
    x, a = truth()
    small, large = draw(Noise(0.01, 0.02)), draw(Noise(0.03, 0.02))
    np.testing.assert_allclose(3 * (small[0] - x), large[0] - x, rtol=0, atol=1e-13)
    small, large = draw(Noise(0.0, 0.02)), draw(Noise(0.0, 0.06))
    np.testing.assert_allclose(3 * (small[1] - a), large[1] - a, rtol=0, atol=1e-13)


def test_acceleration_noise_does_not_depend_on_state_noise():
    # also the same stream for both readings
    both = draw(Noise(0.05, 0.1, "consistent"))
    np.testing.assert_allclose(
        both[1] - field(both[0]), draw(Noise(0.0, 0.1))[1] - truth()[1], rtol=0, atol=1e-13
    )


@pytest.mark.parametrize("draws", ["independent", "consistent"])
def test_statistics(draws):
    x, a = draw(Noise(0.2, 0.3, draws))
    errors = {"state": ((x - truth()[0]) / 0.2)}
    if draws == "consistent":
        errors["acceleration"] = (a - field(x)) / 0.3
    for error in errors.values():
        n = error.size
        assert abs(error.mean()) < 6 / math.sqrt(n)
        assert abs(error.std() - 1) < 6 / math.sqrt(2 * n)
        axes = np.corrcoef(error.T)[np.triu_indices(3, 1)]
        assert np.abs(axes).max() < 6 / math.sqrt(N)
        steps = np.mean(error[1:] * error[:-1])
        assert abs(steps) < 6 / math.sqrt(n)


def test_draws_depend_on_seed_and_label_only():
    same = draw(Noise(0.1, 0.1))
    again = draw(Noise(0.1, 0.1))
    assert all(np.array_equal(p, q) for p, q in zip(same, again, strict=True))
    for other in (draw(Noise(0.1, 0.1), seed=2), draw(Noise(0.1, 0.1), label="orbit-1")):
        assert not np.any(other[0] == same[0])
    # the first samples do not depend on how many follow
    head = observe(truth()[0][:10], truth()[1][:10], Noise(0.1, 0.1), field, Streams(1), "orbit-0")
    assert np.array_equal(head[0], same[0][:10])


def test_state_noise_needs_the_field():
    x, a = truth()
    with pytest.raises(ConfigError) as caught:
        observe(x, a, Noise(state=0.1), None, Streams(1), "a")
    assert str(caught.value) == (
        "noise.state is 0.1 for a measured trajectory. Allowed: 0. "
        "Eq. 4 needs the true field; add state noise to simulated data only."
    )


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_bad_sigma(value):
    for name in ("state", "acceleration"):
        with pytest.raises(ConfigError) as caught:
            Noise(**{name: value})
        assert str(caught.value) == f"noise.{name} is {value}. Allowed: a standard deviation >= 0."


def test_bad_draws():
    with pytest.raises(ConfigError) as caught:
        Noise(draws="both")
    assert str(caught.value) == 'noise.draws is "both". Allowed: independent, consistent.'
