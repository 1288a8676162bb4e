"""The Gaussian process whose prior is a gravity field: harmonic outside the body."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import ClassVar, Self

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError, InputError
from unmodeled.core.threads import one_thread
from unmodeled.core.units import NORMALISED_GM, NormalisedUnits
from unmodeled.models.learned._harmonic_evidence import Posterior
from unmodeled.models.learned._harmonic_field import UncertainField
from unmodeled.models.learned._harmonic_files import from_published, to_published
from unmodeled.models.learned._harmonic_fit import HarmonicProblem
from unmodeled.models.learned._harmonic_kernels import check_law
from unmodeled.models.learned._harmonic_places import NoisyPlaces, mass_of
from unmodeled.models.learned._harmonic_stream import Block, blocks_of, blocks_of_stream
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.physics.exterior_harmonics import column_names
from unmodeled.models.physics.gravity_file import GravityField

__all__ = ["HarmonicGP"]

#: Highest degree of the choice "auto".
_HIGHEST = 20
#: Fits with the gradient of the fit before, where positions are noisy.
_PASSES = 4


class HarmonicGP(Learner):
    r"""Gaussian process of a potential that is harmonic, in finite rank.

    The potential is :math:`\frac{GM}{R}\sum c_{nm} (R/r)^{n+1} \bar Y_{nm}` to a degree N, with
    independent coefficients of prior variance :math:`s^2 q^{2n}`: the covariance of two
    potentials is :math:`s^2/q^2` times the Abel-Poisson kernel cut off at N ([Moritz1980]; q is
    the radius of the Bjerhammar sphere over R; the factor 2n + 1 of the kernel comes from the
    addition theorem). Degrees 0 and 1, mass and centre of mass, have a flat prior:
    they differ from the reference by amounts that the higher degrees say nothing of. Degree, q, s
    and the noise maximise the evidence with the flat ones integrated out. Mean and covariance are
    then averaged over q and the amplitude s q^2 at degree 2 (log-uniform, 0.004 to 1): the best
    prior alone made the 95 % band hold 84 % of accelerations.

    Data are added up in chunks to a triangle of (N + 1)^4 / 2 numbers: memory does not grow with
    their number, and one pass serves all hyperparameters and degrees (`fit_stream`).

    Noise is :math:`\sigma^2 (\sigma_a^2 I + 2 \sigma_s^2 G G^T)` at each sample, with the stated
    levels and the gravity gradient G of the fit, repeated; the factor is estimated, 1 if the
    statement is right. The 2 stands for independent draws: one of the observed position, one of
    the position whose acceleration was observed. Without stated noise it is :math:`\sigma^2 I`.
    With noisy positions the field is compared with each sample where the bias of that noise
    vanishes (`_harmonic_places.NoisyPlaces`), to all orders of sigma_s.

    Parameters
    ----------
    degree : int or "auto"
        Highest degree that may be chosen; ``auto`` goes up, to 20 at most, until three more degrees
        add less than 1 to the log evidence.
    least_degree : int
        Lowest degree that may be chosen; equal to ``degree`` for a fixed one.
    flat_degree : int
        Highest degree with a flat prior, at least 0; -1 for none.
    gm, radius : float
        Reference values in the units of the samples; they scale the coefficients.
    law : {"abel_poisson", "reciprocal", "logarithmic"}
        Prior variances of coefficients are s^2 q^(2n) times 1, 1/(2n + 1), 1/((n + 1)(2n + 1)):
        the kernels of `HarmonicKernelGP`, cut off.
    gm_sigma : float, optional
        Standard deviation of what is known of the mass: GM is ``gm`` within it, in its units. Flat
        if not given. On a `Residual` it is that of the mass taken off.
    centre_sigma : float, optional
        Standard deviation of each coordinate of the centre of mass about the origin, in units of
        length. Flat if not given.

    Attributes
    ----------
    coefficients_ : ndarray (p,)
        Posterior mean, fully normalised, in the order of `coefficient_names`.
    covariance_root_ : ndarray (p, p)
        Their covariance is ``covariance_root_ @ covariance_root_.T``.
    degree_ : int
        Degree chosen.
    """

    name: ClassVar[str] = "harmonic_gp"
    has_covariance = True
    stands_alone: ClassVar[bool] = True

    coefficients_: Array
    covariance_root_: Array
    degree_: int

    def __init__(
        self,
        degree: int | str = 8,
        least_degree: int = 2,
        flat_degree: int = 1,
        gm: float = NORMALISED_GM,
        radius: float = 1.0,
        law: str = "abel_poisson",
        gm_sigma: float | None = None,
        centre_sigma: float | None = None,
    ) -> None:
        self.degree = degree
        self.least_degree = least_degree
        self.flat_degree = flat_degree
        self.gm = gm
        self.radius = radius
        self.law = law
        self.gm_sigma = gm_sigma
        self.centre_sigma = centre_sigma

    def coefficient_names(self) -> list[str]:
        """Return the names of the coefficients, in the order of ``coefficients_``."""
        self._require_fitted()
        return column_names(self.degree_)

    # Fit -------------------------------------------------------------------------------------

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        self._check()
        moving = noise.position > 0
        passes = _PASSES if moving else 1
        places, data = X, y
        problem = self._problem(0.0 if noise.gradient is not None else 1.0)
        if moving:
            self._adopt(self._start(X, y, noise))
            own = NoisyPlaces(X, y, noise, self.gm * float(self.coefficients_[0]), self.radius)
        for k in range(passes):
            if moving and noise.gradient is None:
                data = own.update(self._field)
                places = own.places
            blocks = blocks_of(places, data, noise)
            field = self._field if noise.position else None
            tell = partial(_part, progress, k, passes)
            last = k == passes - 1
            self._adopt(problem.solve(blocks, field, tell, average=last)[0])
        progress(1.0)

    def fit_stream(
        self, chunks: Iterable[Sequence[Array]], noise: NoiseLevel | None = None
    ) -> Self:
        """Learn from samples that come in chunks and are not kept.

        The same as ``fit`` on all of them together, to the last bit; memory does not grow with
        their number.

        Parameters
        ----------
        chunks : iterable of (X, y) or (X, y, deviations)
            Positions (n, 3), accelerations (n, 3) and, for all chunks or none, the standard
            deviation of each component (n, 3); any n. Iterated once.
        noise : NoiseLevel, optional
            Common to all samples.

        Returns
        -------
        Self

        Raises
        ------
        DataError
            On wrong shapes, values that are not finite, or too few samples.
        InputError
            For position noise: it takes several passes over the samples.
        """
        noise = noise or NoiseLevel()
        if noise.position or noise.samples is not None or noise.gradient is not None:
            raise InputError(
                f"{self.name}: a stream was given noise of positions or of single samples",
                allowed="noise of accelerations, and deviations within the chunks",
                do="use fit(X, y, noise) for noisy positions: it passes over them several times",
            )
        self._check()
        with one_thread():
            blocks = blocks_of_stream(self.name, chunks, noise)
            found, count = self._problem().solve(
                self._enough(blocks), None, _tell_no_one, average=True
            )
        self._adopt(found)
        self.n_samples_, self.n_inputs_ = count, 3
        return self

    def _start(self, X: Array, y: Array, noise: NoiseLevel) -> Posterior:
        """Return a point mass that carries position noise in the first pass."""
        if noise.gradient is not None:  # the mass has been taken off
            return _reference(0.0)
        if self.gm_sigma is not None:
            return _reference(1.0)
        return _reference(mass_of(X, y) / self.gm or 1.0)

    def _enough(self, blocks: Iterable[Block]) -> Iterator[Block]:
        count = 0
        for block in blocks:
            count += len(block[0])
            yield block
        if count < self.min_samples:
            raise DataError(
                f"{self.name} was given {count} training samples",
                allowed=f"at least {self.min_samples}",
                do="use a longer trajectory or more samples a period",
            )

    def _problem(self, mass: float = 1.0) -> HarmonicProblem:
        top = _HIGHEST if isinstance(self.degree, str) else self.degree
        degrees = range(self.least_degree, top + 1)
        return HarmonicProblem(
            self.gm,
            self.radius,
            degrees,
            self.flat_degree,
            self.law,
            mass,
            None if self.gm_sigma is None else self.gm_sigma / self.gm,
            # C_1_0 is z of the centre of mass over sqrt(3) R, and so on.
            None if self.centre_sigma is None else self.centre_sigma / self.radius / math.sqrt(3.0),
            growing=isinstance(self.degree, str),
        )

    def _check(self) -> None:
        for name, value in (("gm", self.gm), ("radius", self.radius)):
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"{self.name}: {name} is {value}", allowed="a number > 0")
        for name in ("gm_sigma", "centre_sigma"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ConfigError(
                    f"{self.name}: {name} is {value}", allowed="a number > 0, or none"
                )
        check_law(self.name, self.law)
        if isinstance(self.degree, str) and self.degree != "auto":
            raise ConfigError(
                f'{self.name}: degree is "{self.degree}"', allowed='a number, or "auto"'
            )
        top = _HIGHEST if isinstance(self.degree, str) else self.degree
        if not 1 <= self.least_degree <= top:
            raise ConfigError(
                f"{self.name}: degrees {self.least_degree} to {self.degree}",
                allowed="1 <= least_degree <= degree",
            )
        if not -1 <= self.flat_degree <= 1:
            raise ConfigError(
                f"{self.name}: flat_degree is {self.flat_degree}", allowed="-1, 0 or 1"
            )

    def _adopt(self, found: Posterior) -> None:
        # C order, as from a file: products of another layout differ in the last bit.
        self.degree_ = found.degree
        self.coefficients_ = np.ascontiguousarray(found.mean)
        self.covariance_root_ = np.ascontiguousarray(found.root)
        self.attenuation_, self.amplitude_ = found.attenuation, found.amplitude
        self.noise_, self.log_evidence_ = found.noise, found.log_evidence

    # Use -------------------------------------------------------------------------------------

    @property
    def _field(self) -> UncertainField:
        mean, root = self.coefficients_, self.covariance_root_
        return UncertainField(self.degree_, self.gm, self.radius, mean, root)

    def _predict(self, X: Array) -> Array:
        return self._field.acceleration(X)

    def _jacobian(self, X: Array) -> Array:
        return self._field.gradient(X)

    def _predict_covariance(self, X: Array) -> Array:
        return self._field.acceleration_covariance(X)

    def potential(self, X: Array) -> Array:
        """Return the potential (n,) at positions ``X`` (n, 3); acceleration is its gradient."""
        X = self._checked(X)
        return self._field.potential(X)

    def potential_variance(self, X: Array) -> Array:
        """Return the variance (n,) of the potential at positions ``X`` (n, 3)."""
        X = self._checked(X)
        return self._field.potential_variance(X)

    def jacobian_covariance(self, X: Array) -> Array:
        """Return the covariance (n, 9, 9) of the gravity gradient, its elements row by row."""
        X = self._checked(X)
        return self._field.gradient_covariance(X)

    # Files -----------------------------------------------------------------------------------

    def gravity_field(self, units: NormalisedUnits, baseline_gm: float = 0.0) -> GravityField:
        """Return the posterior mean as a field with formal errors, for a file.

        Parameters
        ----------
        units : NormalisedUnits
            Of the samples.
        baseline_gm : float
            Point mass at the origin that had been taken off the samples, in their units.

        Returns
        -------
        GravityField
            SI; GM is the fitted one, so that C_0_0 is 1. The error of C_0_0 is the relative error
            of GM, the others are those of the ratios to it, to first order.

        Raises
        ------
        InputError
            If the mass found is not positive: then it is not the field of a body.
        """
        self._require_fitted()
        return to_published(self.name, self._field, units, baseline_gm)

    @classmethod
    def from_gravity_field(cls, field: GravityField, units: NormalisedUnits) -> Self:
        """Return a learner that holds a published field; its formal errors are independent.

        Parameters
        ----------
        field : GravityField
            SI; without errors the covariance is zero.
        units : NormalisedUnits
            Units of positions and accelerations of the learner.
        """
        own = from_published(field, units)
        learner = cls(own.degree, min(2, own.degree), gm=own.gm, radius=own.radius)
        learner._adopt(Posterior(own.degree, 0.0, 0.0, 0.0, 0.0, own.mean, own.root))
        learner.n_samples_ = 0
        return learner

    def facts(self) -> dict[str, float | str]:
        """Return degree, hyperparameters, the factor of the noise, the mass and its error."""
        self._require_fitted()
        return {
            "degree": float(self.degree_),
            "prior attenuation q": self.attenuation_,
            "prior amplitude s": self.amplitude_,
            "noise / stated noise (or noise)": self.noise_,
            "log_evidence": self.log_evidence_,
            "fitted GM / reference GM": float(self.coefficients_[0]),
            "its standard deviation": float(np.linalg.norm(self.covariance_root_[0])),
        }

    def _arrays(self) -> dict[str, Array]:
        numbers = [
            float(self.degree_),
            self.attenuation_,
            self.amplitude_,
            self.noise_,
            self.log_evidence_,
        ]
        return {
            "coefficients": self.coefficients_,
            "covariance_root": self.covariance_root_,
            "numbers": np.array(numbers),
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        degree, q, s, noise, evidence = (float(v) for v in arrays["numbers"])
        mean, root = arrays["coefficients"], arrays["covariance_root"]
        self._adopt(Posterior(int(degree), q, s, noise, evidence, mean, root))


def _reference(mass: float) -> Posterior:
    """Return the reference mass alone, as known; nothing where it has been taken off."""
    mean = np.array([mass, 0.0, 0.0, 0.0])
    return Posterior(1, 0.0, 0.0, 0.0, 0.0, mean, np.zeros((4, 4)))


def _tell_no_one(share: float) -> None:
    """Take a share of progress that is not worth telling."""


def _part(progress: Progress, k: int, passes: int, share: float) -> None:
    progress((k + share) / passes)
