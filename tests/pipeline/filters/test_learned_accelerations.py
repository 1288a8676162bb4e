"""Learned accelerations in a filter: flight forms, held and continuous, bases and weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.core.units import NORMALISED_GM, NormalisedUnits
from unmodeled.models.learned import (
    ExactGP,
    HarmonicGP,
    NearestNeighbour,
    NoiseLevel,
    PointMassOnly,
    PotentialMLP,
    RBFNetwork,
    Residual,
    SpectralMLP,
    _harmonic_evidence,
)
from unmodeled.pipeline.filters.basis import HarmonicBasis, RBFBasis, RBFFeatures
from unmodeled.pipeline.filters.flight_form import FlightForm
from unmodeled.pipeline.filters.process_noise import WhiteAcceleration
from unmodeled.pipeline.filters.residual_network import (
    relative_percent,
    train_residual_network,
)
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.state import FilterState
from unmodeled.pipeline.filters.weights import (
    LinearAcceleration,
    RecursiveWeights,
    pseudo_inverse_weights,
)
from unmodeled.pipeline.filters.with_residual import HeldResidual, LearnedNoise, WithResidual
from unmodeled.pipeline.learned_field import LearnedField

UNITS = NormalisedUnits.of_body(gm=4.89, radius=290.0)


def samples(n=60, seed=0):
    """Positions at 1.5 to 2.5 radii, and the field of a point mass with a J2-like term."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, 3))
    X *= rng.uniform(1.5, 2.5, n)[:, None] / np.linalg.norm(X, axis=1)[:, None]
    basis = HarmonicBasis(2, NORMALISED_GM, 1.0)
    weights = np.zeros(9)
    weights[0], weights[4], weights[7] = 1.0, -0.02, 0.01
    return X, basis.evaluate(X, 0.0) @ weights


LEARNERS = {
    "exact_gp": lambda: ExactGP(epochs=20, noise_floor=1e-4),
    "exact_gp(matern52)": lambda: ExactGP(
        epochs=20, noise_floor=1e-4, optimizer="lbfgs", kernel="matern52"
    ),
    "exact_gp(matern12, ard)": lambda: ExactGP(
        epochs=20, noise_floor=1e-4, optimizer="lbfgs", kernel="matern12", ard=True
    ),
    "residual(exact_gp)": lambda: Residual(ExactGP(epochs=5, noise_floor=1e-4)),
    "rbf_network": lambda: RBFNetwork(centres=20),
    "residual(rbf_network)": lambda: Residual(RBFNetwork(centres=20)),
    "spectral_mlp": lambda: SpectralMLP(layers=3, width=16, epochs=50),
    "harmonic_gp": lambda: HarmonicGP(degree=4),
    "potential_mlp": lambda: PotentialMLP(width=6, steps=20),
    "residual(potential_mlp)": lambda: Residual(PotentialMLP(width=6, steps=20)),
    "nearest_neighbour": NearestNeighbour,  # has no form of its own: copied
    "point_mass": PointMassOnly,
}


