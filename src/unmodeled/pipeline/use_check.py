"""The least that a learner must do: stay near a bare point mass on orbits it has not seen."""

from __future__ import annotations

from dataclasses import dataclass

from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import PointMassOnly
from unmodeled.pipeline.metrics import ErrorSummary, fractional_error, summarize

__all__ = ["DO_NOT_USE", "UNFIT_RATIO", "UseCheck", "point_mass_summaries"]

#: A median error above so many times that of the bare point mass: worse than no learning.
UNFIT_RATIO = 2.0
#: The words, the same in every table, page and file.
DO_NOT_USE = "do not use"
# Errors below this are rounding, and count as this.
_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class UseCheck:
    """A learner beside the bare point mass ("zero residual") on samples it was not trained on.

    Parameters
    ----------
    median : float
        Median fractional error of the learner; infinite where most predictions are not finite.
    point_mass : float
        Of the bare known point mass on the same samples.

    Examples
    --------
    >>> UseCheck(0.49, 0.005).advice
    'do not use'
    >>> UseCheck(0.009, 0.005).advice
    'passes'
    """

    median: float
    point_mass: float

    @property
    def ratio(self) -> float:
        """Median over that of the point mass; errors below 1e-12 count as 1e-12."""
        return max(self.median, _ROUNDING) / max(self.point_mass, _ROUNDING)

    @property
    def unfit(self) -> bool:
        """True above `UNFIT_RATIO`, and for a median that is no number."""
        return not self.ratio <= UNFIT_RATIO

    @property
    def advice(self) -> str:
        """``do not use`` or ``passes``."""
        return DO_NOT_USE if self.unfit else "passes"


def point_mass_summaries(data: LearningData) -> dict[str, ErrorSummary]:
    """Return the errors of -4 pi^2 x / r^3 (normalised units) on each set.

    It is computed here, so that it is known also where no such learner was configured.

    Parameters
    ----------
    data : LearningData
        The samples, whose units make the body's gravitational parameter 4 pi^2.
    """
    model = PointMassOnly()  # its mass is known: nothing to fit
    return {
        s.name: summarize(fractional_error(s.accelerations, model._predict(s.positions)))
        for s in data.sets
    }
