"""Tables of the page: plain text in cells, a unit in every header, sensible digits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.pipeline.use_check import point_mass_summaries
from unmodeled.reports.numbers import number
from unmodeled.reports.words import ranked

__all__ = [
    "Table",
    "calibration_table",
    "cost_table",
    "error_table",
    "fact_table",
    "flight_table",
    "orbit_table",
]


_MOST_ORBITS = 10
_SHARES = {
    0.0: "best orbit",
    0.25: "lower quartile",
    0.5: "median orbit",
    0.75: "upper quartile",
    1.0: "worst orbit",
}


@dataclass(frozen=True)
class Table:
    """A table of text; the first column heads the rows.

    Parameters
    ----------
    title : str
        What it shows.
    columns : tuple of str
        Headers, with the unit at the end in brackets: "training [s]"; [–] is dimensionless.
    rows : tuple of tuple of str
        Cells, as long as ``columns``.
    note : str
        Below the table.
    groups : tuple of (str, int)
        Headers above the columns after the first, each with the number of columns it spans.
    text_columns : tuple of int
        Columns of words, to be set flush left.
    learners : bool
        True if the first column names learners, which get their colour.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    groups: tuple[tuple[str, int], ...] = ()
    text_columns: tuple[int, ...] = ()
    learners: bool = True


def error_table(result: CharacterizationResult) -> Table:
    """Return medians, 95 % quantiles and worst errors, the most robust learner first."""
    reference = point_mass_summaries(result.data)["extrapolation"].median
    rows = []
    for r in ranked(result):
        if r.failure:
            rows.append((r.label, "failed", *["–"] * 6))
            continue
        s = r.summaries
        inside, outside = s["interpolation"], s["extrapolation"]
        rows.append(
            (
                r.label,
                number(s["train"].median),
                number(inside.median),
                number(inside.worst),
                number(outside.median),
                number(outside.median / reference) if reference > 0 else "–",
                number(outside.percentile_95),
                number(outside.worst),
            )
        )
    return Table(
        "Fractional acceleration errors",
        (
            "learner",
            "median [–]",
            "median [–]",
            "worst [–]",
            "median [–]",
            "median over point mass [–]",
            "95 % quantile [–]",
            "worst [–]",
        ),
        tuple(rows),
        "Errors are |a − â| / |a|. The bare known point mass has an extrapolation median of "
        f"{number(reference)}.{_not_finite(result)}",
        groups=(("training", 1), ("interpolation", 2), ("extrapolation", 4)),
    )


def _not_finite(result: CharacterizationResult) -> str:
    counts = {r.label: sum(s.failures for s in r.summaries.values()) for r in result.learners}
    found = [f"{label} {n}" for label, n in counts.items() if n]
    return f" Predictions that are not finite: {', '.join(found)}." if found else ""


def orbit_table(result: CharacterizationResult) -> Table:
    """Return the median error on each extrapolation orbit: how much the orbit decides."""
    samples = result.data.extrapolation
    orbits = sorted({int(k) for k in samples.orbit})
    rows = []
    many = len(orbits) > _MOST_ORBITS
    for r in ranked(result):
        if r.failure:
            continue
        medians = [float(np.median(r.errors["extrapolation"][samples.orbit == k])) for k in orbits]
        if many:  # "nearest" keeps infinite medians apart from finite ones
            medians = [float(np.quantile(medians, q, method="nearest")) for q in _SHARES]
        rows.append((r.label, *(number(m) for m in medians)))
    names = _SHARES.values() if many else [f"orbit {k}" for k in orbits]
    return Table(
        "Extrapolation median by orbit",
        ("learner", *(f"{name} [–]" for name in names)),
        tuple(rows),
        "Median fractional acceleration error on each extrapolation orbit"
        + (f", its spread over {len(orbits)} orbits." if many else "."),
    )


