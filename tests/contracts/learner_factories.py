"""All learners that the contract test runs on; a new learner adds one line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from unmodeled.models.learned.curl_free_gp import CurlFreeGP
from unmodeled.models.learned.elm import ELM
from unmodeled.models.learned.exact_gp import ExactGP
from unmodeled.models.learned.harmonic_gp import HarmonicGP
from unmodeled.models.learned.harmonic_kernel_gp import HarmonicKernelGP
from unmodeled.models.learned.harmonic_least_squares import (
    FittedPointMass,
    HarmonicLeastSquares,
    ZonalOracle,
)
from unmodeled.models.learned.learner import Learner
from unmodeled.models.learned.nearest_neighbour import NearestNeighbour
from unmodeled.models.learned.point_mass import PointMassOnly
from unmodeled.models.learned.rbf_network import RBFNetwork
from unmodeled.models.learned.residual import Residual
from unmodeled.models.learned.sparse_gp import SparseGP
from unmodeled.models.learned.spectral_mlp import SpectralMLP


@dataclass(frozen=True)
class LearnerFactory:
    """How to make a learner that fits within a second, and what to ask of it."""

    make: Callable[[], Learner]
    #: Largest allowed root mean square error on held-out samples, as a share of that of the mean.
    score: float
    #: False for a prediction that jumps: its Jacobian is checked inside a cell, not on its faces.
    continuous: bool = True
    #: Distance along each axis where the covariance is larger than among the samples: far away,
    #: but for a field that vanishes there close to the body.
    uncertain_at: float = 10.0


LEARNER_FACTORIES: dict[str, LearnerFactory] = {
    "exact_gp": LearnerFactory(lambda: ExactGP(epochs=10), score=1e-4),
    "exact_gp(lbfgs)": LearnerFactory(
        # weights grow as the noise floor falls, and with them the rounding of finite differences
        lambda: ExactGP(optimizer="lbfgs", noise_floor=1e-6),
        score=1e-3,
    ),
    "exact_gp(matern52, ard)": LearnerFactory(
        lambda: ExactGP(epochs=10, kernel="matern52", ard=True), score=1e-3
    ),
    "exact_gp(position noise)": LearnerFactory(
        lambda: ExactGP(epochs=5, position_noise=True), score=1e-4
    ),
    "spectral_mlp": LearnerFactory(lambda: SpectralMLP(layers=3, width=32, epochs=300), score=0.1),
    "rbf_network": LearnerFactory(RBFNetwork, score=5e-3),
    "nearest_neighbour": LearnerFactory(NearestNeighbour, score=0.2, continuous=False),
    "residual(exact_gp)": LearnerFactory(lambda: Residual(ExactGP(epochs=10)), score=1e-6),
    "residual(rbf_network)": LearnerFactory(lambda: Residual(RBFNetwork()), score=1e-4),
    "point_mass": LearnerFactory(PointMassOnly, score=2e-2),
    "fitted_point_mass": LearnerFactory(FittedPointMass, score=2e-2),
    "harmonic_least_squares": LearnerFactory(lambda: HarmonicLeastSquares(degree=5), score=1e-8),
    "harmonic_gp": LearnerFactory(HarmonicGP, score=1e-8, uncertain_at=0.7),
    "harmonic_kernel_gp": LearnerFactory(
        # as for lbfgs above; the steps from a grid's start end early on clean data
        lambda: HarmonicKernelGP(iterations=5, noise_floor=1e-8),
        score=1e-4,
        uncertain_at=1.0,
    ),
    "curl_free_gp": LearnerFactory(
        # as for lbfgs above; the steps from a grid's start end early on clean data
        lambda: CurlFreeGP(iterations=10, noise_floor=1e-6),
        score=1e-3,
    ),
    "sparse_gp": LearnerFactory(
        lambda: SparseGP(inducing=60, iterations=10, noise_floor=1e-6), score=1e-2
    ),
    "elm": LearnerFactory(ELM, score=1e-3),
    "zonal_oracle": LearnerFactory(ZonalOracle, score=1e-12),
}
