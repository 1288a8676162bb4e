"""A diagnosis on the terminal: lines of plain text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from unmodeled.pipeline.diagnosis.add_effect import Addition
from unmodeled.pipeline.diagnosis.result import Diagnosis
from unmodeled.reports.diagnosis_tables import addition_table
from unmodeled.reports.diagnosis_words import (
    detectable,
    detectable_sentence,
    estimate_text,
    grouped_remarks,
    noise_sentence,
    remainder_sentence,
    step_label,
)
from unmodeled.reports.numbers import number

__all__ = ["addition_lines", "columns", "diagnosis_lines", "text_waterfall"]

_BAR = 32
_MOST_DETECTABLE = 10
_MOST_SETS = 6
_MOST_RIVALS = 3


def diagnosis_lines(d: Diagnosis) -> list[str]:
    """Return verdict, noise, findings, waterfall, and what would have been seen."""
    lines = [d.sentence, noise_sentence(d), remainder_sentence(d), ""]
    if d.findings:
        heads = ("effect", "estimate", "fall of chi2", "needed", "cannot be told from")
        rows = []
        for f in d.findings:
            rivals = _few([r.name for r in f.rivals]) or "-"
            for k, e in enumerate((*f.estimates, *f.place)):
                first = k == 0
                rows.append(
                    (
                        f.name if first else "",
                        f"{e.name} = {estimate_text(e.value, e.sigma, e.unit)}",
                        number(f.drop, 3) if first else "",
                        number(f.threshold, 3) if first else "",
                        rivals if first else "",
                    )
                )
        lines += [*columns(heads, rows), ""]
        remarks = [f"{f.name}: {r}" for f in d.findings for r in grouped_remarks(f.remarks)]
        lines += [*remarks, ""] if remarks else []
    lines += _other_sets(d)
    lines += text_waterfall(d)
    if d.findings:
        return lines
    lines += ["", detectable_sentence(d)]
    table = detectable(d).head(_MOST_DETECTABLE)
    rows = [
        (
            str(row["name"]),
            str(row["parameter"]),
            number(float(row["smallest_detectable"]), 2),
            number(float(row["expected"]), 2),
            "-" if row["unit"] == "1" else str(row["unit"]),
        )
        for _, row in table.iterrows()
    ]
    heads = ("effect", "parameter", "smallest detectable", "expected", "unit")
    return [*lines, *columns(heads, rows)] if rows else lines


def _other_sets(d: Diagnosis) -> list[str]:
    """Return the sets that explain as much, and what is not believed."""
    lines = []
    if d.alternatives:
        sets = [(" + ".join(a.effects), number(a.odds, 2)) for a in d.alternatives[:_MOST_SETS]]
        left = len(d.alternatives) - len(sets)
        lines += columns(("fits as well, in place of all of this", "odds against it"), sets)
        lines += [*([f"and {left} more"] if left > 0 else []), ""]
    if d.dismissed:
        doubts = [(x.name, number(x.drop, 3), f"{x.strength:.1f} sigma") for x in d.dismissed]
        heads = ("not believed: what remains is not white", "fall of chi2", "by stretches of time")
        lines += [*columns(heads, doubts), ""]
    return lines


def _few(names: Sequence[str]) -> str:
    """Return the first names, and how many more there are."""
    left = len(names) - _MOST_RIVALS
    return ", ".join(names[:_MOST_RIVALS]) + (f" and {left} more" if left > 0 else "")


def addition_lines(a: Addition) -> list[str]:
    """Return the estimate and the error before and after, in SI and in sigmas."""
    lines = [f"{a.candidate.title} added"]
    lines += [f"  {e.name} = {estimate_text(e.value, e.sigma, e.unit)}" for e in a.estimates]
    for e in a.estimates:
        if e.accepted is not None and e.pull is not None:
            lines.append(f"  accepted: {number(e.accepted, 6)} {e.unit}, {e.pull:+.1f} sigma away")
    lines += [f"chi-square falls by {number(a.delta_chi_square, 4)}", ""]
    table = addition_table(a)
    lines += columns(tuple(c.removesuffix(" [–]") for c in table.columns), table.rows)
    if a.held_out_before is not None and a.held_out_after is not None:
        lines.append(
            f"held-out arcs: {number(a.held_out_before, 4)} before, "
            f"{number(a.held_out_after, 4)} after [σ]"
        )
    return lines


def text_waterfall(d: Diagnosis) -> list[str]:
    """Return a bar a step, under the names of effects; lengths are logarithmic if they fall far."""
    values = [s.rms for s in d.steps]
    low = 0.5 * min(*values, d.noise)
    far = max(values) > 6.0 * min(values)
    top = max(values)

    def length(value: float) -> int:
        share = math.log(value / low) / math.log(top / low) if far else value / top
        return max(round(_BAR * share), 1)

    held_out = any(s.held_out_rms is not None for s in d.steps)
    rows = [
        (
            step_label(s.added, {}).replace("\n", " "),
            "█" * length(s.rms),
            number(s.rms, 3),
            *(("-" if s.held_out_rms is None else number(s.held_out_rms, 3),) if held_out else ()),
        )
        for s in d.steps
    ]
    rows.append(("noise as found", "░" * length(d.noise), number(d.noise, 3), ""))
    heads = ("residual RMS, in stated sigmas", "", "fitted", "held out")
    return columns(heads if held_out else heads[:3], rows)


def columns(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows under their heads, each column as wide as it needs.

    Examples
    --------
    >>> columns(("a", "bcd"), [("ef", "g")])
    ['a   bcd', 'ef  g']
    """
    widths = [max(len(r[k]) for r in (heads, *rows)) for k in range(len(heads))]
    return [
        "  ".join(f"{cell:{w}}" for cell, w in zip(row, widths, strict=False)).rstrip()
        for row in (heads, *rows)
    ]
