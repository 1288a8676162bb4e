"""The closed harmonic kernels: against Legendre series, finite differences, gpytorch, the limit."""

import math
from itertools import pairwise

import numpy as np
import pytest
import torch
from tests.models.learned.problem import other_orbit, samples

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.learned._harmonic_kernel_likelihood import (
    HarmonicKernelLikelihood,
    low_design,
)
from unmodeled.models.learned._harmonic_kernels import (
    LAWS,
    acceleration_covariance,
    coefficient_variances,
    derivative_block,
    slope_by_log_c,
)
from unmodeled.models.learned.harmonic_kernel import (
    HarmonicGradientKernel,
    MassAndCentreKernel,
    gpytorch,
)
from unmodeled.models.physics.exterior_harmonics import (
    column_degrees,
    derivative,
    exterior_harmonics,
)

ORDERS = [(a, b) for a in range(3) for b in range(3)]


def points(seed, count, least=1.1):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(count, 3))
    return x * (rng.uniform(least, 2.0, count) / np.linalg.norm(x, axis=1))[:, None]


def finite_rank(law, x, y, q, a, b, degree):
    """Covariance by coefficients of variance q^(2n) sigma_n^2 / (2n + 1), times q^2."""

    def design(X, order):
        tables = [exterior_harmonics(X, degree + order)]
        for _ in range(order):
            tables = [derivative(t, i) for t in tables for i in range(3)]
        return np.stack(tables, axis=-1)

    n = column_degrees(degree)
    prior = q ** (2.0 * n + 2) * coefficient_variances(law, n)
    total = np.einsum("p,pni,pmk->nmik", prior, design(x, a), design(y, b))
    return total.reshape(len(x), len(y), *(3,) * (a + b))


@pytest.mark.parametrize("law", LAWS)
def test_the_kernel_is_its_legendre_series(law):
    """400 terms, s up to 0.83: the rest is below 1e-30."""
    x, y, q = points(1, 5), points(2, 6), 1.0
    r = np.linalg.norm(x, axis=1)[:, None] * np.linalg.norm(y, axis=1)
    s, t = q**2 / r, (x @ y.T) / r
    n = np.arange(400)
    variance = {"reciprocal": n * 0 + 1.0, "abel_poisson": 2.0 * n + 1, "logarithmic": 1 / (n + 1)}
    coefficients = variance[law] * s[..., None] ** (n + 1)
    series = [
        [np.polynomial.legendre.legval(t[i, j], coefficients[i, j]) for j in range(6)]
        for i in range(5)
    ]
    # sums of 400 terms whose sizes add up to at most 12 times the result here
    np.testing.assert_allclose(derivative_block(law, x, y, q**2, 0, 0), series, rtol=1e-12)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("a", "b"), ORDERS)
def test_blocks_of_potential_acceleration_and_gradient(law, a, b):
    """Each closed derivative is that of the harmonics; beyond 45, 0.21^45 times 45^5 is left."""
    x, y = points(3, 4), points(4, 5)
    y[0] = x[0]  # variances too
    closed = derivative_block(law, x, y, 0.25, a, b)
    series = finite_rank(law, x, y, 0.5, a, b, 45)
    np.testing.assert_allclose(closed, series, rtol=0, atol=1e-13 * np.abs(series).max())


@pytest.mark.parametrize("law", LAWS)
def test_blocks_are_finite_differences_of_each_other_and_harmonic(law):
    x, y, step = points(5, 3), points(6, 4), 1e-5
    for a, b in [(0, 0), (0, 1), (1, 1), (1, 2)]:
        slopes = [
            derivative_block(law, x + move, y, 0.7, a, b)
            - derivative_block(law, x - move, y, 0.7, a, b)
            for move in step * np.eye(3)
        ]
        # the index of x that is added comes after those of x: third axis for none, fourth for one
        found = np.stack(slopes, axis=2 + a) / (2 * step)
        closed = derivative_block(law, x, y, 0.7, a + 1, b)
        # truncation: step^2 / 6 times third derivatives, some hundreds of times the first
        np.testing.assert_allclose(found, closed, rtol=0, atol=1e-7 * np.abs(closed).max())
    hessian = derivative_block(law, x, y, 0.7, 2, 1)
    trace = np.trace(hessian, axis1=2, axis2=3)
    assert np.abs(trace).max() < 1e-13 * np.abs(hessian).max()


