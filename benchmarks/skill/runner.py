"""One batch of runs: trained together, measured at samples, in regions and in flight."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from skill.fields import FIELDS, region_points, true_acceleration
from skill.oracle import register
from skill.plan import FLIGHT_PERIODS
from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, NumericalError, OrbitError, UnmodeledError
from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import Learner, PointMassOnly, stack_members
from unmodeled.pipeline.batch_characterize import train_and_score
from unmodeled.pipeline.characterize import check_training
from unmodeled.pipeline.cost import peak_memory
from unmodeled.pipeline.flight import fly
from unmodeled.pipeline.metrics import calibrate, fractional_error, summarize
from unmodeled.pipeline.results import LearnerResult
from unmodeled.pipeline.sweep.row import row_of
from unmodeled.pipeline.sweep.run_config import RunConfig, RunResult, Value
from unmodeled.pipeline.sweep.runner import learning_data

__all__ = ["NO_DATA", "SkillRunner"]

#: How the failure of a run begins whose orbits could not be made: no fault of the learner.
NO_DATA = "no data: "
_FAILURES = (DataError, OrbitError, NumericalError)
# Truth of the regions, once for all learners and noise levels of a pair of orbits.
_regions: OrderedDict[tuple[str, str, int], dict[str, tuple[Array, Array]]] = OrderedDict()
_REMEMBERED = 64


@dataclass(frozen=True)
class SkillRunner:
    """Runner for `sweep`: the row of a sweep, regions, and for some runs a flight.

    Beside the columns of `row_of`: ``below_median``, ``far_mean``, ... of the fractional error in
    `REGIONS`, ``SET_point_mass`` the median of the bare point mass on the same points, ``advice``
    of the use check; where orbits are flown ``flight_1`` and ``flight_10``, largest position error
    (m) of the other orbit up to so many periods (infinite: it ended before) with
    ``flight_radius``, the body's (m), ``training_advice`` and ``training_ratio``.
    """

    def __call__(self, runs: Sequence[RunConfig]) -> Iterator[RunResult]:
        """Yield the results of one stack after the other."""
        register()  # a worker is another process
        pending: list[tuple[RunConfig, LearningData]] = []
        with one_thread():
            for run in runs:
                try:
                    data = learning_data(run.config)
                except _FAILURES as error:
                    yield RunResult(run.id, {"failure": NO_DATA + str(error)})
                    continue
                pending.append((run, data))
                learner = run.config.learners[0].build()
                if len(pending) >= stack_members(learner, len(data.train)):
                    yield from self._stack(pending)
                    pending = []
            if pending:
                yield from self._stack(pending)

    def _stack(self, stack: Sequence[tuple[RunConfig, LearningData]]) -> Iterator[RunResult]:
        cpu = time.process_time()
        results = train_and_score([(run.config, data) for run, data in stack])
        share = (time.process_time() - cpu) / len(stack)
        for (run, data), result in zip(stack, results, strict=True):
            cpu = time.process_time()
            row = row_of(result, run.config)
            if result.learner is not None:
                row |= _measured(run, data, result)
            row["cost_cpu_s"] = share + time.process_time() - cpu
            row["cost_peak_bytes"] = peak_memory()
            yield RunResult(run.id, row)


def _measured(run: RunConfig, data: LearningData, result: LearnerResult) -> dict[str, Value]:
    learner, row = result.learner, dict[str, Value]()
    assert learner is not None  # it was scored
    assert result.use is not None
    row["advice"] = result.use.advice
    reference = PointMassOnly()
    for s in data.sets:
        errors = fractional_error(s.accelerations, reference._predict(s.positions))
        row[f"{s.name}_point_mass"] = summarize(errors).median
    for name, (points, truth) in _truths(run, data).items():
        row |= _region(name, learner, points, truth)
        errors = fractional_error(truth, reference._predict(points))
        row[f"{name}_point_mass"] = summarize(errors).median
    if run.flights:
        row |= _flown(learner, data)
        check = check_training(run.config.learners[0], data)
        if check is not None:
            row["training_advice"] = check.advice
            row["training_ratio"] = check.ratio
    return row


def _region(name: str, learner: Learner, points: Array, truth: Array) -> dict[str, Value]:
    try:
        predicted = learner.predict(points)
    except UnmodeledError as error:  # some refuse points where their series does not hold
        return {f"{name}_median": np.inf, f"{name}_mean": np.inf, f"{name}_failure": str(error)}
    summary = summarize(fractional_error(truth, predicted))
    row: dict[str, Value] = {f"{name}_median": summary.median, f"{name}_mean": summary.mean}
    if learner.has_covariance:
        try:
            found = calibrate(truth, predicted, learner.predict_covariance(points))
        except UnmodeledError as error:
            return row | {f"{name}_failure": str(error)}
        row |= {f"{name}_coverage_68": found.coverage_68, f"{name}_coverage_95": found.coverage_95}
    return row


def _flown(learner: Learner, data: LearningData) -> dict[str, Value]:
    """Fly the other orbit from its true initial state."""
    orbit, period = data.orbits[1], data.periods[1]
    longest = FLIGHT_PERIODS[-1] * period
    try:
        flight = fly(learner.predict, orbit, data.units, period, longest, data.learned_spin_rate)
    except UnmodeledError as error:  # it came where the learner refuses to predict
        lost: dict[str, Value] = {f"flight_{k:g}": np.inf for k in FLIGHT_PERIODS}
        return lost | {"flight_status": str(error), "flight_radius": data.units.length}
    row: dict[str, Value] = {
        f"flight_{k:g}": flight.largest_error(min(k * period, orbit.times[-1] - orbit.times[0]))
        for k in FLIGHT_PERIODS
    }
    return row | {"flight_status": flight.status, "flight_radius": data.units.length}


def _truths(run: RunConfig, data: LearningData) -> dict[str, tuple[Array, Array]]:
    name, volume = str(run.axes["field"]), str(run.axes["volume"])
    key = name, volume, run.config.seed
    if key not in _regions:
        field = FIELDS[name]
        truth = true_acceleration(field, data)
        # The split of the training orbit is the same at each level of noise.
        _regions[key] = {k: (x, truth(x)) for k, x in region_points(field, data).items()}
        if len(_regions) > _REMEMBERED:
            _regions.popitem(last=False)
    return _regions[key]
