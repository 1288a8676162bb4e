"""From blocks of samples to the coefficients of a harmonic field."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from unmodeled.models.learned._harmonic_evidence import Posterior, fit_prior
from unmodeled.models.learned._harmonic_field import UncertainField
from unmodeled.models.learned._harmonic_places import noise_root
from unmodeled.models.learned._harmonic_stream import Block
from unmodeled.models.learned._harmonic_sums import Sums, equations
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["HarmonicProblem"]


@dataclass(frozen=True)
class HarmonicProblem:
    """What is asked of the data: units, degrees and the form of the prior.

    Parameters
    ----------
    gm, radius : float
        Reference values.
    degrees : range
        To choose from.
    flat_degree : int
        Highest degree with a flat prior.
    law : str
        Of `_harmonic_kernels.LAWS`.
    mass : float
        Prior mean of C_0_0, where something is known of it.
    mass_sigma, dipole_sigma : float, optional
        Deviation of the prior of C_0_0, and of C_1_0, C_1_1, S_1_1 about 0; flat if not given.
    growing : bool
        As `fit_prior`.
    """

    gm: float
    radius: float
    degrees: range
    flat_degree: int
    law: str
    mass: float = 1.0
    mass_sigma: float | None = None
    dipole_sigma: float | None = None
    growing: bool = False

    def solve(
        self,
        blocks: Iterable[Block],
        field: UncertainField | None,
        progress: Callable[[float], None],
        *,
        average: bool,
    ) -> tuple[Posterior, int]:
        """Add up the data and maximise the evidence.

        Parameters
        ----------
        blocks : iterable
            Samples at the positions where the field is to be taken, and their noise.
        field : UncertainField, optional
            Whose gradient carries position noise.
        progress : callable
            Told the share done of the search, after the sums.
        average : bool
            As `fit_prior`.

        Returns
        -------
        Posterior
        int
            Number of samples.
        """
        count, stated = 0, False

        def counted() -> Iterable[Block]:
            nonlocal count, stated
            for block in blocks:
                count += len(block[0])
                stated = _is_stated(block[2])
                yield block

        top = self.degrees.stop - 1
        sums = Sums.of(
            equations(x, y, top, self.gm, self.radius, noise_root(field, x, noise))
            for x, y, noise in counted()
        )
        weights = np.array([0.0 if d is None else 1.0 / d for d in self._known()])
        if weights.any():
            means = np.array([self.mass, 0.0, 0.0, 0.0])
            # Noise scales all equations but these: where it is not stated, it is found first.
            level = 1.0
            if not stated:
                rough = self._search(sums, _tell_no_one, average=False)
                level = rough.noise
            sums = sums.with_known(means, level * weights)
        return self._search(sums, progress, average=average), count

    def _search(self, sums: Sums, progress: Callable[[float], None], *, average: bool) -> Posterior:
        free = (self.flat_degree + 1) ** 2
        return fit_prior(
            sums, free, self.law, self.degrees, progress, average=average, growing=self.growing
        )

    def _known(self) -> tuple[float | None, ...]:
        return (self.mass_sigma, *(self.dipole_sigma,) * 3)


def _is_stated(noise: NoiseLevel) -> bool:
    return noise.position > 0 or noise.acceleration > 0 or noise.samples is not None


def _tell_no_one(share: float) -> None:
    """Take a share of progress that is not worth telling."""
