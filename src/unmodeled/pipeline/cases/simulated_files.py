"""A simulated case as files: what a user has, and apart from it the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from unmodeled.core.errors import ConfigError
from unmodeled.datasets.measurement_csv import write_measurements
from unmodeled.pipeline.cases.case_config import CaseConfig
from unmodeled.pipeline.cases.load_case import Ground
from unmodeled.pipeline.cases.quantities import write_quantity
from unmodeled.pipeline.cases.simulate_case import HiddenEffect, Simulated, simulate
from unmodeled.pipeline.cases.write_case import write_case
from unmodeled.pipeline.run_folder import new_files

__all__ = ["CASE_FILE", "TRUTH_FILE", "simulate_case"]

CASE_FILE = "case.yaml"
TRUTH_FILE = "truth.yaml"


def simulate_case(
    scenario: str,
    hidden: Sequence[HiddenEffect],
    *,
    seed: int,
    folder: Path | str,
    noise_factor: float = 1.0,
    held_out: bool = False,
) -> Path:
    """Simulate a case and write it whole: ``case.yaml``, its measurements, and ``truth.yaml``.

    Positions are written along ICRF axes. ``truth.yaml`` says what is hidden; nothing but a person
    or a benchmark reads it.

    Parameters
    ----------
    scenario, hidden, seed, noise_factor, held_out
        As in `simulate`.
    folder : path
        Made if it is missing; must not hold a case, or files of the names to be written.

    Returns
    -------
    Path
        Of the case file.

    Raises
    ------
    ConfigError
        As in `simulate`, or if the folder holds a case.
    InputError
        If the folder cannot be written, or the disk is full.
    NumericalError
        As in `simulate`.
    """
    folder = Path(folder)
    if (folder / CASE_FILE).exists():
        raise ConfigError(f"{folder} holds a case already", do="name another folder")
    simulated = simulate(scenario, seed, hidden, noise_factor=noise_factor, held_out=held_out)
    case = simulated.case
    config = CaseConfig.resolve(dict(case.source))
    turn = Ground.of(config, folder).around.frame_from_icrf
    with new_files(folder) as staging:
        for entry, m in zip(config.measurements, simulated.data, strict=True):
            in_icrf = replace(m, values=m.values @ turn) if m.kind == "position" else m
            write_measurements([in_icrf], staging / entry.file)
        write_case(_truth(scenario, simulated, seed, noise_factor), staging / TRUTH_FILE)
        write_case(case.source, staging / CASE_FILE)
    return folder / CASE_FILE


def _truth(scenario: str, simulated: Simulated, seed: int, noise_factor: float) -> dict[str, Any]:
    arcs = (*simulated.case.arcs, *simulated.case.held_out)
    return {
        "scenario": scenario,
        "seed": seed,
        "noise_factor": noise_factor,
        "hidden": {
            name: {n: write_quantity(v, simulated.units[n]) for n, v in values.items()}
            for name, values in simulated.truth.items()
        },
        "initial_states": {
            arc.name: {
                "position": [write_quantity(v, "m") for v in state[:3]],
                "velocity": [write_quantity(v, "m s-1") for v in state[3:]],
            }
            for arc, state in zip(arcs, simulated.states, strict=True)
        },
    }