def flight_table(result: CharacterizationResult) -> Table:
    """Return largest position errors by orbit and number of periods."""
    periods = result.config.flight.periods
    orbits = sorted({f.orbit for r in result.learners for f in r.flights})
    names = {k: "training orbit" if k == 0 else f"orbit {k}" for k in orbits}
    rows = []
    for r in result.learners:
        if not r.flights:
            continue
        flights = {f.orbit: f for f in r.flights}
        cells = []
        for k in orbits:
            f = flights.get(k)
            cells += [number(f.flight.largest_error(p * f.period)) if f else "–" for p in periods]
        rows.append((r.label, *cells))
    floor = result.flight_floor
    note = _ended_early(result)
    if math.isfinite(floor):
        note += f"Flying the true field with the same solver leaves at most {number(floor)} m."
    else:
        note += "The true field is unknown, and so is the share of the solver in these errors."
    columns = [f"{p:g} period{'s' if p != 1 else ''} [m]" for p in periods] * len(orbits)
    return Table(
        "Largest position error of a flight",
        ("learner", *columns),
        tuple(rows),
        note,
        groups=tuple((names[k], len(periods)) for k in orbits),
    )


def _ended_early(result: CharacterizationResult) -> str:
    """Name the flights behind the infinite errors, with their reasons."""
    found = []
    for r in result.learners:
        reasons: dict[str, list[str]] = {}
        for f in r.flights:
            if f.flight.status != "complete":
                name = "the training orbit" if f.orbit == 0 else f"orbit {f.orbit}"
                reasons.setdefault(f.flight.status, []).append(name)
        if reasons:
            told = "; ".join(f"{why} on {', '.join(where)}" for why, where in reasons.items())
            found.append(f"{r.label} ({told})")
    return f"∞: the flight ended before that. Ended early: {', '.join(found)}. " if found else ""


def cost_table(result: CharacterizationResult) -> Table:
    """Return time, memory and size; they differ from run to run."""
    return Table(
        "Time and memory",
        (
            "learner",
            "training [s]",
            "memory growth in training [MB]",
            "one evaluation alone [µs]",
            "one point in a large call [µs]",
            "fitted arrays [kB]",
        ),
        tuple(
            (
                r.label,
                number(r.train_seconds),
                number(r.train_bytes / 1e6),
                number(r.single_seconds * 1e6),
                number(r.batch_seconds * 1e6),
                number(r.model_bytes / 1e3),
            )
            for r in result.learners
            if not r.failure
        ),
        "Wall times on the host named at the foot of the page; they differ from run to run.",
    )


def calibration_table(result: CharacterizationResult) -> Table:
    """Return coverage and likelihood of the learners that give a covariance."""
    unit = result.data.units.acceleration
    rows = []
    for r in result.learners:
        for name, c in r.calibrations.items():
            rows.append(
                (
                    r.label,
                    name,
                    f"{100 * c.coverage_68:.1f}",
                    f"{100 * c.coverage_95:.1f}",
                    number(c.median_sigma * unit),
                    number(c.negative_log_likelihood, 3),
                )
            )
    return Table(
        "Calibration of the predicted covariance",
        (
            "learner",
            "set",
            "within 1 sigma, 68.3 expected [%]",
            "within 1.96 sigma, 95.0 expected [%]",
            "median sigma [m/s²]",
            "negative log likelihood [nats a sample]",
        ),
        tuple(rows),
        "The likelihood is that of accelerations in normalised units; lower is better.",
        text_columns=(1,),
    )


def fact_table(result: CharacterizationResult) -> Table:
    """Return what the fitted learners say of themselves, a fact a row."""
    rows = [
        (r.label, key.replace("_", " "), value if isinstance(value, str) else number(value, 3))
        for r in result.learners
        for key, value in r.facts.items()
    ]
    units = result.data.units
    return Table(
        "What the fitted models say of themselves",
        ("learner", "fact", "value [normalised units]"),
        tuple(rows),
        f"One unit of length is {number(units.length, 4)} m, of time {number(units.time, 4)} s, "
        f"of acceleration {number(units.acceleration, 4)} m/s².",
        text_columns=(1,),
    )
