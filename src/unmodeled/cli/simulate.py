"""The command `simulate`: true orbits of a configuration, or a case with hidden effects."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from unmodeled.cli.characterize import Seed, Settings, resolve
from unmodeled.cli.tools import app, stoppable
from unmodeled.core.errors import ConfigError, InputError, nearest

if TYPE_CHECKING:
    from unmodeled.pipeline.cases.case import Case
    from unmodeled.pipeline.cases.simulate_case import HiddenEffect

__all__ = ["hidden_effects", "simulate"]

#: Strength of an effect that is hidden without a number: clearly above the threshold.
_STRENGTH = 300.0


@app.command()
@stoppable
def simulate(
    what: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            help="A scenario such as bennu (list: unmodeled scenarios), or a YAML configuration.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder for the files.")],
    hide: Annotated[
        list[str] | None,
        typer.Option(
            "--hide",
            help="Effect that acts on the data and not on the model: NAME, NAME=STRENGTH "
            "(non-centrality of the best test, default 300) or PARAMETER=VALUE UNIT.",
        ),
    ] = None,
    seed: Seed = None,
    setting: Settings = None,
    noise_factor: Annotated[
        float, typer.Option("--noise-factor", help="True noise over the stated one.")
    ] = 1.0,
    held_out: Annotated[
        bool, typer.Option("--held-out", help="Add an arc on another orbit, not to be fitted.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the files as JSON.")] = False,
) -> None:
    """Write a simulated case with hidden effects, or the true orbits of a configuration.

    A scenario gives case.yaml, its measurements, and truth.yaml, which no command reads. A YAML
    configuration gives train.csv, extrapolation-1.csv and so on, in the form that is read back.
    """
    if not what.endswith((".yaml", ".yml")):
        if setting:
            raise InputError("--set is for a configuration file", do="leave it out")
        _case(what, out, hide or [], seed or 0, noise_factor, held_out, as_json)
        return
    if hide or held_out or noise_factor != 1.0:
        raise InputError(
            "--hide, --held-out and --noise-factor are for a scenario",
            do="name one; unmodeled scenarios lists them",
        )
    _orbits(Path(what), out, seed, setting, as_json)


def hidden_effects(texts: Sequence[str], case: Case) -> list[HiddenEffect]:
    """Return what ``--hide`` names.

    Parameters
    ----------
    texts : sequence of str
        ``NAME``, ``NAME=STRENGTH`` or ``PARAMETER=VALUE UNIT``; a bare VALUE is in SI.
    case : Case
        Of the scenario: its candidates can be hidden, and what the catalogue lacks.

    Raises
    ------
    ConfigError
        If a name is unknown, a number or a unit is wrong, or an effect is named twice.
    """
    from unmodeled.pipeline.cases.outside_effects import outside_effects
    from unmodeled.pipeline.cases.simulate_case import HiddenEffect

    every = {c.name: c for c in (*case.candidates, *outside_effects(case))}
    owners = {
        p.name: c for c in reversed(every.values()) for p in c.parameters if p.name in c.values
    }
    strengths: dict[str, float] = {}
    values: dict[str, dict[str, float]] = {}
    for text in texts:
        key, sign, given = (part.strip() for part in text.partition("="))
        if key in every:
            if key in strengths:
                raise ConfigError(f"--hide names {key} twice", do="name it once")
            strengths[key] = _number(given, text) if sign else _STRENGTH
        elif key in owners:
            if not sign:
                raise ConfigError(f'--hide "{text}" has no value', do=f'write "{key}=VALUE UNIT"')
            values.setdefault(owners[key].name, {})[key] = _quantity(
                given, {p.name: p.unit for p in owners[key].parameters}[key], key
            )
        else:
            hint = nearest(key, [*every, *owners])
            raise ConfigError(
                f'--hide "{text}": there is no effect or parameter "{key}" here',
                do=hint if hint.startswith("did") else "ask `unmodeled effects SCENARIO` for all",
            )
    both = set(strengths) & set(values)
    if both:
        raise ConfigError(
            f"--hide gives {', '.join(sorted(both))} a strength and a value", do="give one of them"
        )
    return [
        *(HiddenEffect(name, noncentrality=s) for name, s in strengths.items()),
        *(HiddenEffect(name, v) for name, v in values.items()),
    ]


def _number(given: str, text: str) -> float:
    try:
        value = float(given)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise ConfigError(f'--hide "{text}"', allowed="a strength > 0, e.g. srp=100")
    return value


def _quantity(given: str, unit: str, name: str) -> float:
    from unmodeled.pipeline.cases.quantities import parse_quantity

    try:
        return float(given)
    except ValueError:
        return parse_quantity(given, unit, name)


def _case(
    scenario: str,
    out: Path,
    hide: Sequence[str],
    seed: int,
    noise_factor: float,
    held_out: bool,
    as_json: bool,
) -> None:
    from unmodeled.pipeline.cases.scenario_orbits import SCENARIOS
    from unmodeled.pipeline.cases.simulate_case import scenario_case
    from unmodeled.pipeline.cases.simulated_files import CASE_FILE, TRUTH_FILE, simulate_case

    if scenario not in SCENARIOS:
        raise ConfigError(
            f'there is no scenario "{scenario}"',
            allowed=f"{', '.join(SCENARIOS)}, or a YAML configuration",
            do=nearest(scenario, SCENARIOS),
        )
    if not (math.isfinite(noise_factor) and noise_factor > 0):
        raise ConfigError(f"--noise-factor is {noise_factor}", allowed="a number > 0")
    if seed < 0:
        raise ConfigError(f"--seed is {seed}", allowed="a whole number >= 0")
    if out.is_file():
        raise InputError(f"{out} is a file", allowed="a folder for the case")
    if (out / CASE_FILE).exists():
        raise ConfigError(f"{out} holds a case already", do="name another folder")
    hidden = hidden_effects(hide, scenario_case(scenario, seed)) if hide else []
    path = simulate_case(
        scenario, hidden, seed=seed, folder=out, noise_factor=noise_factor, held_out=held_out
    )
    if as_json:
        files = {"case": str(path), "truth": str(out / TRUTH_FILE)}
        print(json.dumps({"scenario": scenario, "seed": seed, **files}, indent=2))
        return
    print(f"case: {path}")
    print(f"what is hidden in it: {out / TRUTH_FILE} (no command reads this file)")


def _orbits(
    config: Path, out: Path, seed: int | None, setting: list[str] | None, as_json: bool
) -> None:
    resolved, _ = resolve(config, None, seed, setting)
    from unmodeled.datasets.tabular import write_trajectory
    from unmodeled.pipeline.prepare import simulate as run
    from unmodeled.pipeline.run_folder import new_files

    if not resolved.data.simulated:
        raise InputError(
            f"data.trajectory is {resolved.data.trajectory}", allowed="simulated for this command"
        )
    if out.is_file():
        raise InputError(f"{out} is a file", allowed="a folder for the orbits")
    _, orbits, _ = run(resolved)
    more = range(2, resolved.data.training_orbits + 1)
    others = range(1, len(orbits.orbits) - len(more))
    names = ["train.csv", *(f"extrapolation-{k}.csv" for k in others)]
    names += [f"train-{k}.csv" for k in more]
    with new_files(out) as staging:
        for name, orbit in zip(names, orbits.orbits, strict=True):
            write_trajectory(orbit, staging / name)
    if as_json:
        print(json.dumps({"files": [str(out / n) for n in names]}, indent=2))
        return
    for name, orbit in zip(names, orbits.orbits, strict=True):
        print(f"{out / name}: {len(orbit)} samples over {orbit.times[-1]:.6g} s")