@pytest.mark.parametrize("law", LAWS)
def test_derivatives_by_the_radius_are_kernels_too(law):
    x, y, step = points(7, 3), points(8, 4), 1e-5
    for a, b in ORDERS:
        up, down = (derivative_block(law, x, y, 0.5 * math.exp(h), a, b) for h in (step, -step))
        closed = slope_by_log_c(law, x, y, 0.5, a, b)
        size = np.abs(closed).max()
        np.testing.assert_allclose((up - down) / (2 * step), closed, rtol=0, atol=1e-8 * size)


@pytest.mark.parametrize("law", LAWS)
def test_the_fast_matrix_is_the_general_block(law):
    x, y = points(9, 4), points(10, 5)
    matrix, slope = acceleration_covariance(law, x, y, 0.6, slope=True)
    for fast, blocks in (
        (matrix, derivative_block(law, x, y, 0.6, 1, 1)),
        (slope, slope_by_log_c(law, x, y, 0.6, 1, 1)),
    ):
        expected = blocks.transpose(2, 0, 3, 1).reshape(12, 15)
        np.testing.assert_allclose(fast, expected, rtol=0, atol=1e-14 * np.abs(expected).max())


@pytest.mark.parametrize("law", LAWS)
def test_finite_rank_converges_at_the_rate_of_its_tail(law):
    """What is left of accelerations beyond N falls as N^3 sigma_N^2 / (2N) s^N: slope log s."""
    x, y, q = points(11, 4, 1.3), points(12, 4, 1.3), 0.9
    s = q**2 / (np.linalg.norm(x, axis=1)[:, None] * np.linalg.norm(y, axis=1)).min()
    closed = derivative_block(law, x, y, q**2, 1, 1)
    degrees, errors = (8, 16, 24, 32), []
    for degree in degrees:
        errors.append(np.abs(finite_rank(law, x, y, q, 1, 1, degree) - closed).max())
    power = {"abel_poisson": 3.0, "reciprocal": 2.0, "logarithmic": 1.0}[law]
    for (n, before), (m, after) in pairwise(zip(degrees, errors, strict=True)):
        rate = math.log(after / before) / (m - n)
        expected = math.log(s) + power * math.log(m / n) / (m - n)
        # P_N oscillates between -1 and 1: over eight degrees the rate may be 30 % off
        assert rate == pytest.approx(expected, rel=0.3)


@pytest.mark.parametrize("law", LAWS)
def test_autograd_is_the_closed_gradient(law):
    """Marginal likelihood with broad degrees 0 and 1: value and gradient of gpytorch and ours."""
    X, y, _, _ = samples(noise=0.1)
    X, y = X[::8], y[::8] / (4 * np.pi**2)
    theta = np.array([0.3, 1e-2, 1e-4])
    value, gradient = HarmonicKernelLikelihood(law, X, y, np.zeros_like(X))(np.log(theta))

    mass_variance = dipole_variance = 1e4
    kernel = HarmonicGradientKernel(law, max_ratio=1.0).double()
    kernel.ratio = math.sqrt(theta[0])
    scaled = gpytorch.kernels.ScaleKernel(kernel).double()
    scaled.outputscale = theta[1]
    low = MassAndCentreKernel(mass_variance, dipole_variance).double()
    log_noise = torch.tensor(math.log(theta[2]), dtype=torch.float64, requires_grad=True)
    x = torch.from_numpy(X)
    matrix = (scaled + low)(x).to_dense() + log_noise.exp() * torch.eye(3 * len(X))
    normal = torch.distributions.MultivariateNormal(torch.zeros(3 * len(X)).double(), matrix)
    nll = -normal.log_prob(torch.from_numpy(y.ravel()))
    nll.backward()
    # A prior of variance v of four unknowns adds 2 log (2 pi v) to the flat one's value, and 1/v.
    flat = float(nll.detach()) - 0.5 * 4 * math.log(2 * math.pi * 1e4)
    assert value == pytest.approx(flat, abs=1e-3)

    q, by_raw = math.sqrt(theta[0]), float(kernel.raw_ratio.grad)
    by_log_c = by_raw / (2 * (1 - q))  # q is a sigmoid of raw: dlog q = (1 - q) draw
    by_log_signal = float(scaled.raw_outputscale.grad) * theta[1] / -math.expm1(-theta[1])
    # softplus: ds = (1 - e^-s) draw
    auto = [by_log_c, by_log_signal, float(log_noise.grad)]
    np.testing.assert_allclose(auto, gradient, atol=1e-4 * np.abs(gradient).max())


