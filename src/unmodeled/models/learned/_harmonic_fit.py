"""From blocks of samples to the coefficients of a harmonic field."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from unmodeled.models.learned._harmonic_evidence import Posterior, fit_prior
from unmodeled.models.learned._harmonic_field import UncertainField
from unmodeled.models.learned._harmonic_places import noise_root
from unmodeled.models.learned._harmonic_stream import Block
from unmodeled.models.learned._harmonic_sums import Sums, equations

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
    """

    gm: float
    radius: float
    degrees: range
    flat_degree: int
    law: str

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
        count = 0

        def counted() -> Iterable[Block]:
            nonlocal count
            for block in blocks:
                count += len(block[0])
                yield block

        top = self.degrees.stop - 1
        sums = Sums.of(
            equations(x, y, top, self.gm, self.radius, noise_root(field, x, noise))
            for x, y, noise in counted()
        )
        free = (self.flat_degree + 1) ** 2
        return fit_prior(sums, free, self.law, self.degrees, progress, average=average), count
