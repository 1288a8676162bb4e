"""The HTML page of a sweep: one file that needs nothing else, figures beside it."""

from __future__ import annotations

import json
from pathlib import Path

from unmodeled.core.errors import InputError
from unmodeled.core.provenance import Provenance
from unmodeled.pipeline.select.blocks import METRICS
from unmodeled.pipeline.select.select import Selection, select
from unmodeled.pipeline.sweep.journal import storage_error
from unmodeled.pipeline.sweep.sweep import Opened, open_sweep
from unmodeled.reports.embedding import embed_sections, provenance_rows, render_page, yaml_text
from unmodeled.reports.sweep_sections import sweep_sections
from unmodeled.reports.sweep_view import SweepView, ordered_by_error, view_of

__all__ = ["write_sweep_report"]


def write_sweep_report(
    sweep: Opened | Path | str, metric: str = "extrapolation_median", folder: Path | None = None
) -> Path:
    """Write ``report.html`` and ``figures/*.png``, ``figures/*.svg`` into a sweep's folder.

    The page asks for nothing over the network and runs no script. It shows the runs that are
    finished, and says how many are not.

    Parameters
    ----------
    sweep : Opened or path
        The sweep, or its folder.
    metric : str
        What learners are compared by, see `select`.
    folder : Path, optional
        Another folder for page and figures.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        The folder is not a sweep, no run is finished, or the disk is full.
    """
    opened = sweep if isinstance(sweep, Opened) else _open(Path(sweep))
    view = view_of(opened)
    selection, reason = _selection(view, metric)
    target = (folder or opened.store.folder) / "report.html"
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        sections = embed_sections(sweep_sections(view, selection, metric), target.parent)
        page = render_page(
            "sweep.html.j2",
            name=view.name,
            title="which learner can be trusted, where, at what cost?",
            kicker="Sweep",
            question="Which of these learners can be trusted, on its own orbit (safety) and on "
            "others (robustness), and at what cost?",
            styles=view.styles,
            overview=overview_sentence(view),
            findings=[c.sentence for c in selection.choices] if selection else [reason],
            basis=_basis(view),
            sections=sections,
            source_title="Sweep file",
            source_words="Everything that decides the numbers; as a file it runs again as it is.",
            source=yaml_text(opened.plan.config.as_dict()),
            provenance=provenance_rows(_provenance(opened), "sweep file"),
        )
        target.write_text(page, encoding="utf-8")
    except OSError as error:
        raise storage_error(error, target.parent) from error
    return target


def overview_sentence(view: SweepView) -> str:
    """Return how much is finished and which learner has the lowest median, in one sentence."""
    failed = int((view.table["failure"] != "").sum())
    done = f"{len(view.table)} of {view.planned} runs are finished"
    done += f", {failed} of them with a fit that failed" if failed else ", no fit failed"
    if len(view.labels) == 1:
        return f"{done}."
    best = {
        word: ordered_by_error(view, metric)[0]
        for word, metric in (
            ("the training orbit", "interpolation_median"),
            ("other orbits", "extrapolation_median"),
        )
    }
    if len(set(best.values())) == 1:
        lowest = f"{next(iter(best.values()))} has the lowest median error both on the training "
        lowest += "orbit and on other orbits"
    else:
        lowest = " and ".join(
            f"{who} has the lowest median error on {on}" for on, who in best.items()
        )
    return f"Over all runs {lowest}. {done}."


def _selection(view: SweepView, metric: str) -> tuple[Selection | None, str]:
    """Return the comparison, or why there is none: one learner, or nothing in common yet."""
    if metric not in METRICS:
        select(view.table, metric)  # raises, with the nearest name
    try:
        return select(view.table, metric), ""
    except InputError as error:
        return None, f"The learners are not compared: {error}"


def _basis(view: SweepView) -> list[str]:
    found = [
        "Errors are fractional acceleration errors |a − â| / |a|, the median over the samples of "
        "each run; 1 is no skill. A fit that failed counts as an infinite error."
    ]
    if view.orbits < 30:
        found.append(
            f"With {view.orbits} initial conditions this describes these orbits rather than the "
            "learners: take 30 or more before you choose."
        )
    return found


def _open(folder: Path) -> Opened:
    if not folder.is_dir():
        raise InputError(f"no folder {folder}", allowed="the folder of a sweep")
    return open_sweep(folder)


def _provenance(opened: Opened) -> Provenance:
    record = json.loads((opened.store.folder / "provenance.json").read_text())
    names = Provenance.__dataclass_fields__
    return Provenance(**{k: v for k, v in record.items() if k in names})
