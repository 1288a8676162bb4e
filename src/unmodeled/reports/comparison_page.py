"""The page of `compare`: where a model fails, in words, figures and tables."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from unmodeled.core.provenance import Provenance
from unmodeled.pipeline.comparison.result import Comparison
from unmodeled.reports import comparison_tables as tables
from unmodeled.reports.case_page import write_case_page
from unmodeled.reports.comparison_words import comparison_overview, comparison_words
from unmodeled.reports.figures.comparison_correlation import comparison_correlation
from unmodeled.reports.figures.comparison_force import comparison_force
from unmodeled.reports.figures.comparison_in_time import comparison_in_time
from unmodeled.reports.figures.comparison_maps import comparison_maps
from unmodeled.reports.figures.comparison_place import comparison_place
from unmodeled.reports.sections import Drawn, Section

__all__ = ["comparison_sections", "write_comparison_report"]


def write_comparison_report(
    comparison: Comparison, folder: Path, provenance: Provenance | None = None
) -> Path:
    """Write ``report.html`` and ``figures/*.png``, ``figures/*.svg``.

    Parameters
    ----------
    comparison : Comparison
        What to report.
    folder : Path
        Run folder; made if missing.
    provenance : Provenance, optional
        For the footer; collected now if not given.

    Returns
    -------
    Path
        The page, which asks for nothing over the network and runs no script.
    """
    case = comparison.case
    return write_case_page(
        folder,
        case,
        comparison_sections(comparison),
        provenance,
        title="where does the model fail?",
        kicker=f"Comparison, {case.body.title}",
        question="Where, how and by how much does the force model fail?",
        answer_title="What was found",
        answer=comparison_overview(comparison),
        findings=[],
        basis=comparison_words(comparison)[1:],
    )


def comparison_sections(comparison: Comparison) -> list[Section]:
    """Return the parts of the page below the words."""
    c = comparison
    place = "Longitude is inertial: the model does not turn the body."
    if c.spin_period < float("inf"):
        place = "Longitude and latitude turn with the body."
    return [
        Section(
            "residuals",
            "Residuals in time",
            figures=_one(
                "residuals-in-time",
                comparison_in_time(c),
                "Residuals in time, one panel a component, with twice the stated sigma",
                "Measured minus predicted after the fit: positions along the radial, transverse "
                "and normal axes of the orbit, other data as measured.",
            ),
            tables=(tables.rms_table(c),),
        ),
        Section(
            "dependence",
            "On what they depend",
            figures=(
                *_one(
                    "residual-maps",
                    comparison_maps(c),
                    "Mean residual in bins of the variables on which the residuals depend most",
                    "The four variables on which the mean residuals depend most, each bin in its "
                    "own standard errors for white noise.",
                ),
                *_one(
                    "place-map",
                    comparison_place(c),
                    "Longitude and latitude of the orbit, coloured by residual and acceleration",
                    "Where over the body the residuals and the reconstructed acceleration are "
                    f"large. {place}",
                ),
            ),
            tables=(tables.map_table(c),),
        ),
        Section(
            "force",
            "The acceleration that would explain them",
            figures=_one(
                "acceleration",
                comparison_force(c),
                "Reconstructed acceleration along the orbit on three axes with its uncertainty",
                "Smoothed first-order Gauss-Markov acceleration, initial states and free "
                "parameters refitted. Where the band is as wide as the prior the data say nothing.",
            ),
            tables=(tables.family_table(c),),
        ),
        Section(
            "whiteness",
            "Are they white?",
            figures=_one(
                "correlation",
                comparison_correlation(c),
                "Autocorrelation of the residuals with the band of white noise",
                "Autocorrelation of the residuals within passes, up to one revolution.",
            ),
            tables=(tables.whiteness_table(c),),
        ),
    ]


def _one(name: str, figure: Figure | None, alt: str, caption: str) -> tuple[Drawn, ...]:
    return () if figure is None else (Drawn(name, figure, alt, caption),)
