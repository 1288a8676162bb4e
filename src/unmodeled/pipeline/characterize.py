"""The main job: train on one orbit, test on it (safety) and on others (robustness)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, NumericalError
from unmodeled.core.provenance import collect_provenance
from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData, SampleSet
from unmodeled.models.learned import Learner, NoiseLevel
from unmodeled.pipeline.config import CharacterizationConfig, LearnerConfig
from unmodeled.pipeline.cost import Meter, time_evaluation
from unmodeled.pipeline.flight import Force, fly_force
from unmodeled.pipeline.inputs import learned_force, observed_inputs, true_inputs
from unmodeled.pipeline.metrics import calibrate, fractional_error, summarize
from unmodeled.pipeline.prepare import prepare
from unmodeled.pipeline.results import CharacterizationResult, LearnerResult, OrbitFlight
from unmodeled.pipeline.training_check import TrainingCheck, training_check
from unmodeled.pipeline.trajectory_consistent import ConsistentFit, train_consistently
from unmodeled.pipeline.use_check import UseCheck, point_mass_summaries

__all__ = ["Report", "characterize", "check_training", "evaluate", "score"]

#: Called with what is being done and the share of the whole job that is done, 0 to 1.
Report = Callable[[str, float], None]

_DATA_SHARE, _FIT_SHARE = 0.05, 0.7


def characterize(
    config: CharacterizationConfig,
    folders: Sequence[Path] = (),
    report: Report | None = None,
) -> CharacterizationResult:
    """Run one characterisation, on one thread: the numbers depend on the configuration only.

    Parameters
    ----------
    config : CharacterizationConfig
        From `load_config` or `CharacterizationConfig.resolve`.
    folders : sequence of Path
        Where trajectory files are looked for.
    report : callable, optional
        Told the progress.

    Returns
    -------
    CharacterizationResult
        A learner whose fit breaks down is a row with its reason, never left out.

    Raises
    ------
    InputError
        On bad input.
    """
    with one_thread():
        return _characterize(config, folders, report or (lambda text, share: None))


def _characterize(
    config: CharacterizationConfig, folders: Sequence[Path], tell: Report
) -> CharacterizationResult:
    tell("making the data", 0.0)
    data = prepare(config, folders)
    count = len(config.learners)
    results = []
    for k, learner_config in enumerate(config.learners):
        start = _DATA_SHARE + (1 - _DATA_SHARE) * k / count
        width = (1 - _DATA_SHARE) / count

        def progress(text: str, share: float, start: float = start, width: float = width) -> None:
            tell(text, start + width * share)

        result = evaluate(learner_config, data, config, progress)
        if config.training_check and config.training == "samples" and not result.failure:
            tell(f"checking {learner_config.label} on training data held back", start + width)
            result = replace(result, training_check=check_training(learner_config, data))
        results.append(result)
    tell("done", 1.0)
    return CharacterizationResult(
        config=config,
        data=data,
        learners=tuple(results),
        flight_floor=_flight_floor(config, data),
        provenance=collect_provenance(config.hash, config.seed),
    )


def evaluate(
    spec: LearnerConfig,
    data: LearningData,
    config: CharacterizationConfig,
    tell: Report = lambda text, share: None,
    *,
    flights: bool = True,
) -> LearnerResult:
    """Train one learner and measure it; a fit that breaks down is a result with its reason.

    Parameters
    ----------
    spec : LearnerConfig
        Which learner.
    data : LearningData
        From `prepare`.
    config : CharacterizationConfig
        Says how long flights are.
    tell : callable
        Told the progress.
    flights : bool
        Whether orbits are flown with the learned model (test point B).
    """
    learner = spec.build()
    noise = NoiseLevel(data.noise.state, data.noise.acceleration)

    def fitting(share: float) -> None:
        tell(f"training {spec.label}", _FIT_SHARE * share)

    fitting(0.0)
    orbit: dict[str, float | str] = {}
    with Meter() as meter:
        try:
            if config.training == "trajectory_consistent":
                orbit = _orbit_facts(train_consistently(data, learner))
            else:
                learner.fit(
                    observed_inputs(spec.features(data.units), data, data.train),
                    data.train.observed_accelerations,
                    noise,
                    progress=fitting,
                )
        except NumericalError as error:
            return LearnerResult(spec.label, spec.kind, spec.baseline, failure=str(error))
    result = score(spec, learner, meter, data, config, tell, flights=flights)
    return replace(result, facts=result.facts | orbit) if orbit else result


def _orbit_facts(fit: ConsistentFit) -> dict[str, float | str]:
    """Return what a report says of the orbit that a learner was trained on."""
    facts: dict[str, float | str] = {
        "orbit settled": "yes" if fit.settled else f"no: {fit.reason}",
        "orbit rounds": float(fit.rounds),
    }
    if np.isfinite(fit.reduced_square):
        facts["orbit residuals squared, of stated noise"] = fit.reduced_square
    return facts


def score(
    spec: LearnerConfig,
    learner: Learner,
    cost: Meter,
    data: LearningData,
    config: CharacterizationConfig,
    tell: Report = lambda text, share: None,
    *,
    flights: bool = True,
) -> LearnerResult:
    """Measure a learner that is fitted, wherever it was; parameters as `evaluate`.

    ``cost`` holds the seconds and bytes of its training.
    """
    tell(f"testing {spec.label}", _FIT_SHARE)
    features = spec.features(data.units)
    inputs = {s.name: true_inputs(features, data, s) for s in data.sets}
    predictions = {name: learner.predict(x) for name, x in inputs.items()}
    errors = {s.name: fractional_error(s.accelerations, predictions[s.name]) for s in data.sets}
    calibrations = {}
    if learner.has_covariance:
        calibrations = {
            s.name: calibrate(
                s.accelerations, predictions[s.name], learner.predict_covariance(inputs[s.name])
            )
            for s in data.sets
        }
    summaries = {name: summarize(e) for name, e in errors.items()}
    reference = point_mass_summaries(data)["extrapolation"].median
    single, batch = time_evaluation(learner.predict, inputs["train"])
    tell(f"flying {spec.label}", _FIT_SHARE + 0.5 * (1 - _FIT_SHARE))
    return LearnerResult(
        spec.label,
        spec.kind,
        spec.baseline,
        learner,
        predictions,
        errors,
        summaries,
        calibrations,
        _fly_orbits(learned_force(learner, features, data), data, config, data.learned_spin_rate)
        if flights
        else (),
        cost.seconds,
        cost.peak_bytes,
        single,
        batch,
        sum(a.nbytes for a in learner._arrays().values()),
        learner.facts(),
        largest_observed=_largest_observed(data.train),
        use=UseCheck(summaries["extrapolation"].median, reference),
    )


def _largest_observed(train: SampleSet) -> float:
    """Return the largest observed over the largest true acceleration of the training samples."""
    observed, true = (
        np.linalg.norm(a, axis=1).max() for a in (train.observed_accelerations, train.accelerations)
    )
    return float(observed / true)


def check_training(spec: LearnerConfig, data: LearningData) -> TrainingCheck | None:
    """Return `training_check` of a learner; None if it refuses the samples that would be left.

    Parameters
    ----------
    spec : LearnerConfig
        Which learner.
    data : LearningData
        From `prepare`.
    """
    train = data.train
    try:
        return training_check(
            spec.build,
            observed_inputs(spec.features(data.units), data, train),
            train.observed_accelerations,
            NoiseLevel(data.noise.state, data.noise.acceleration),
            train.orbit,
        )
    except DataError:  # too few samples without the held-out part
        return None


def _fly_orbits(
    force: Force,
    data: LearningData,
    config: CharacterizationConfig,
    spin_rate: float,
) -> tuple[OrbitFlight, ...]:
    longest = max(config.flight.periods)
    flown = [0, *data.extrapolation_orbits[: config.flight.orbits]]
    return tuple(
        OrbitFlight(
            k, period, fly_force(force, orbit, data.units, period, longest * period, spin_rate)
        )
        for k, orbit, period in ((k, data.orbits[k], data.periods[k]) for k in flown)
    )


def _flight_floor(config: CharacterizationConfig, data: LearningData) -> float:
    """Error of flying the true field: what the solver itself contributes, m."""
    if (field := data.true_field) is not None:
        flights = _fly_orbits(lambda x, v, t: field(x), data, config, data.spin_rate)
    elif (force := data.true_force) is not None:
        units = data.units

        def flown(x: Array, v: Array, t: Array) -> Array:
            a: Array = force(np.hstack([x * units.length, v * units.velocity]), t)
            return a / units.acceleration

        flights = _fly_orbits(flown, data, config, 0.0)  # inertial, whatever turns in it
    else:
        return float("nan")
    return float(np.max([f.flight.position_error.max() for f in flights]))
