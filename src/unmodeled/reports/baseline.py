"""The yardstick of every report: the error of the bare known point mass on the same samples."""

from __future__ import annotations

from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import PointMassOnly
from unmodeled.pipeline.metrics import ErrorSummary, fractional_error, summarize

__all__ = ["point_mass_summaries"]


def point_mass_summaries(data: LearningData) -> dict[str, ErrorSummary]:
    """Return the errors of -4 pi^2 x / r^3 (normalised units) on each set.

    It is computed here, so that it is known also where no such learner was configured.

    Parameters
    ----------
    data : LearningData
        The samples, whose units make the body's gravitational parameter 4 pi^2.
    """
    model = PointMassOnly().fit(data.train.positions, data.train.accelerations)
    return {
        s.name: summarize(fractional_error(s.accelerations, model.predict(s.positions)))
        for s in data.sets
    }
