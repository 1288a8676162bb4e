import itertools

import numpy as np
import pytest
import torch
from tests.models.learned.problem import fractional_error, samples

from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.models.learned._spectral_training import SpectralStack, _Work
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


@pytest.mark.parametrize(("layers", "width"), [(1, 5), (2, 7), (4, 16)])
def test_the_backward_pass_by_hand_is_that_of_autograd(layers, width):
    rng = np.random.default_rng(0)
    x, t = (
        torch.from_numpy(rng.normal(size=(2, 30, 3))),
        torch.from_numpy(rng.normal(size=(2, 30, 3))),
    )
    share = 1.5
    stack = SpectralStack(layers, width, share, [0, 1], torch.device("cpu"))
    for group in stack._groups:
        group.normalise(share)
    work = _Work(x, stack._shapes)
    loss = stack._forward(work, t)
    stack._backward(work)
    weights = [w.clone().requires_grad_() for w in stack._weights]
    biases = [b.clone().requires_grad_() for b in stack._biases]
    lefts = [v for g in stack._groups for v in g._left.split(2)]
    rights = [v for g in stack._groups for v in g.right.split(2)]
    h = x
    for k, (w, b) in enumerate(zip(weights, biases, strict=True)):
        # torch's own spectral normalisation: singular vectors are constants
        h = h @ (w * (share / (lefts[k].mT @ w @ rights[k]))).mT + b
        h = torch.relu(h) if k < layers else h
    theirs = ((h - t) ** 2).mean(dim=(1, 2))
    theirs.sum().backward()
    torch.testing.assert_close(loss, theirs.detach(), rtol=1e-13, atol=0)
    for ours, parameter in zip(stack._d_weights + stack._d_biases, weights + biases, strict=True):
        # rounding of a few hundred terms of order one
        torch.testing.assert_close(ours, parameter.grad, rtol=1e-11, atol=1e-13)


def test_single_precision_learns_as_well_and_keeps_its_bound():
    X, y, held, _ = samples()
    double, single = (
        SpectralMLP(layers=3, width=32, epochs=300, precision=p).fit(X, y)
        for p in ("double", "single")
    )
    # the courses part after some epochs; the losses stay alike
    assert single.loss_ < 2 * double.loss_
    assert single.predict(held).dtype == np.float64
    assert single.lipschitz_bound_ <= 30 * single._scaling.slope * (1 + 1e-12)
    with pytest.raises(ConfigError, match=r'precision is "half"\. Allowed: double, single'):
        SpectralMLP(precision="half").fit(X, y)
