"""Draw a figure of a source paper again and put the paper's words beside our numbers."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from unmodeled.core.errors import ConfigError, InputError
from unmodeled.core.provenance import Provenance, collect_provenance
from unmodeled.datasets.bodies import load_body
from unmodeled.pipeline.sweep.run_id import digest
from unmodeled.pipeline.sweep.store import Store
from unmodeled.pipeline.sweep.sweep import Opened, open_sweep, sweep
from unmodeled.pipeline.trends.collision_boundary import collision_boundary, screen
from unmodeled.pipeline.trends.zonal_reach import zonal_reach
from unmodeled.reports.embedding import embed_sections, provenance_rows, render_page, yaml_text
from unmodeled.reports.figures.collision_boundary import collision_boundary_figure
from unmodeled.reports.figures.error_against_noise import error_against_noise
from unmodeled.reports.figures.head_to_head import head_to_head
from unmodeled.reports.figures.train_against_test import train_against_test
from unmodeled.reports.figures.zonal_radius import zonal_radius
from unmodeled.reports.reproduction.body_figures import answer_fig1, answer_fig4
from unmodeled.reports.reproduction.compared import Drawing, Found, as_frame, as_table
from unmodeled.reports.reproduction.filter_tables import answer_filters
from unmodeled.reports.reproduction.marchese_tables import (
    answer_fits,
    answer_integration,
    answer_learning,
)
from unmodeled.reports.reproduction.network_training import answer_training
from unmodeled.reports.reproduction.noise_figures import answer_fig12, answer_fig13
from unmodeled.reports.reproduction.off_nominal_table import answer_off_nominal
from unmodeled.reports.reproduction.published import PublishedFigure, published_figure
from unmodeled.reports.reproduction.volume_figures import answer_fig10, answer_fig11, pair_of
from unmodeled.reports.sections import Drawn, Section
from unmodeled.reports.sweep_sections import captions
from unmodeled.reports.sweep_view import SweepView, view_of

__all__ = ["Reproduction", "reproduce"]

_BODY = "bennu"
_SEED = 1
_SCREENED = {False: 10_000, True: 1_000}
#: Tables that are more than filters side by side on a scenario.
_OWN: dict[str, Callable[[PublishedFigure, bool, Callable[[int, int], None] | None], Drawing]] = {
    "pesce-table4": answer_off_nominal,
    "marchese-table3.3": answer_integration,
    "marchese-table3.5": answer_fits,
    "marchese-table3.6": answer_fits,
    "marchese-table3.7": answer_learning,
    "fereoli-fig10": answer_training,
}


@dataclass(frozen=True)
class Reproduction:
    """A figure drawn again.

    Parameters
    ----------
    figure : PublishedFigure
        What the paper says.
    table : DataFrame
        One row a statement: ``statement``, ``where``, ``paper``, ``ours``, ``agrees`` (yes, no,
        not compared), ``remark``.
    basis : str
        What ours was drawn from, in one sentence.
    folder : Path
        Holds ``figures/NAME.png`` and ``.svg``, ``comparison.csv`` and ``report.html``.
    """

    figure: PublishedFigure
    table: pd.DataFrame
    basis: str
    folder: Path

    @property
    def picture(self) -> Path:
        """The figure as PNG."""
        return self.folder / "figures" / f"{self.figure.name}.png"

    def as_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "name": self.figure.name,
            "source": f"{self.figure.source} {self.figure.key}",
            "basis": self.basis,
            "picture": str(self.picture),
            "statements": self.table.to_dict(orient="records"),
        }


def reproduce(
    name: str,
    *,
    small: bool = False,
    store: Path | str | None = None,
    out: Path | str | None = None,
    workers: int = 1,
    tell: Callable[[int, int], None] | None = None,
) -> Reproduction:
    """Draw a figure of a source paper again.

    Parameters
    ----------
    name : str
        ``"neamati-fig1"``, ``-fig4``, ``-fig10``, ``-fig11``, ``-fig12``, ``-fig13``;
        ``"pesce-table2"``, ``-table3``, ``-table4``; ``"marchese-table3.3"``, ``-table3.5``,
        ``-table3.6``, ``-table3.7``, ``-table5.1``; ``"fereoli-fig8"``, ``-fig10``.
    small : bool
        A smaller grid (or fewer initial conditions): tried in minutes, other numbers.
    store : path, optional
        Folder of a sweep that is read as it is; nothing is run. Without it the grid of
        ``sweeps/`` is run into ``runs/``, and what is there is not run again.
    out : path, optional
        Where figure, table and page go; ``runs/reproduce/NAME`` by default.
    workers : int
        Processes for the runs.
    tell : callable, optional
        Told how many runs of how many are finished.

    Raises
    ------
    ConfigError, InputError
        Unknown name, no sweep file, a store without the runs.
    """
    figure = published_figure(name)
    suffix = "-small" if small else ""
    folder = Path(out) if out is not None else Path("runs") / "reproduce" / f"{name}{suffix}"
    if figure.scenario or name in _OWN:
        if store is not None:
            raise ConfigError(f"{name} needs no sweep", do="leave --store out")
        drawing = _OWN.get(name, answer_filters)(figure, small, tell)
    elif not figure.sweep:
        if store is not None:
            raise ConfigError(f"{name} needs no runs", do="leave --store out")
        drawing = _fig1() if name == "neamati-fig1" else _fig4(small)
    else:
        opened = _runs(figure.sweep + suffix, store, workers, tell)
        drawing = _from_runs(figure, opened, suffix)
    _write(figure, drawing, folder)
    return Reproduction(figure, as_frame(figure, drawing.found), drawing.basis, folder)


def _fig1() -> Drawing:
    share = published_figure("neamati-fig1").statements["share"].values["share"]
    reach = zonal_reach(load_body(_BODY), share)
    caption = (
        f"Where each zonal term of {reach.body.title} has {100 * share:g} % of the specific "
        "potential at the Hill radius, in the meridian plane (left) and against co-latitude "
        "(right). Inside the Brillouin sphere the series need not converge."
    )
    basis = f"Body card {_BODY}, zonals {', '.join(f'J{n}' for n in reach.radius)}."
    return Drawing(
        zonal_radius(reach),
        "Contours of the zonal terms about the body",
        caption,
        answer_fig1(reach),
        basis,
        {"body": _BODY, "share": share},
    )


def _fig4(small: bool) -> Drawing:
    count = _SCREENED[small]
    screened = screen(load_body(_BODY), count, _SEED)
    boundary = collision_boundary(screened)
    caption = (
        "Initial conditions drawn from [Neamati2022] Table 3 and followed for 50 Kepler periods in "
        "the body's field: crosses enter the Brillouin sphere. The solid line is fitted to all of "
        "them by logistic regression."
    )
    return Drawing(
        collision_boundary_figure(screened, boundary),
        "Colliding and collision-free initial conditions in semi-major axis and eccentricity",
        caption,
        answer_fig4(screened, boundary),
        f"{count} initial conditions about {_BODY}, seed {_SEED}.",
        {"body": _BODY, "initial_conditions": count, "seed": _SEED},
    )


def _from_runs(figure: PublishedFigure, opened: Opened, suffix: str) -> Drawing:
    view = view_of(opened)
    pair = pair_of(view)
    beside = _beside(figure, opened.store.folder, suffix)
    draw: dict[str, Callable[[], tuple[Figure, str, dict[str, Found]]]] = {
        "neamati-fig10": lambda: (
            head_to_head(view, *pair),
            "head-to-head",
            answer_fig10(view, figure),
        ),
        "neamati-fig11": lambda: (
            train_against_test(view),
            "train-against-test",
            answer_fig11(view, figure),
        ),
        "neamati-fig12": lambda: (
            error_against_noise(view, "noise.state"),
            "noise",
            answer_fig12(view, figure),
        ),
        "neamati-fig13": lambda: (
            error_against_noise(view, "noise.acceleration"),
            "noise",
            answer_fig13(view, figure, beside),
        ),
    }
    axis = {"neamati-fig12": "noise.state", "neamati-fig13": "noise.acceleration"}.get(figure.name)
    if axis is not None and not view.varied(axis):
        raise InputError(
            f"{opened.store.folder} has runs at fewer than two levels of {axis}",
            do=f"give the folder of {figure.sweep} with --store, or finish it",
        )
    drawn, kind, found = draw[figure.name]()
    alt, caption = captions(view)[kind]
    basis = (
        f"{len(view.table)} of {view.planned} runs of {view.name}, "
        f"{view.orbits} initial conditions."
    )
    return Drawing(drawn, alt, caption, found, basis, opened.plan.config.as_dict())


def _beside(figure: PublishedFigure, folder: Path, suffix: str) -> SweepView | None:
    """Return the neighbouring runs that some statements are compared with, if they are there."""
    path = folder.parent / f"{figure.beside}{suffix}"
    if not figure.beside or not Store(path).journals.is_dir():
        return None
    opened = open_sweep(path)
    return None if opened.table().empty else view_of(opened)


def _runs(
    name: str, store: Path | str | None, workers: int, tell: Callable[[int, int], None] | None
) -> Opened:
    if store is not None:
        Store(store).require()
        return open_sweep(store)
    opened = open_sweep(_sweep_file(name), Path("runs") / name)
    sweep(opened, workers=workers, tell=tell)
    return opened


def _sweep_file(name: str) -> Path:
    """Return a file of ``sweeps/``, here or in the repository that the package runs from."""
    folders = (Path("sweeps"), Path(__file__).resolve().parents[4] / "sweeps")
    for folder in folders:
        if (folder / f"{name}.yaml").is_file():
            return folder / f"{name}.yaml"
    raise InputError(
        f"no file sweeps/{name}.yaml here",
        do="run it in the repository, or give the folder of finished runs with --store",
    )


def _write(figure: PublishedFigure, drawing: Drawing, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    as_frame(figure, drawing.found).to_csv(
        folder / "comparison.csv", index=False, lineterminator="\n"
    )
    section = Section(
        "figure",
        f"{figure.key}: {figure.title}",
        figures=(Drawn(figure.name, drawing.figure, drawing.alt, drawing.caption),),
        tables=(as_table(figure, drawing.found),),
    )
    agrees = [f.agrees for f in drawing.found.values()]
    record: Provenance = collect_provenance(digest(json.loads(json.dumps(drawing.source))), _SEED)
    page = render_page(
        "sweep.html.j2",
        name=figure.name,
        title="the paper's figure beside ours",
        kicker=f"Reproduction, {figure.source} {figure.key}",
        question=f"{figure.title}: what does the paper say, and what do we find?",
        styles={},
        overview=f"Of {len(agrees)} statements ours agrees with {agrees.count(True)}, differs from "
        f"{agrees.count(False)}; {agrees.count(None)} cannot be compared.",
        findings=[],
        basis=[drawing.basis],
        sections=embed_sections([section], folder),
        source_title="Made from",
        source_words="What decides our numbers.",
        source=yaml_text(drawing.source),
        provenance=provenance_rows(record, "made from"),
    )
    (folder / "report.html").write_text(page, encoding="utf-8")
