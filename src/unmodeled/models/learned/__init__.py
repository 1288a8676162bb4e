"""Learners: one contract, one file each."""

from unmodeled.models.learned.batch import fit_batch, stack_members
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
from unmodeled.models.learned.input_features import InputFeatures
from unmodeled.models.learned.learner import (
    Learner,
    NoiseLevel,
    Progress,
    learner_class,
    learner_names,
    load_learner,
    read_context,
)
from unmodeled.models.learned.nearest_neighbour import NearestNeighbour
from unmodeled.models.learned.point_mass import PointMassOnly
from unmodeled.models.learned.rbf_network import RBFNetwork
from unmodeled.models.learned.residual import Residual
from unmodeled.models.learned.sparse_gp import SparseGP
from unmodeled.models.learned.spectral_mlp import SpectralMLP

__all__ = [
    "ELM",
    "CurlFreeGP",
    "ExactGP",
    "FittedPointMass",
    "HarmonicGP",
    "HarmonicKernelGP",
    "HarmonicLeastSquares",
    "InputFeatures",
    "Learner",
    "NearestNeighbour",
    "NoiseLevel",
    "PointMassOnly",
    "Progress",
    "RBFNetwork",
    "Residual",
    "SparseGP",
    "SpectralMLP",
    "ZonalOracle",
    "fit_batch",
    "learner_class",
    "learner_names",
    "load_learner",
    "read_context",
    "stack_members",
]