def test_kernel_is_symmetric_positive_and_batched():
    x = torch.from_numpy(points(13, 6))
    kernel = HarmonicGradientKernel("logarithmic", 1.0, torch.Size([2])).double()
    kernel.ratio = torch.tensor([0.3, 0.8], dtype=torch.float64).reshape(2, 1, 1)
    dense = kernel(x).to_dense()
    assert dense.shape == (2, 18, 18)
    for k, q in enumerate((0.3, 0.8)):
        alone = HarmonicGradientKernel("logarithmic", 1.0).double()
        alone.ratio = q
        assert torch.allclose(alone(x).to_dense(), dense[k], rtol=0, atol=1e-14)
    assert torch.allclose(dense, dense.mT, rtol=0, atol=1e-14)
    dense = dense.detach()
    assert float(torch.linalg.eigvalsh(dense).min()) > 0
    diagonal = kernel(x, diag=True)
    assert torch.allclose(diagonal, dense.diagonal(dim1=-1, dim2=-2), rtol=0, atol=1e-14)
    both = kernel(x[None].expand(2, 6, 3), x[None, :4].expand(2, 4, 3)).to_dense()
    assert torch.allclose(both, dense[:, :, :12], rtol=0, atol=1e-14)


def test_mass_and_centre_are_the_low_harmonics():
    x = points(14, 5)
    low = low_design(x, 1).transpose(1, 0, 2).reshape(15, 4)
    expected = (low * np.array([2.0, 3.0, 3.0, 3.0])) @ low.T
    found = MassAndCentreKernel(2.0, 3.0)(torch.from_numpy(x)).to_dense()
    np.testing.assert_allclose(found.numpy(), expected, rtol=0, atol=1e-14)


def test_gpytorch_regression_with_the_kernel():
    """The posterior mean of gpytorch's own machinery is dense algebra with our matrix."""
    X, y, _, _ = samples(noise=0.1)
    X, y = torch.from_numpy(X[::8]), torch.from_numpy(y[::8] / (4 * np.pi**2))
    other = torch.from_numpy(other_orbit()[0][:5])

    class Model(gpytorch.models.ExactGP):
        def __init__(self):
            likelihood = gpytorch.likelihoods.MultitaskGaussianLikelihood(3, rank=0)
            super().__init__(X, y, likelihood)
            self.mean_module = gpytorch.means.MultitaskMean(gpytorch.means.ZeroMean(), 3)
            self.covar_module = HarmonicGradientKernel(max_ratio=1.0) + MassAndCentreKernel()

        def forward(self, x):
            mean, covariance = self.mean_module(x), self.covar_module(x)
            return gpytorch.distributions.MultitaskMultivariateNormal(mean, covariance)

    model = Model().double()
    model.likelihood.initialize(task_noises=torch.full((3,), 1e-4).double(), noise=1e-4)
    model.eval()
    with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False):
        predicted = model(other).mean.numpy()
        kernel = model.covar_module
        noise = 2e-4 * torch.eye(3 * len(X)).double()
        weights = torch.linalg.solve(kernel(X).to_dense() + noise, y.reshape(-1))
        expected = (kernel(other, X).to_dense() @ weights).reshape(5, 3).numpy()
    np.testing.assert_allclose(predicted, expected, rtol=1e-8)


def test_bad_input_is_refused_with_a_reason():
    with pytest.raises(ConfigError, match=r'kernel is "gauss". Allowed: reciprocal, abel_poisson'):
        HarmonicGradientKernel("gauss")
    with pytest.raises(ConfigError, match=r"max_ratio is 0. Allowed: > 0"):
        HarmonicGradientKernel(max_ratio=0)
    with pytest.raises(ConfigError, match=r"mass_variance is -1. Allowed: >= 0"):
        MassAndCentreKernel(-1)
    kernel = HarmonicGradientKernel(max_ratio=2.0)
    with pytest.raises(DataError, match=r"0.5 from the origin, inside the Bjerhammar sphere of 1."):
        kernel(torch.tensor([[0.5, 0.0, 0.0]])).to_dense()
    with pytest.raises(DataError, match=r"Allowed: positions \(..., n, 3\)"):
        kernel(torch.ones(4, 2)).to_dense()
