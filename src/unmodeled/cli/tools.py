"""What all commands share: the application, progress on stderr, Ctrl-C, warnings as sentences."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, ParamSpec

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from typer.core import TyperGroup

from unmodeled.core.errors import InputError, UnmodeledWarning

__all__ = [
    "AsJson",
    "DataFolder",
    "app",
    "data_folders",
    "errors",
    "progress",
    "show_warning",
    "stoppable",
]

#: Option of commands that print a table.
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]
#: As a user meets them.
_ORDER = (
    *("characterize", "sweep", "resume", "status", "export", "select", "report", "reproduce"),
    "navigate",
    *("simulate", "compare", "diagnose", "add", "scenarios", "effects"),
)


class _InOrder(TyperGroup):
    """Lists the commands of the two stories first."""

    def list_commands(self, ctx: Any) -> list[str]:
        names = super().list_commands(ctx)
        return [n for n in _ORDER if n in names] + sorted(set(names) - set(_ORDER))


app = typer.Typer(
    cls=_InOrder,
    name="unmodeled",
    help="What does my force model lack, and can I trust what I learned about it?",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
P = ParamSpec("P")
errors = Console(stderr=True, highlight=False)

DataFolder = Annotated[
    Path | None, typer.Option("--data", help="Folder in which data files are looked for.")
]


def stoppable(command: Callable[P, None]) -> Callable[P, None]:
    """Answer Ctrl-C with one sentence; run folders appear whole or not at all."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            command(*args, **kwargs)
        except KeyboardInterrupt:
            errors.print("stopped; no result was written", markup=False)
            raise SystemExit(130) from None

    return run


@contextmanager
def progress() -> Iterator[Callable[[str, float], None]]:
    """Show a bar on stderr; give a function that takes a text and the share done."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=errors, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda text, share: bar.update(task, description=text, completed=share)


def data_folders(data: Path | None) -> list[Path]:
    """Return the folder of ``--data`` as a list.

    Raises
    ------
    InputError
        If it is not a folder.
    """
    if data is not None and not data.is_dir():
        raise InputError(f"--data {data} is not a folder")
    return [data] if data is not None else []


def show_warning(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    """Print our own warnings as a sentence; those of libraries with their category."""
    kind = "warning" if issubclass(category, UnmodeledWarning) else category.__name__
    errors.print(f"{kind}: {message}", markup=False, soft_wrap=True)
