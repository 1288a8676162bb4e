"""The row of a run: what a characterisation measured of one learner, flat."""

from __future__ import annotations

import math
from typing import Any

from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.results import LearnerResult
from unmodeled.pipeline.sweep.run_config import Value

__all__ = ["row_of"]


def row_of(result: LearnerResult, config: CharacterizationConfig) -> dict[str, Value]:
    """Return the columns of a run.

    ``SET_median``, ``SET_quartile_1``, ... of the fractional errors and ``SET_coverage_68``, ...
    of the calibration for the sets train, interpolation and extrapolation;
    ``extrapolation_over_point_mass``, above 2: do not use; ``failure`` (empty if the fit went
    well); ``model_bytes``; ``fact NAME`` what the learner says of itself;
    ``flight_ORBIT_PERIODS`` (m), if flown; ``train_largest_observed``, the largest observed over
    the largest true acceleration of the training samples; and ``cost_*``: seconds and bytes,
    which differ from run to run.

    Parameters
    ----------
    result : LearnerResult
        Of one learner.
    config : CharacterizationConfig
        Says at which periods flights are read.
    """
    row: dict[str, Value] = {"failure": result.failure}
    if result.learner is None:
        return row
    for name, summary in result.summaries.items():
        row |= {f"{name}_{key}": value for key, value in summary.as_dict().items()}
    for name, calibration in result.calibrations.items():
        row |= {f"{name}_{key}": value for key, value in calibration.as_dict().items()}
    for flown in result.flights:
        for periods in config.flight.periods:
            error = flown.flight.largest_error(periods * flown.period)
            row[f"flight_{flown.orbit}_{periods:g}"] = error
    row |= {f"fact {name}": _plain(value) for name, value in result.facts.items()}
    row["train_largest_observed"] = result.largest_observed
    if result.use is not None:
        row["extrapolation_over_point_mass"] = result.use.ratio
    row["model_bytes"] = result.model_bytes
    row["cost_train_s"] = result.train_seconds
    row["cost_train_bytes"] = result.train_bytes
    row["cost_evaluate_one_s"] = result.single_seconds
    row["cost_evaluate_batch_s_per_point"] = result.batch_seconds
    return row


def _plain(value: Any) -> Value:
    """Numpy's numbers as Python's, which JSON knows; a whole number stays one."""
    if isinstance(value, str | bool):
        return value
    number = float(value)
    return int(number) if isinstance(value, int) and math.isfinite(number) else number
