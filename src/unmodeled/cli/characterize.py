"""The command `characterize`, and how commands read a configuration."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from unmodeled.cli.tools import DataFolder, app, data_folders, progress, stoppable
from unmodeled.core.errors import ConfigError

__all__ = ["Seed", "Settings", "characterize", "resolve"]

ConfigFile = Annotated[
    Path, typer.Argument(help="YAML configuration, e.g. scenarios/bennu-demo.yaml.")
]
Seed = Annotated[int | None, typer.Option("--seed", help="Replaces the seed of the file.")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", help="Replaces a key of the file, e.g. --set noise.acceleration=0.1."),
]


@app.command()
@stoppable
def characterize(
    config: ConfigFile,
    out: Annotated[
        Path | None, typer.Option("--out", help="Run folder; default runs/NAME.")
    ] = None,
    data: DataFolder = None,
    seed: Seed = None,
    setting: Settings = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the results as JSON instead of a table.")
    ] = False,
) -> None:
    """Train learners on one orbit; test them on it (safety) and on others (robustness).

    Writes a run folder with report.html, the figures, the tables, the learned models, the
    resolved configuration and the provenance.
    """
    resolved, folders = resolve(config, data, seed, setting)
    from unmodeled.pipeline.characterize import characterize as run
    from unmodeled.pipeline.run_folder import check_run_folder, run_folder
    from unmodeled.reports import write_report

    target = out or Path("runs") / resolved.name
    check_run_folder(target)
    with progress() as report:
        result = run(resolved, folders, report)
    with run_folder(target) as staging:
        result.save(staging)
        write_report(result, staging)
    if as_json:
        print(json.dumps(result.as_json(), indent=2))
    else:
        _print_summary(result)
        print(f"report: {target / 'report.html'}")


def resolve(
    config: Path, data: Path | None, seed: int | None, settings: list[str] | None
) -> tuple[Any, list[Path]]:
    """Read a configuration with its changes; return it and the folders for data files.

    Raises
    ------
    ConfigError, InputError
        If the file, a change or the folder is wrong.
    """
    from unmodeled.pipeline.config import CharacterizationConfig
    from unmodeled.pipeline.yaml12 import parse_scalar, read_yaml

    content = read_yaml(config)
    for text in settings or []:
        key, sign, value = text.partition("=")
        if not sign or not key:
            raise ConfigError(f'--set "{text}"', allowed="KEY=VALUE, e.g. noise.state=0.05")
        _put(content, key.split("."), parse_scalar(value), text)
    if seed is not None:
        content["seed"] = seed
    folders = data_folders(data)
    return CharacterizationConfig.resolve(content, str(config)), [*folders, config.parent]


def _put(content: dict[str, Any], keys: list[str], value: Any, text: str) -> None:
    for key in keys[:-1]:
        content = content.setdefault(key, {})
        if not isinstance(content, dict):
            raise ConfigError(f'--set "{text}": {key} is not a section')
    content[keys[-1]] = value


def _print_summary(result: Any) -> None:
    """Print the answer in words and one row a learner."""
    from unmodeled.reports import overview

    print(overview(result))
    if result.data.axes_rate is not None:
        print(f"axes of the samples: {result.data.facts['axes of the samples']}")
    width = max(len(r.label) for r in result.learners)
    print("\nfractional acceleration error |a - a_pred| / |a|: medians, and the worst elsewhere")
    heads = ("training", "interpolation", "extrapolation", "worst")
    print(" " * width + "".join(f"  {head:>13}" for head in heads))
    for r in result.learners:
        s = r.summaries
        if s:
            errors = [s[k].median for k in ("train", "interpolation", "extrapolation")]
            cells = (f"  {e:13.1e}" for e in (*errors, s["extrapolation"].worst))
            print(f"{r.label:{width}}" + "".join(cells))
    for r in result.learners:
        if r.failure:
            print(f"{r.label} failed: {r.failure}")
