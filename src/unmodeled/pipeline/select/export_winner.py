"""The chosen learner as a file that a filter flies, trained again as in the sweep."""

from __future__ import annotations

from pathlib import Path

from unmodeled.core.errors import ConfigError
from unmodeled.core.threads import one_thread
from unmodeled.models.learned import NoiseLevel
from unmodeled.pipeline.inputs import observed_inputs
from unmodeled.pipeline.learned_field import LearnedField
from unmodeled.pipeline.select.regimes import regimes_of
from unmodeled.pipeline.sweep.runner import learning_data
from unmodeled.pipeline.sweep.sweep import Opened
from unmodeled.pipeline.yaml12 import write_yaml

__all__ = ["export_winner"]


def export_winner(
    opened: Opened, winner: str, regime: str, folder: Path, initial_condition: int | None = None
) -> list[Path]:
    """Train the winner on one of its runs again, and write model and configuration.

    Parameters
    ----------
    opened : Opened
        The sweep.
    winner : str
        Label of a learner.
    regime : str
        Which part of the grid the run is taken from.
    folder : Path
        Receives ``winner.safetensors`` (numbers only: `LearnedField.load`) and
        ``winner.yaml`` (for ``characterize``).
    initial_condition : int, optional
        Which orbit; the first run of the regime by default.

    Raises
    ------
    ConfigError
        If no finished run of the winner fits.
    """
    table = opened.table()
    rows = regimes_of(table).get(regime, table.iloc[:0])
    rows = rows[rows["learner"] == winner]
    if initial_condition is not None:
        rows = rows[rows["initial_condition"] == initial_condition]
    if rows.empty:
        raise ConfigError(
            f"no finished run of {winner} in {regime}"
            + ("" if initial_condition is None else f" at initial condition {initial_condition}")
        )
    wanted = rows["id"].iloc[0]
    run = next(r for r in opened.plan.runs if r.id == wanted)
    with one_thread():
        data = learning_data(run.config, opened.folders)
        learner = run.config.learners[0].build()
        features = run.config.learners[0].features(data.units)
        learner.fit(
            observed_inputs(features, data, data.train),
            data.train.observed_accelerations,
            NoiseLevel(data.noise.state, data.noise.acceleration),
        )
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / "winner.safetensors", folder / "winner.yaml"]
    LearnedField(learner, data.units, data.frame, features).save(written[0])
    write_yaml(run.config.as_dict(), written[1])
    return written
