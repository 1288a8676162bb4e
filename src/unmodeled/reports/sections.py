"""What the page shows below its summary, in order: figures with captions, tables, words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from matplotlib.figure import Figure

from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.reports import figures as draw
from unmodeled.reports import tables
from unmodeled.reports.captions import caption
from unmodeled.reports.data_table import data_table, element_table
from unmodeled.reports.tables import Table
from unmodeled.reports.use_table import use_table
from unmodeled.reports.words import calibration_sentence, ranked

__all__ = ["Drawn", "Section", "sections"]

# Rows of three-dimensional panels that fit on one printed page.
_CURVES_PER_FIGURE = 3


@dataclass(frozen=True)
class Drawn:
    """A figure with its name and words.

    Parameters
    ----------
    name : str
        File name without ending.
    figure : Figure
        Drawn.
    alt, caption : str
        For those who cannot see it, and for those who can.
    """

    name: str
    figure: Figure
    alt: str
    caption: str


@dataclass(frozen=True)
class Section:
    """A part of the page."""

    id: str
    title: str
    words: tuple[str, ...] = ()
    figures: tuple[Drawn, ...] = ()
    tables: tuple[Table, ...] = ()


def sections(result: CharacterizationResult) -> list[Section]:
    """Return all sections that have something to show.

    Parameters
    ----------
    result : CharacterizationResult
        What to show.
    """
    counts = {s.name: len(s) for s in result.data.sets}
    trust = tuple(
        calibration_sentence(r.label, r.calibrations, counts)
        for r in ranked(result)
        if r.calibrations
    )
    uncertain = (tables.calibration_table(result),) if trust else ()
    everything = [
        Section(
            "head-to-head",
            "Head to head",
            figures=_one(result, "error-summary", draw.error_summary(result)),
            tables=(tables.error_table(result), use_table(result)),
        ),
        Section(
            "where",
            "Where the models fail",
            figures=_one(result, "error-against-radius", draw.error_against_radius(result)),
            tables=(tables.orbit_table(result),)
            if len(result.data.extrapolation_orbits) > 1
            else (),
        ),
        Section(
            "flights",
            "Flown with each model",
            figures=_one(result, "flight-error", draw.flight_error(result)),
            tables=(tables.flight_table(result),),
        ),
        Section(
            "uncertainty",
            "Can the predicted uncertainty be believed?",
            trust,
            _one(result, "calibration", draw.calibration(result)),
            uncertain,
        ),
        Section("curves", "Acceleration along the orbits", figures=tuple(_curves(result))),
        Section("cost", "What it costs", tables=(tables.cost_table(result),)),
        Section("models", "The fitted models", tables=(tables.fact_table(result),)),
        Section(
            "data",
            "The data",
            figures=_one(result, "trajectories", draw.trajectories(result)),
            tables=(data_table(result), element_table(result)),
        ),
    ]
    return [s for s in (_without_empty(s) for s in everything) if s.figures or s.tables]


def _without_empty(section: Section) -> Section:
    kept = tuple(t for t in section.tables if t.rows)
    return Section(section.id, section.title, section.words, section.figures, kept)


def _one(result: CharacterizationResult, name: str, figure: Figure | None) -> tuple[Drawn, ...]:
    if figure is None:
        return ()
    alt, text = caption(name, result)
    return (Drawn(name, figure, alt, text),)


def _curves(result: CharacterizationResult) -> Iterator[Drawn]:
    labels = [r.label for r in result.learners if r.learner is not None]
    groups = [labels[k : k + _CURVES_PER_FIGURE] for k in range(0, len(labels), _CURVES_PER_FIGURE)]
    for number, group in enumerate(groups, start=1):
        figure = draw.acceleration_curves(result, group)
        if figure is not None:
            alt, text = caption("acceleration-curves", result)
            part = f" Part {number} of {len(groups)}." if len(groups) > 1 else ""
            name = f"acceleration-curves-{number}"
            yield Drawn(name, figure, f"{alt}: {', '.join(group)}", text + part)
