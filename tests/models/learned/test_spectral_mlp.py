import itertools

import numpy as np
import pytest
import torch
from tests.models.learned.problem import fractional_error, samples

from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.models.learned.spectral_mlp import SpectralMLP


@pytest.fixture(scope="module", params=[1.0, 30.0], ids=["tight", "default"])
def fitted(request):
    X, y, _, _ = samples()
    return SpectralMLP(epochs=200, lipschitz=request.param).fit(X, y)


def test_no_slope_exceeds_the_bound(fitted):
    generator = np.random.default_rng(1)
    near = generator.normal(scale=2.0, size=(4000, 3))
    pairs = [
        (near, near + generator.normal(scale=scale, size=near.shape)) for scale in (1e-3, 0.1, 3.0)
    ]
    pairs.append((near, 100.0 * near))
    rounding = 1e-9  # of the difference quotient at the shortest distance
    for a, b in pairs:
        rise = np.linalg.norm(fitted.predict(a) - fitted.predict(b), axis=1)
        run = np.linalg.norm(a - b, axis=1)
        assert (rise / run).max() <= fitted.lipschitz_bound_ * (1 + rounding)
    slopes = np.linalg.norm(fitted.jacobian(near), 2, axis=(1, 2))
    assert slopes.max() <= fitted.lipschitz_bound_ * (1 + 1e-12)
    # and the bound is not idle: the network comes within a factor of a hundred
    assert slopes.max() > 0.01 * fitted.lipschitz_bound_


def test_bound_is_the_product_of_the_norms_and_below_what_was_asked(fitted):
    product = np.prod([np.linalg.svd(w)[1][0] for w in fitted._weights])
    facts = fitted.facts()
    assert facts["lipschitz_bound_scaled"] == pytest.approx(product, rel=1e-12)
    assert facts["lipschitz_bound_scaled"] <= fitted.lipschitz * (1 + 1e-12)
    assert facts["lipschitz_bound"] == pytest.approx(product * fitted._scaling.slope, rel=1e-12)
    # power iteration keeps up with training: little of the bound is given away
    assert facts["lipschitz_bound_scaled"] > 0.9 * fitted.lipschitz


def test_numpy_network_is_the_torch_network(fitted):
    X = samples()[2]
    modules = [torch.nn.Linear(*w.shape[::-1], dtype=torch.float64) for w in fitted._weights]
    for module, weight, bias in zip(modules, fitted._weights, fitted._biases, strict=True):
        module.weight.data, module.bias.data = torch.from_numpy(weight), torch.from_numpy(bias)
    layers = itertools.chain.from_iterable((m, torch.nn.ReLU()) for m in modules)
    network = torch.nn.Sequential(*list(layers)[:-1])
    scaled = torch.from_numpy(fitted._scaling.positions(X))
    expected = fitted._scaling.accelerations(network(scaled).detach().numpy())
    np.testing.assert_allclose(fitted.predict(X), expected, rtol=1e-12)
    for k, x in enumerate(scaled):
        slope = torch.autograd.functional.jacobian(network, x).numpy() * fitted._scaling.slope
        np.testing.assert_allclose(fitted.jacobian(X[k : k + 1])[0], slope, atol=1e-12)


def test_loss_is_that_of_the_frozen_network(fitted):
    X, y, _, _ = samples()
    error = fitted._scaling.targets(fitted.predict(X)) - fitted._scaling.targets(y)
    assert fitted.loss_ == pytest.approx(np.mean(error**2), rel=1e-9)


def test_default_shape_is_that_of_the_paper():
    model = SpectralMLP()
    assert (model.layers, model.width) == (6, 80)


def test_interpolation_and_that_a_bound_of_one_underfits():
    X, y, held, truth = samples()
    loose = SpectralMLP(epochs=800).fit(X, y)
    tight = SpectralMLP(epochs=800, lipschitz=1.0).fit(X, y)
    assert fractional_error(loose.predict(held), truth) < 0.03
    assert fractional_error(tight.predict(held), truth) > 0.1


def test_seed_decides_the_network():
    X, y, held, _ = samples()
    one, same, other = (SpectralMLP(epochs=5, random_state=s).fit(X, y) for s in (1, 1, 2))
    assert np.array_equal(one.predict(held), same.predict(held))
    assert not np.array_equal(one.predict(held), other.predict(held))


def test_one_hidden_layer_works():
    X, y, held, _ = samples()
    model = SpectralMLP(layers=1, width=8, epochs=5).fit(X, y)
    assert np.isfinite(model.predict(held)).all()


def test_diverged_training_is_an_error_or_finite_but_never_nan():
    X, y, _, _ = samples()
    wild = SpectralMLP(layers=2, width=8, epochs=20, learning_rate=1e3).fit(X, y)
    assert np.isfinite(wild.predict(X)).all()
    with pytest.raises(NumericalError, match="the loss of 238 samples is not finite"):
        SpectralMLP(layers=2, width=8, epochs=2, lipschitz=1e300).fit(X, y)


@pytest.mark.parametrize("key", ["layers", "width", "epochs", "learning_rate", "lipschitz"])
def test_hyperparameters_out_of_range(key):
    X, y, _, _ = samples()
    with pytest.raises(ConfigError, match=f"spectral_mlp: {key} is 0. Allowed: > 0"):
        SpectralMLP(**{key: 0}).fit(X, y)
