"""The commands of story B: `compare`, `diagnose`, `add`, `schema`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from unmodeled.cli.tools import DataFolder, app, data_folders, progress, stoppable
from unmodeled.core.errors import InputError

if TYPE_CHECKING:
    from unmodeled.pipeline.cases.case import Case

__all__ = ["add", "compare", "diagnose", "schema"]

CaseFile = Annotated[Path, typer.Argument(help="Case file, e.g. case.yaml.")]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print the answer as JSON; see unmodeled schema.")
]


@app.command()
@stoppable
def compare(
    case: CaseFile,
    out: Annotated[
        Path | None, typer.Option("--out", help="Run folder; default runs/NAME-compared.")
    ] = None,
    as_json: AsJson = False,
    data: DataFolder = None,
) -> None:
    """Fit the model as it is and say where, how and by how much it fails.

    Writes a run folder with report.html, the figures, and the residuals with their geometry.
    """
    loaded = _load(case, data)
    from unmodeled.pipeline.comparison.compare import compare as run
    from unmodeled.pipeline.comparison.save import comparison_text, save_comparison
    from unmodeled.pipeline.diagnosis.save import case_provenance
    from unmodeled.pipeline.run_folder import run_folder
    from unmodeled.reports.comparison_page import write_comparison_report
    from unmodeled.reports.comparison_words import comparison_words

    target = _run_target(out or Path("runs") / f"{loaded.name}-compared", case)
    with progress() as report:
        comparison = run(loaded, report)
    provenance = case_provenance(loaded)
    with run_folder(target) as staging:
        save_comparison(comparison, staging, provenance)
        write_comparison_report(comparison, staging, provenance)
    if as_json:
        print(comparison_text(comparison))
        return
    print("\n".join(comparison_words(comparison)))
    print(f"\nreport: {target / 'report.html'}")


@app.command()
@stoppable
def diagnose(
    case: CaseFile,
    out: Annotated[
        Path | None, typer.Option("--out", help="Run folder; default runs/NAME.")
    ] = None,
    auto: Annotated[
        bool,
        typer.Option("--auto", help="Also write case-final.yaml: the model with what is found."),
    ] = False,
    as_json: AsJson = False,
    data: DataFolder = None,
    false_alarm: Annotated[
        float | None,
        typer.Option("--false-alarm", help="Replaces the false-alarm probability of the file."),
    ] = None,
    most: Annotated[int, typer.Option("--most", min=1, help="Largest number of effects.")] = 5,
) -> None:
    """Say which effects a model lacks, how sure that is, and what cannot be told apart.

    Fits the case, scores all candidates, adds what passes and looks again until what is left is
    noise. Writes a run folder with report.html, the figures and the tables.
    """
    loaded = _load(case, data)
    if false_alarm is not None:
        loaded = replace(loaded, false_alarm=false_alarm)
    from unmodeled.pipeline.diagnosis.diagnose import diagnose as run
    from unmodeled.pipeline.diagnosis.save import case_provenance, save_diagnosis
    from unmodeled.pipeline.diagnosis.schema import as_text
    from unmodeled.pipeline.run_folder import run_folder
    from unmodeled.reports.diagnosis_page import write_diagnosis_report
    from unmodeled.reports.diagnosis_text import diagnosis_lines

    target = _run_target(out or Path("runs") / loaded.name, case)
    with progress() as report:
        diagnosis = run(loaded, most=most, progress=report)
    provenance = case_provenance(loaded)
    with run_folder(target) as staging:
        save_diagnosis(
            diagnosis,
            staging,
            provenance=provenance,
            case_folder=case.parent,
            final_folder=target,
            with_final_case=auto,
        )
        write_diagnosis_report(diagnosis, staging, provenance)
    if as_json:
        print(as_text("diagnose", diagnosis.as_json()))
        return
    print("\n".join(diagnosis_lines(diagnosis)))
    print(f"\nreport: {target / 'report.html'}")
    if auto:
        print(f"case with all that was found: {target / 'case-final.yaml'}")


@app.command()
@stoppable
def add(
    case: CaseFile,
    effect: Annotated[
        str, typer.Argument(help="Effect to add, e.g. srp; unmodeled effects CASE lists them.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", help="The next case file; default CASE-with-EFFECT.yaml beside it."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option("--report", help="Folder for a page with figures.")
    ] = None,
    as_json: AsJson = False,
    data: DataFolder = None,
) -> None:
    """Add one effect: fit without and with it, write the next case file, print the errors."""
    loaded = _load(case, data)
    from unmodeled.pipeline.diagnosis.next_case import plain_name

    target = out or case.with_name(f"{case.stem}-with-{plain_name(effect)}{case.suffix}")
    if target.exists():
        raise InputError(f"{target} exists", do="name another --out, or remove it")
    if not target.parent.is_dir():
        raise InputError(f"{target.parent} is not a folder", do="make it, or name another --out")
    from unmodeled.pipeline.cases.write_case import write_case
    from unmodeled.pipeline.diagnosis.add_effect import add as run
    from unmodeled.pipeline.diagnosis.next_case import moved
    from unmodeled.pipeline.diagnosis.save import save_addition
    from unmodeled.pipeline.diagnosis.schema import as_text
    from unmodeled.pipeline.run_folder import run_folder
    from unmodeled.reports.diagnosis_page import write_addition_report
    from unmodeled.reports.diagnosis_text import addition_lines

    if report is not None:
        _run_target(report, case)
    with progress() as bar:
        addition = run(loaded, effect, progress=bar)
    write_case(moved(addition.source, case.parent, target.parent), target)
    if report is not None:
        with run_folder(report) as staging:
            write_addition_report(addition, staging, save_addition(addition, staging))
    if as_json:
        print(as_text("add", addition.as_json() | {"next_case": str(target)}))
        return
    print("\n".join(addition_lines(addition)))
    print(f"\nnext case: {target}")
    if report is not None:
        print(f"report: {report / 'report.html'}")


@app.command()
def schema(
    command: Annotated[str, typer.Argument(help="compare, diagnose or add.")],
) -> None:
    """Print the JSON Schema of what a command prints with --json."""
    from unmodeled.pipeline.diagnosis.schema import json_schema

    print(json.dumps(json_schema(command), indent=2))


def _load(path: Path, data: Path | None) -> Case:
    folders = data_folders(data)
    from unmodeled.pipeline.cases.load_case import load_case

    return load_case(path, folders)


def _run_target(target: Path, case: Path) -> Path:
    """Return the folder of a run, if the run may take its place.

    Raises
    ------
    InputError
        If it holds something else, or the case file itself.
    """
    from unmodeled.pipeline.run_folder import check_run_folder

    check_run_folder(target)
    if case.resolve().is_relative_to(target.resolve()):
        raise InputError(
            f"{case} lies in {target}, whose content this run would replace",
            do="name another --out",
        )
    return target
