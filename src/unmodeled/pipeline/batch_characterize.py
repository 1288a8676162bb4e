"""Many characterisations of one learner at once: the data made, trained as a batch, measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from unmodeled.core.errors import ConfigError, DataError, NumericalError, OrbitError
from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import NoiseLevel, fit_batch
from unmodeled.pipeline.characterize import score
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.cost import Meter
from unmodeled.pipeline.prepare import Simulated, prepare, simulate
from unmodeled.pipeline.results import LearnerResult

__all__ = ["characterize_batch", "metrics_row", "train_and_score"]

#: Training samples that are held at a time: bounds the memory of fitted models and predictions.
_SAMPLES_AT_ONCE = 25_000


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
    last bit (on a processor). Times of the training are shares of the batch's.

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
    for config in configs:
        if len(config.learners) != 1:
            raise ConfigError(
                f"a batch has a configuration of {len(config.learners)} learners",
                allowed="one learner each",
                do="give each learner its own configuration",
            )
    # The paper's RK4 orbit beside the true one takes nine tenths of the time and changes nothing.
    orbits = simulated or partial(simulate, compare_integrators=False)
    pending: list[tuple[CharacterizationConfig, LearningData | str]] = []
    held = 0
    for config in configs:
        data: LearningData | str
        try:
            with one_thread():
                data = prepare(config, folders, orbits)
            held += len(data.train)
        except (DataError, OrbitError) as error:
            data = str(error)
        pending.append((config, data))
        if held >= _SAMPLES_AT_ONCE:
            yield from train_and_score(pending, flights=flights, device=device, threads=threads)
            pending, held = [], 0
    yield from train_and_score(pending, flights=flights, device=device, threads=threads)


def train_and_score(
    runs: Sequence[tuple[CharacterizationConfig, LearningData | str]],
    *,
    flights: bool = False,
    device: str = "cpu",
    threads: int = 1,
) -> Iterator[LearnerResult]:
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
        fitted = fit_batch(
            [config.learners[0].build() for config, _ in trained],
            [data.train.observed_positions for _, data in trained],
            [data.train.observed_accelerations for _, data in trained],
            [NoiseLevel(data.noise.state, data.noise.acceleration) for _, data in trained],
            device=device,
            threads=threads,
        )
    total = max(1, sum(len(data.train) for _, data in trained))
    models = iter(fitted)
    with one_thread():
        for config, data in runs:
            spec = config.learners[0]
            model = data if isinstance(data, str) else next(models)
            if isinstance(data, str) or isinstance(model, str | NumericalError):
                yield LearnerResult(spec.label, spec.kind, spec.baseline, failure=str(model))
                continue
            cost = Meter(meter.seconds * len(data.train) / total, meter.peak_bytes)
            yield score(spec, model, cost, data, config, flights=flights)


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
