"""Tables of the page: plain text in cells, a unit in every header, sensible digits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.reports.baseline import point_mass_summaries
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


@dataclass(frozen=True)
class Table:
    """A table of text; the first column heads the rows.

    Parameters
    ----------
    title : str
        What it shows.
    columns : tuple of str
        Headers, with units.
    rows : tuple of tuple of str
        Cells, as long as ``columns``.
    note : str
        Below the table.
    learners : bool
        True if the first column names learners, which get their colour.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    learners: bool = True


def error_table(result: CharacterizationResult) -> Table:
    """Return medians, 95 % quantiles and worst errors, the most robust learner first."""
    reference = point_mass_summaries(result.data)["extrapolation"].median
    rows = []
    for r in ranked(result):
        if r.failure:
            rows.append((r.label, "failed", *["–"] * 7))
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
                number(outside.percentile_95),
                number(outside.worst),
                number(outside.median / reference) if reference > 0 else "–",
                str(sum(x.failures for x in s.values())),
            )
        )
    return Table(
        "Fractional acceleration errors",
        (
            "learner",
            "training median, 1",
            "interpolation median, 1",
            "interpolation worst, 1",
            "extrapolation median, 1",
            "extrapolation 95 % quantile, 1",
            "extrapolation worst, 1",
            "extrapolation median over bare point mass, 1",
            "not finite, samples",
        ),
        tuple(rows),
        "Errors |a − â| / |a| are dimensionless (unit 1). "
        f"The bare known point mass has an extrapolation median of {number(reference)}.",
    )


def orbit_table(result: CharacterizationResult) -> Table:
    """Return the median error on each extrapolation orbit: how much the orbit decides."""
    samples = result.data.extrapolation
    orbits = sorted({int(k) for k in samples.orbit})
    rows = []
    for r in ranked(result):
        if r.failure:
            continue
        medians = [float(np.median(r.errors["extrapolation"][samples.orbit == k])) for k in orbits]
        rows.append((r.label, *(number(m) for m in medians)))
    return Table(
        "Extrapolation median by orbit",
        ("learner", *(f"orbit {k}, 1" for k in orbits)),
        tuple(rows),
        "Median fractional acceleration error, dimensionless.",
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
        cells, reasons = [], []
        for k in orbits:
            f = flights.get(k)
            cells += [number(f.flight.largest_error(p * f.period)) if f else "–" for p in periods]
            if f and f.flight.status != "complete":
                reasons.append(f"{names[k]}: {f.flight.status}")
        rows.append((r.label, *cells, "; ".join(reasons) or "none"))
    floor = result.flight_floor
    note = "∞: the flight ended before. "
    if math.isfinite(floor):
        note += f"Flying the true field with the same solver leaves at most {number(floor)} m."
    else:
        note += "The true field is unknown, and so is the share of the solver in these errors."
    columns = [
        f"{names[k]}, {p:g} period{'s' if p != 1 else ''}, m" for k in orbits for p in periods
    ]
    return Table(
        "Largest position error of a flight",
        ("learner", *columns, "flights that ended early"),
        tuple(rows),
        note,
    )


def cost_table(result: CharacterizationResult) -> Table:
    """Return time, memory and size; they differ from run to run."""
    return Table(
        "Cost",
        (
            "learner",
            "training, s",
            "memory growth in training, MB",
            "one evaluation alone, µs",
            "one point in a large call, µs",
            "fitted arrays, kB",
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
            "within 1 sigma, % (68.3)",
            "within 1.96 sigma, % (95.0)",
            "median sigma, m/s²",
            "negative log likelihood, nats a sample",
        ),
        tuple(rows),
        "The likelihood is that of accelerations in normalised units; lower is better.",
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
        "The fitted models",
        ("learner", "fact", "value, normalised units"),
        tuple(rows),
        f"One unit of length is {number(units.length, 4)} m, of time {number(units.time, 4)} s, "
        f"of acceleration {number(units.acceleration, 4)} m/s².",
    )
