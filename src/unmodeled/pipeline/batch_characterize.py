"""Many characterisations of one learner at once: the data made, trained as a batch, measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain
from pathlib import Path

from unmodeled.core.errors import ConfigError, DataError, NumericalError, OrbitError
from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import Learner, NoiseLevel, fit_batch, stack_members
from unmodeled.pipeline.characterize import score
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.cost import Meter
from unmodeled.pipeline.inputs import observed_inputs
from unmodeled.pipeline.prepare import Simulated, prepare, simulate
from unmodeled.pipeline.results import LearnerResult

__all__ = ["characterize_batch", "characterize_stacks", "metrics_row", "train_and_score"]

_Run = tuple[CharacterizationConfig, LearningData | str]
#: What the data of a run may bring about; the run's own answer, the same in any batch.
_FAILURES = (DataError, OrbitError, NumericalError)


def characterize_batch(
    configs: Sequence[CharacterizationConfig],
    folders: Sequence[Path] = (),
    *,
    simulated: Callable[..., Simulated] | None = None,
    flights: bool = False,
    device: str = "cpu",
    threads: int = 1,
) -> Iterator[LearnerResult]:
    """Run characterisations that share a learner, and yield their results in order.

    Each result equals that of `characterize` for its configuration alone, whatever the batch:
    the data depend on the configuration only, and a member of a batch is its solo fit to the
    last bit (on a processor). Times of the training are shares of the stack's.

    Parameters
    ----------
    configs : sequence of CharacterizationConfig
        With one learner each, usually the initial conditions of one cell of a sweep. Learners
        may differ; only equal ones are trained side by side.
    folders : sequence of Path
        Where trajectory files are looked for.
    simulated : callable, optional
        In place of `simulate`, e.g. one that remembers orbits between cells.
    flights : bool
        Whether orbits are flown with the learned models (test point B); point by point, seconds
        each.
    device, threads
        As in `fit_batch`.

    Yields
    ------
    LearnerResult
        A run whose data or fit break down has its reason in ``failure``.

    Raises
    ------
    ConfigError
        For a configuration with more than one learner, or as `prepare`.
    """
    return chain.from_iterable(
        characterize_stacks(
            configs, folders, simulated=simulated, flights=flights, device=device, threads=threads
        )
    )


def characterize_stacks(
    configs: Sequence[CharacterizationConfig],
    folders: Sequence[Path] = (),
    *,
    simulated: Callable[..., Simulated] | None = None,
    flights: bool = False,
    device: str = "cpu",
    threads: int = 1,
) -> Iterator[list[LearnerResult]]:
    """Do what `characterize_batch` does, and yield the results of one stack at a time.

    Only as many data sets are held as are trained side by side: it bounds the memory, and what
    a kill in the middle of a batch loses.
    """
    for config in configs:
        if config.training != "samples":
            raise ConfigError(
                f"training is {config.training} in a sweep",
                allowed="samples",
                do="run unmodeled characterize, or um.trajectory_consistent_fit",
            )
        if len(config.learners) != 1:
            raise ConfigError(
                f"a batch has a configuration of {len(config.learners)} learners",
                allowed="one learner each",
                do="give each learner its own configuration",
            )
    # The paper's RK4 orbit beside the true one takes nine tenths of the time and changes nothing.
    orbits = simulated or partial(simulate, compare_integrators=False, folders=folders)
    pending: list[_Run] = []
    for config in configs:
        full = False
        try:
            with one_thread():
                data = prepare(config, folders, orbits)
        except _FAILURES as error:
            pending.append((config, str(error)))
        else:
            pending.append((config, data))
            side_by_side = stack_members(config.learners[0].build(), len(data.train), device)
            full = len(pending) >= side_by_side * threads
        if full:
            yield train_and_score(pending, flights=flights, device=device, threads=threads)
            pending = []
    if pending:
        yield train_and_score(pending, flights=flights, device=device, threads=threads)


def train_and_score(
    runs: Sequence[_Run],
    *,
    flights: bool = False,
    device: str = "cpu",
    threads: int = 1,
) -> list[LearnerResult]:
    """Train the learners of some runs as one batch and measure each.

    Parameters
    ----------
    runs : sequence of (CharacterizationConfig, LearningData or str)
        A run whose data could not be made has the reason in their place.
    flights, device, threads
        As in `characterize_batch`.
    """
    trained = [(c, d) for c, d in runs if not isinstance(d, str)]
    with Meter() as meter:
        fitted = iter(_fit(trained, device, threads))
    total = max(1, sum(len(data.train) for _, data in trained))
    results = []
    with one_thread():
        for config, data in runs:
            model = data if isinstance(data, str) else next(fitted)
            spec = config.learners[0]
            reason: object = model
            if not isinstance(data, str) and isinstance(model, Learner):
                cost = Meter(meter.seconds * len(data.train) / total, meter.peak_bytes)
                try:
                    results.append(score(spec, model, cost, data, config, flights=flights))
                    continue
                except _FAILURES as error:  # e.g. a covariance that is not positive definite
                    reason = error
            results.append(LearnerResult(spec.label, spec.kind, spec.baseline, failure=str(reason)))
    return results


def _fit(
    runs: Sequence[tuple[CharacterizationConfig, LearningData]], device: str, threads: int
) -> Sequence[Learner | NumericalError | DataError]:
    """Fit as one batch; samples that a learner refuses cost their own run only."""
    try:
        return fit_batch(
            [config.learners[0].build() for config, _ in runs],
            [
                observed_inputs(config.learners[0].features(data.units), data, data.train)
                for config, data in runs
            ],
            [data.train.observed_accelerations for _, data in runs],
            [NoiseLevel(data.noise.state, data.noise.acceleration) for _, data in runs],
            device=device,
            threads=threads,
        )
    except DataError as error:
        if len(runs) == 1:
            return [error]
        return [_fit([run], device, threads)[0] for run in runs]


def metrics_row(result: LearnerResult) -> dict[str, float | str]:
    """Return the numbers of a result as one flat row, without times; reproducible.

    ``SET_median``, ... of the fractional errors and ``SET_coverage_68``, ... of the calibration
    for the sets train, interpolation and extrapolation, ``fact NAME`` and ``failure``.
    """
    row: dict[str, float | str] = {"label": result.label, "failure": result.failure}
    for name, errors in result.summaries.items():
        row |= {f"{name}_{key}": value for key, value in errors.as_dict().items()}
    for name, calibration in result.calibrations.items():
        row |= {f"{name}_{key}": value for key, value in calibration.as_dict().items()}
    return row | {f"fact {name}": value for name, value in result.facts.items()}
