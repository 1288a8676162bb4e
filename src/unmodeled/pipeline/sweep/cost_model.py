"""What a sweep will cost: seconds and memory, from measured runs of each learner."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from unmodeled.pipeline.prepare import SAMPLES_PER_PERIOD
from unmodeled.pipeline.sweep.grid import Plan
from unmodeled.pipeline.sweep.run_config import RunConfig, Value

__all__ = ["Expected", "duration", "expected_cost"]

#: Training samples at which the tables below were measured.
_SAMPLES = (237, 950, 2375)
#: Processor seconds of one run (without flights) and, where the number of epochs rules, of each
#: epoch; peak memory of the process (MB); at `_SAMPLES`. Printed by benchmarks/sweep_costs.py on
#: one core of a busy two-core x86-64 machine, torch 2.13.0.
_MEASURED: dict[str, tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]] = {
    "exact_gp": ((0.039, 0.6, 8.4), (0.0208, 0.4003, 5.3404), (616, 1081, 1698)),
    # At 2,375 the time is that at 950 times 2.5^3, not measured.
    "exact_gp lbfgs": ((0.35, 7.8, 122.0), (), (530, 608, 984)),
    "exact_gp newton": ((0.099, 1.69, 29.0), (), (545, 662, 1013)),
    "spectral_mlp": ((0.05, 0.074, 0.061), (0.0033, 0.0093, 0.0229), (579, 591, 615)),
    "spectral_mlp single": ((0.028, 0.041, 0.07), (0.0005, 0.0016, 0.0041), (546, 551, 552)),
    # A whole fit of 5,000 epochs was timed; 0.05 s of it are taken as fixed.
    "mlp": ((0.05, 0.05, 0.05), (0.000105, 0.000197, 0.00039), (523, 524, 523)),
    "harmonic_gp": ((0.05, 0.06, 0.088), (), (518, 522, 529)),
    "rbf_network": ((0.016, 0.024, 0.053), (), (526, 527, 529)),
    "harmonic_least_squares": ((0.086, 0.13, 0.17), (), (535, 543, 559)),
    "nearest_neighbour": ((0.012, 0.016, 0.022), (), (525, 524, 525)),
    "zonal_oracle": ((0.013, 0.014, 0.017), (), (527, 527, 528)),
    "point_mass": ((0.011, 0.011, 0.012), (), (524, 525, 524)),
    "fitted_point_mass": ((0.015, 0.013, 0.015), (), (526, 527, 526)),
    # Refuses 2,375 samples by default: time times 2.5^3 and memory by guess, not measured.
    "curl_free_gp": ((1.02, 45.5, 711.0), (), (544, 859, 2600)),
    # Measured at 237 alone: above, time by the cube of the samples and memory by their square.
    "harmonic_kernel_gp": ((4.9, 315.0, 4900.0), (), (553, 1100, 3500)),
    "sparse_gp": ((1.02, 4.19, 10.2), (), (526, 535, 549)),
    # Alone in a process, not by the benchmark: memory is its difference to `harmonic_gp` there.
    "mascon_gp": ((0.09, 0.165, 0.239), (), (536, 544, 553)),
    "elm": ((0.023, 0.042, 0.072), (), (520, 529, 531)),
    "potential_mlp": ((0.45, 1.13, 2.38), (), (534, 544, 565)),
}
# A flight evaluates the learner some 1,300 times a period: a guess for the dry run, not measured
# a learner at a time.
_FLIGHT_S_PER_PERIOD = 0.1
# The samples of a measured trajectory are not counted before it is read.
_UNKNOWN_SAMPLES = 240.0


@dataclass(frozen=True)
class Expected:
    """Cost of runs that are not finished.

    Parameters
    ----------
    runs : int
        How many.
    seconds : float
        On one core, all together.
    peak_bytes : float
        Largest memory of one worker.
    measured_here, from_table, unknown : int
        Runs whose cost comes from finished runs of the same cell or learner in the store, from
        the table of this module, and from neither (they count as zero).
    """

    runs: int
    seconds: float
    peak_bytes: float
    measured_here: int
    from_table: int
    unknown: int

    def as_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "runs": self.runs,
            "core_seconds": self.seconds,
            "peak_bytes_per_worker": self.peak_bytes,
            "measured_here": self.measured_here,
            "from_table": self.from_table,
            "unknown": self.unknown,
        }

    def sentence(self) -> str:
        """Return it in words."""
        text = (
            f"{self.runs} runs are left: about {duration(self.seconds)} on one core, "
            f"{self.peak_bytes / 1e9:.1f} GB for each worker"
        )
        parts = [
            f"{count} {what}"
            for count, what in (
                (self.measured_here, "by finished runs here"),
                (self.from_table, "by the built-in table"),
                (self.unknown, "of unknown cost, not counted"),
            )
            if count
        ]
        return f"{text} ({', '.join(parts)})"


def expected_cost(plan: Plan, finished: Mapping[str, Mapping[str, Value]]) -> Expected:
    """Return the cost of the runs of a plan that are not finished.

    Parameters
    ----------
    plan : Plan
        All runs.
    finished : mapping
        Values by run id; their times are used where a run of the same cell, or else of the same
        learner with as many samples, is among them.
    """
    here: dict[Any, list[tuple[float, float]]] = {}
    for run in plan.runs:
        values = finished.get(run.id, {})
        taken, memory = values.get("cost_total_s"), values.get("cost_peak_bytes", 0)
        if isinstance(taken, float) and isinstance(memory, int):
            for key in (run.cell, _like(run)):
                here.setdefault(key, []).append((taken, memory))
    medians: dict[Any, tuple[float, float]] = {}
    for key, pairs in here.items():
        seconds, peak = np.median(pairs, axis=0)
        medians[key] = float(seconds), float(peak)
    counts = {"here": 0, "table": 0, "unknown": 0}
    total, largest = 0.0, 0.0
    left = [run for run in plan.runs if run.id not in finished]
    for run in left:
        found = medians.get(run.cell, medians.get(_like(run)))
        source = "here"
        if found is None:
            found = _from_table(run)
            source = "table" if found is not None else "unknown"
        counts[source] += 1
        if found is not None:
            total, largest = total + found[0], max(largest, found[1])
    return Expected(len(left), total, largest, counts["here"], counts["table"], counts["unknown"])


def duration(seconds: float) -> str:
    """Return a time in words.

    Examples
    --------
    >>> duration(45), duration(3000), duration(9000), duration(200000)
    ('45 s', '50 min', '2.5 h', '2.3 days')
    """
    for limit, unit, size in ((120, "s", 1), (5400, "min", 60), (172800, "h", 3600)):
        if seconds < limit:
            return f"{seconds / size:.1f} {unit}" if unit == "h" else f"{seconds / size:.0f} {unit}"
    return f"{seconds / 86400:.1f} days"


def _samples(run: RunConfig) -> float:
    data = run.config.data
    periods = data.periods()[0]
    if periods is None:
        return _UNKNOWN_SAMPLES
    each = data.samples_per_period or SAMPLES_PER_PERIOD
    return data.training_orbits * periods * each * (1 - data.interpolation_share)


def _like(run: RunConfig) -> tuple[Any, ...]:
    """Return what runs of about the same cost share: learner, its training, samples."""
    learner = run.config.learners[0]
    params = tuple(sorted((k, str(v)) for k, v in learner.params.items() if k != "random_state"))
    return (learner.kind, params, learner.inputs, run.flights, round(_samples(run)))


def _from_table(run: RunConfig) -> tuple[float, float] | None:
    learner = run.config.learners[0]
    name = learner.kind
    for key, usual in (("optimizer", "adam"), ("precision", "double")):
        chosen = learner.params.get(key, usual)
        name += "" if chosen == usual else f" {chosen}"
    if name not in _MEASURED:
        return None
    fixed, epoch, peak = _MEASURED[name]
    n = _samples(run)
    seconds = _between(n, fixed)
    if epoch:
        seconds += float(learner.params["epochs"]) * _between(n, epoch)
    if run.flights:
        flight = run.config.flight
        seconds += _FLIGHT_S_PER_PERIOD * max(flight.periods) * (1 + flight.orbits)
    return seconds, _between(n, peak) * 1e6


def _between(n: float, values: tuple[float, ...]) -> float:
    """Interpolate powers between measured sizes; beyond them the last power goes on."""
    x, y = np.log(_SAMPLES), np.log(np.maximum(values, 1e-6))
    k = int(np.clip(np.searchsorted(x, math.log(n)) - 1, 0, len(x) - 2))
    slope = (y[k + 1] - y[k]) / (x[k + 1] - x[k])
    if n < _SAMPLES[0]:
        slope = 0.0  # below the smallest the fixed costs rule
    return float(np.exp(y[k] + slope * (math.log(n) - x[k])))