@pytest.mark.parametrize("name", LEARNERS)
def test_flight_form_is_the_learner_to_the_last_digits_and_stays_as_it_is(name):
    X, y = samples()
    learner = LEARNERS[name]()
    learner.fit(X, y, NoiseLevel(acceleration=1e-3))
    field = LearnedField(learner, UNITS)
    flight = FlightForm.of(field)
    where = samples(25, seed=1)[0] * UNITS.length
    states = np.hstack([where, np.ones((25, 4))])
    a, J, C = flight.evaluate(states, 0.0)
    expected, slope = field.acceleration(where), field.jacobian(where)
    np.testing.assert_allclose(a, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert J.shape == (25, 3, 7)
    np.testing.assert_allclose(J[:, :, :3], slope, rtol=0, atol=1e-12 * np.abs(slope).max())
    assert not J[:, :, 3:].any()
    assert (C is None) == (not learner.has_covariance)
    if C is not None:
        covariance = field.covariance(where)
        np.testing.assert_allclose(C, covariance, rtol=0, atol=1e-12 * np.abs(covariance).max())
    learner.fit(X, 2.0 * y)
    np.testing.assert_array_equal(flight.evaluate(states, 0.0)[0], a)


def test_held_converges_to_continuous_with_first_order(three_body):
    X, y = samples()
    flight = FlightForm(
        FlightForm.of(LearnedField(RBFNetwork(centres=20).fit(X, 0.01 * y), UNITS)).field,
        NormalisedUnits(1.0, 1.0),
    )
    x = np.array([[0.6, 0.9, 0.2, 0.1, -0.2, 0.05]])
    whole, _ = RungeKutta(WithResidual(three_body(), flight), 0.005).propagate(x, 0.0, 0.4)
    errors = []
    for parts in (4, 8, 16):
        held, now = HeldResidual(three_body(), flight, 0.005), x
        for _ in range(parts):
            now, F = held.propagate(now, 0.0, 0.4 / parts)
        errors.append(np.abs(now - whole).max())
    assert np.abs(np.diff(np.log2(errors)) + 1).max() < 0.25

    # transition of both forms against central differences
    for model in (
        HeldResidual(three_body(), flight, 0.05),
        RungeKutta(WithResidual(three_body(), flight), 0.05),
    ):
        _, F = model.propagate(x, 0.0, 0.1)
        for j in range(6):
            step = 1e-6 * np.eye(6)[j]
            up, down = model.propagate(x + step, 0.0, 0.1), model.propagate(x - step, 0.0, 0.1)
            np.testing.assert_allclose(F[0, :, j], ((up[0] - down[0]) / 2e-6)[0], atol=1e-8)


def test_covariance_of_the_learner_feeds_the_process_noise():
    @dataclass(frozen=True)
    class Unsure:
        C: np.ndarray | None

        def evaluate(self, x, t):
            return np.zeros((len(x), 3)), np.zeros((len(x), 3, x.shape[1])), self.C

    C = np.array([np.diag([1.0, 4.0, 9.0]), np.eye(3)]) * 1e-12
    state = FilterState.of(np.zeros((2, 6)), np.eye(6), 0.0)
    base = WhiteAcceleration(1e-14)
    held = LearnedNoise(base, Unsure(C)).covariance(state, 10.0)
    G = np.vstack([50.0 * np.eye(3), 10.0 * np.eye(3)])
    np.testing.assert_allclose(held, base.covariance(state, 10.0) + G @ C @ G.T, rtol=1e-12)
    slow = LearnedNoise(base, Unsure(C), correlation_time=300.0).covariance(state, 10.0)
    white = WhiteAcceleration(600.0 * np.diag(C[0])).covariance(state, 10.0)
    np.testing.assert_allclose(slow[0], base.covariance(state, 10.0) + white, rtol=1e-12)
    with pytest.raises(ConfigError, match="has no covariance"):
        LearnedNoise(base, Unsure(None)).covariance(state, 10.0)


@pytest.mark.parametrize(
    "basis",
    [
        RBFBasis(RBFFeatures(np.random.default_rng(0).normal(size=(7, 6)), 0.3, 0.5), 1e-3),
        HarmonicBasis(4, 4.89, 290.0),
        HarmonicBasis(4, 4.89, 290.0, least_degree=2),
    ],
    ids=["rbf", "harmonic", "harmonic from 2"],
)
def test_slope_of_a_basis_is_its_derivative(basis):
    rng = np.random.default_rng(1)
    size = 400.0 if isinstance(basis, HarmonicBasis) else 1.0
    x, w = size * rng.normal(size=(4, 6)), rng.normal(size=(4, basis.size))
    if size > 1:
        x[:, :3] *= 500.0 / np.linalg.norm(x[:, :3], axis=1)[:, None]
    J = basis.slope(x, 0.0, w)
    for j in range(6):
        step = 1e-6 * size * np.eye(6)[j]
        up = basis.evaluate(x + step, 0.0) @ w[:, :, None]
        down = basis.evaluate(x - step, 0.0) @ w[:, :, None]
        # truncation 1e-12 of the third derivative, rounding 1e-16 / 1e-6
        np.testing.assert_allclose(
            J[:, :, j], (up - down)[:, :, 0] / (2e-6 * size), atol=1e-8 * np.abs(J).max()
        )


def test_normalised_gaussians_do_not_underflow():
    # as a quotient this is 0/0 [Pesce2020]: every Gaussian is exp(-5000 or less)
    features = RBFFeatures(np.array([[0.0], [1.0]]), 5.0)
    phi, slope = features.evaluate(np.array([[40.0], [0.5]]))
    np.testing.assert_allclose(phi, [[0.0, 1.0], [0.5, 0.5]], atol=1e-12)
    assert np.isfinite(slope).all()


def test_pseudo_inverse_finds_the_weights():
    rng = np.random.default_rng(2)
    basis = RBFBasis(RBFFeatures(rng.normal(size=(8, 6)), 0.2))
    weights, x = rng.normal(size=24), rng.normal(size=(200, 6))
    found = pseudo_inverse_weights(basis, x, basis.evaluate(x, 0.0) @ weights)
    np.testing.assert_allclose(found.mean, weights, atol=1e-8)
    a, J, C = found.evaluate(x[:2], 0.0)
    np.testing.assert_allclose(a, basis.evaluate(x[:2], 0.0) @ weights, atol=1e-10)
    assert J.shape == (2, 3, 6)
    assert C is None


def test_recursive_harmonics_are_the_harmonic_gp(monkeypatch):
    # The learner's posterior under its best prior, from its degree, prior and noise, sample by
    # sample. Its average over priors is a mixture, which no recursion of one Gaussian gives.
    monkeypatch.setattr(_harmonic_evidence, "_average", lambda *a: a[-2:])
    X, y = samples(80)
    y = y + 1e-3 * np.random.default_rng(3).normal(size=y.shape)
    learner = HarmonicGP(degree=4, least_degree=4).fit(X, y)
    basis = HarmonicBasis(4, learner.gm, learner.radius)
    sigma = basis.prior_sigma(learner.amplitude_, learner.attenuation_)
    sigma[:4] = np.inf  # flat: degrees 0 and 1
    weights = RecursiveWeights.of_prior(basis, sigma)
    noise = learner.noise_**2 * np.eye(3)
    for k in np.array_split(np.random.default_rng(4).permutation(80), 9):
        weights = weights.add(X[k], y[k], noise)
    found = weights.solve()
    spread = np.sqrt(np.diag(learner.covariance_root_ @ learner.covariance_root_.T))
    np.testing.assert_allclose((found.mean - learner.coefficients_) / spread, 0.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(found.root, axis=1), spread, rtol=1e-6)
    a, J, C = found.evaluate(X[:3], 0.0)
    np.testing.assert_allclose(a, learner.predict(X[:3]), rtol=1e-8)
    np.testing.assert_allclose(J, learner.jacobian(X[:3]), atol=1e-8 * np.abs(J).max())
    np.testing.assert_allclose(
        C, learner.predict_covariance(X[:3]), rtol=0, atol=1e-6 * np.abs(C).max()
    )


def test_weights_that_nothing_determines_are_an_error():
    basis = HarmonicBasis(2, 1.0, 1.0)
    flat = RecursiveWeights.of_prior(basis, np.inf)
    with pytest.raises(NumericalError, match="9 weights are not determined"):
        flat.add(np.array([[2.0, 0, 0]]), np.zeros((1, 3)), np.eye(3)).solve()
    with pytest.raises(ConfigError, match="thinning"):
        flat.add(np.array([[2.0, 0, 0]]), np.zeros((1, 3)), np.eye(3), 0.5)
    with pytest.raises(ConfigError, match=r"factor is 0"):
        flat.forget(0.0)
    with pytest.raises(DataError, match="not positive definite"):
        flat.add(np.array([[2.0, 0, 0]]), np.zeros((1, 3)), np.zeros((3, 3)))


def test_forgetting_and_thinning_scale_the_information():
    basis = HarmonicBasis(1, 1.0, 1.0)
    x, a = samples(10)
    prior = RecursiveWeights.of_prior(basis, 1.0)
    full = prior.add(x, a, np.eye(3))
    thin = prior.add(x, a, np.eye(3), thinning=4.0)
    four = thin.add(x, a, np.eye(3), 4.0).add(x, a, np.eye(3), 4.0).add(x, a, np.eye(3), 4.0)
    np.testing.assert_allclose(four.information, full.information, rtol=1e-12)
    np.testing.assert_allclose(full.forget(0.5).solve().mean, full.solve().mean, rtol=1e-12)
    assert isinstance(full.solve(), LinearAcceleration)


def test_network_of_the_paper_and_its_frozen_form():
    torch = pytest.importorskip("torch")
    rng = np.random.default_rng(5)
    X = rng.uniform(-1, 1, size=(400, 6)) * [1, 1, 0, 2, 2, 0]  # a plane: z does not vary
    y = 1e-2 * np.column_stack([X[:, 0], np.abs(X[:, 1]), np.zeros(400)])
    network = train_residual_network(X, y, epochs=600, learning_rate=1e-2)
    assert network.size == 323
    assert train_residual_network(X, y, (10,) * 4, epochs=1).size == 433
    assert network.validation_percent < 25  # 600 epochs; measured 15.5
    assert network.losses[-1] < 0.01 * network.losses[0]
    a, J, C = network.evaluate(X[:5], 0.0)
    assert C is None
    x = torch.from_numpy((X[:5] - network.x_mean) / network.x_scale)
    for weight, bias in zip(network.weights[:-1], network.biases[:-1], strict=True):
        x = torch.relu(x @ torch.from_numpy(weight).T + torch.from_numpy(bias))
    x = x @ torch.from_numpy(network.weights[-1]).T + torch.from_numpy(network.biases[-1])
    np.testing.assert_allclose(
        a, network.y_mean + network.y_scale * x.numpy(), atol=1e-12 * np.abs(a).max()
    )
    for j in range(6):
        step = 1e-7 * np.eye(6)[j]
        slope = (
            network.evaluate(X[:5] + step, 0.0)[0] - network.evaluate(X[:5] - step, 0.0)[0]
        ) / 2e-7
        np.testing.assert_allclose(J[:, :, j], slope, atol=1e-7 * np.abs(J).max())
    again = train_residual_network(X, y, epochs=5, learning_rate=1e-2)
    first = train_residual_network(X, y, epochs=5, learning_rate=1e-2)
    np.testing.assert_array_equal(again.weights[0], first.weights[0])


def test_relative_percent_is_the_printed_one():
    y = np.array([[1.0, -2.0], [3.0, 0.0]])
    assert relative_percent(y, y + 0.1) == pytest.approx(100 * 0.4 / 6.0)


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: train_residual_network(np.ones((3, 6)), np.ones((3, 3))), DataError, "10 or more"),
        (
            lambda: train_residual_network(np.ones((20, 6)), np.ones((20, 3)), epochs=0),
            ConfigError,
            "epochs 0",
        ),
        (lambda: RBFFeatures(np.ones((2, 3)), 0.0), ConfigError, "eta is 0"),
        (lambda: RBFFeatures(np.ones((2, 3)), 1.0, columns=(0,)), ConfigError, "1 columns"),
        (lambda: HarmonicBasis(1, 1.0, 1.0, 2), ConfigError, "degrees 2 to 1"),
        (lambda: RecursiveWeights.of_prior(HarmonicBasis(1, 1.0, 1.0), 0.0), ConfigError, "sigma"),
    ],
)
def test_errors_say_what_is_allowed(make, error, text):
    with pytest.raises(error, match=text):
        make()
