"""The command line: parse, call, print. Nothing is only here."""

from __future__ import annotations

import functools
import json
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any, ParamSpec

# One BLAS thread: learners work on many small problems, where more threads only get in each
# other's way. Must be set before numpy and torch load; a user's own setting wins.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import typer  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn  # noqa: E402
from rich.table import Table  # noqa: E402

from unmodeled.core.errors import (  # noqa: E402
    ConfigError,
    InputError,
    UnmodeledError,
    UnmodeledWarning,
)

__all__ = ["app", "main"]

app = typer.Typer(
    name="unmodeled",
    help="What does my force model lack, and can I trust what I learned about it?",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
P = ParamSpec("P")
_errors = Console(stderr=True, highlight=False)

ConfigFile = Annotated[
    Path, typer.Argument(help="YAML configuration, e.g. scenarios/bennu-demo.yaml.")
]
DataFolder = Annotated[
    Path | None, typer.Option("--data", help="Folder in which trajectory files are looked for.")
]
Seed = Annotated[int | None, typer.Option("--seed", help="Replaces the seed of the file.")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", help="Replaces a key of the file, e.g. --set noise.acceleration=0.1."),
]


def _stoppable(command: Callable[P, None]) -> Callable[P, None]:
    """Answer Ctrl-C with one sentence; run folders appear whole or not at all."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            command(*args, **kwargs)
        except KeyboardInterrupt:
            _errors.print("stopped; no result was written", markup=False)
            raise SystemExit(130) from None

    return run


@app.command()
@_stoppable
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
    resolved, folders = _resolve(config, data, seed, setting)
    from unmodeled.pipeline.characterize import characterize as run
    from unmodeled.pipeline.run_folder import check_run_folder, run_folder
    from unmodeled.reports import write_report

    target = out or Path("runs") / resolved.name
    check_run_folder(target)
    with _progress() as report:
        result = run(resolved, folders, report)
    with run_folder(target) as staging:
        result.save(staging)
        write_report(result, staging)
    if as_json:
        print(json.dumps(result.as_json(), indent=2))
    else:
        _print_summary(result)
        print(f"report: {target / 'report.html'}")


@app.command()
def simulate(
    config: ConfigFile,
    out: Annotated[Path, typer.Option("--out", help="Folder for the CSV files.")],
    seed: Seed = None,
    setting: Settings = None,
) -> None:
    """Write the true orbits of a configuration as CSV files, in the form that is read back.

    The training orbit becomes train.csv, the others extrapolation-1.csv and so on.
    """
    resolved, _ = _resolve(config, None, seed, setting)
    from unmodeled.datasets.tabular import write_trajectory
    from unmodeled.pipeline.prepare import simulate as run

    if not resolved.data.simulated:
        raise InputError(
            f"data.trajectory is {resolved.data.trajectory}", allowed="simulated for this command"
        )
    _, orbits, _ = run(resolved)
    out.mkdir(parents=True, exist_ok=True)
    for k, orbit in enumerate(orbits.orbits):
        path = out / ("train.csv" if k == 0 else f"extrapolation-{k}.csv")
        write_trajectory(orbit, path)
        print(f"{path}: {len(orbit)} samples over {orbit.times[-1]:.6g} s")


@app.command()
def bodies() -> None:
    """List the body cards."""
    from unmodeled.datasets.bodies import body_names, load_body

    table = Table("name", "GM [m3/s2]", "Brillouin radius [m]", "J2 (unnormalised)", "convention")
    for name in body_names():
        body = load_body(name)
        table.add_row(
            name,
            f"{body.gm:.10g}",
            f"{body.brillouin_radius:.10g}",
            f"{body.zonal_unnormalised().get(2, 0.0):.6g}",
            body.zonal_convention,
        )
    Console().print(table)


@app.command()
def learners() -> None:
    """List the learners and their hyperparameters with defaults."""
    from unmodeled.models.learned import learner_class, learner_names

    table = Table("kind", "hyperparameters (default)", "covariance", "what it is")
    for name in learner_names():
        cls = learner_class(name)
        if name == "residual":  # written as `baseline: point_mass`, not as a kind
            continue
        shown = ", ".join(f"{k}={v}" for k, v in cls.default_params().items())
        first = (cls.__doc__ or "").strip().splitlines()[0]
        table.add_row(name, shown, "yes" if cls.has_covariance else "no", first)
    Console().print(table)


@app.command()
def version() -> None:
    """Print the version."""
    print(f"unmodeled {metadata.version('unmodeled')}")


def main() -> None:
    """Run the command line: exit code 2 and one sentence for bad input, never a traceback."""
    warnings.showwarning = _show_warning
    try:
        app()
    except UnmodeledError as error:
        _errors.print(f"error: {error}", style="bold red", markup=False, soft_wrap=True)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        sys.exit(0)


def _show_warning(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    """Print our own warnings as a sentence; those of libraries with their category."""
    kind = "warning" if issubclass(category, UnmodeledWarning) else category.__name__
    _errors.print(f"{kind}: {message}", markup=False, soft_wrap=True)


def _resolve(
    config: Path, data: Path | None, seed: int | None, settings: list[str] | None
) -> tuple[Any, list[Path]]:
    """Read the configuration with its changes; return it and the folders for data files."""
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
    if data is not None and not data.is_dir():
        raise InputError(f"--data {data} is not a folder")
    folders = [data] if data is not None else []
    return CharacterizationConfig.resolve(content, str(config)), [*folders, config.parent]


def _put(content: dict[str, Any], keys: list[str], value: Any, text: str) -> None:
    for key in keys[:-1]:
        content = content.setdefault(key, {})
        if not isinstance(content, dict):
            raise ConfigError(f'--set "{text}": {key} is not a section')
    content[keys[-1]] = value


@contextmanager
def _progress() -> Iterator[Callable[[str, float], None]]:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=_errors, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda text, share: bar.update(task, description=text, completed=share)


def _print_summary(result: Any) -> None:
    """Print the answer in words and one row a learner."""
    from unmodeled.reports import overview

    print(overview(result))
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


if __name__ == "__main__":
    main()
