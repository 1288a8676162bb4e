"""A diagnosis in words: on the page and on the terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import pandas as pd

from unmodeled.pipeline.diagnosis.result import Diagnosis, Estimate, Finding
from unmodeled.reports.numbers import number

__all__ = [
    "detectable",
    "detectable_sentence",
    "estimate_text",
    "estimates_text",
    "finding_sentence",
    "grouped_remarks",
    "noise_sentence",
    "remainder_sentence",
    "residual_sentence",
    "step_label",
]

#: Noise within these bounds is called as stated: chi-square itself is tested in `compare`.
_AS_STATED = (0.9, 1.1)
_MOST_NAMED = 4
#: log10 of the chance below which held-out residuals are called larger than foretold.
_SURPRISE = -3.0


def estimate_text(value: float, sigma: float | None, unit: str) -> str:
    """Return value and standard deviation with a common power of ten, and the unit.

    Examples
    --------
    >>> estimate_text(1.1206e-4, 4.33e-6, "m2 kg-1")
    '(1.121 ± 0.043)e-4 m2 kg-1'
    >>> estimate_text(4.8904, 0.0012, "m3 s-2")
    '4.8904 ± 0.0012 m3 s-2'
    >>> estimate_text(0.98, None, "1")
    '0.98'
    """
    tail = "" if unit == "1" else f" {unit}"
    if sigma is None or not (math.isfinite(sigma) and sigma > 0):
        return f"{value:.4g}{tail}"
    size = max(abs(value), sigma)
    power = math.floor(math.log10(size))
    if -3 < power < 5:
        power = 0
    decimals = max(1 - math.floor(math.log10(sigma / 10.0**power)), 0)
    shown = f"{value / 10.0**power:.{decimals}f} ± {sigma / 10.0**power:.{decimals}f}"
    return f"({shown})e{power}{tail}" if power else shown + tail


def residual_sentence(d: Diagnosis) -> str:
    """Say how far the residuals fell."""
    first, last = d.steps[0], d.steps[-1]
    if len(d.steps) == 1:
        text = f"The residual RMS is {number(first.rms, 3)} σ"
        if first.held_out_rms is not None:
            text += f", on the held-out arcs {number(first.held_out_rms, 3)} σ"
        return text + "; nothing was added."
    text = f"The residual RMS falls from {number(first.rms, 3)} to {number(last.rms, 3)} σ"
    if first.held_out_rms is not None and last.held_out_rms is not None:
        text += (
            f", on the held-out arcs, which are not fitted, from {number(first.held_out_rms, 3)} "
            f"to {number(last.held_out_rms, 3)} σ"
        )
    return f"{text}.{_forecast(d)}"


def _forecast(d: Diagnosis) -> str:
    if d.forecast is None:
        return ""
    f = d.forecast
    verdict = "as seen" if f.log10_p > _SURPRISE else "less than is seen, so the model is not right"
    return (
        f" From the noise and the covariance of the estimates {number(f.before, 3)} and "
        f"{number(f.after, 3)} σ are to be expected there: {verdict}."
    )


def noise_sentence(d: Diagnosis) -> str:
    """Say whether what is left is as large as the stated noise."""
    shown = number(d.noise, 3)
    low, high = _AS_STATED
    if low <= d.noise <= high:
        return f"What is left is {shown} times the stated noise: the noise was stated rightly."
    if d.noise > high and d.remainder is not None:
        return f"What is left is {shown} times the stated noise: a force is in it."
    word = "larger" if d.noise > high else "smaller"
    return (
        f"What is left is {shown} times the stated noise: the noise is {word} than stated, and "
        "the sigmas here account for it."
    )


def remainder_sentence(d: Diagnosis) -> str:
    """Say whether a force is left."""
    p = d.remainder_log10_p
    chance = "above 0.001" if p > -3 else f"1e{p:.0f}"
    if p > -3:
        return f"No force is left that a free acceleration would find (p {chance})."
    if d.within_stated_noise:
        return (
            f"What is left is not white (p {chance}), but no larger than the stated noise, which "
            "covers it: a force and slow errors of the measurements cannot be told apart in it."
        )
    return f"A free acceleration still explains part of what is left (p {chance})."


def finding_sentence(finding: Finding) -> str:
    """Say what was found, how sure it is and what it could be instead; starts with the title."""
    numbers = estimates_text((*finding.estimates, *finding.place))
    text = (
        f"{finding.title}: {numbers}. Without it chi-square is "
        f"{number(finding.drop, 3)} higher; {number(finding.threshold, 3)} was needed."
    )
    if finding.rivals:
        text += (
            f" These data cannot tell it from: {finding.rivals_text}. That the label is right has "
            f"a probability of {number(finding.confidence, 2)} at most."
        )
    return " ".join([text, *(f"{_capital(r)}." for r in grouped_remarks(finding.remarks))])


def grouped_remarks(remarks: Sequence[str]) -> list[str]:
    """Say once what was said of several parameters: the first in full, the others by name.

    Examples
    --------
    >>> grouped_remarks(["dv_R is 3, 1 was expected: odd", "dv_T is 4, 1 was expected: odd"])
    ['dv_R is 3, 1 was expected: odd; dv_T likewise']
    """
    ends: dict[str, list[str]] = {}
    for remark in remarks:
        ends.setdefault(remark.rpartition(": ")[2], []).append(remark)
    texts = []
    for same in ends.values():
        others = ", ".join(r.split(" ", 1)[0] for r in same[1:])
        texts.append(f"{same[0]}; {others} likewise" if others else same[0])
    return texts


def _capital(text: str) -> str:
    """Begin with a capital letter, unless the first word is the name of a parameter."""
    first = text.split(" ", 1)[0]
    return text if "_" in first else f"{text[0].upper()}{text[1:]}"


def step_label(added: str, titles: Mapping[str, str]) -> str:
    r"""Return the words under a bar of the waterfall: one effect a line, a name without a title.

    Examples
    --------
    >>> step_label("srp, drag", {"srp": "solar radiation pressure", "drag": "drag"})
    '+ solar radiation pressure\n+ drag'
    >>> step_label("srp for drag", {})
    '+ srp\n- drag'
    """
    if not added:
        return "model as given"
    new, _, gone = added.partition(" for ")
    lines = [f"+ {titles.get(n, n)}" for n in new.split(", ") if n != "nothing"]
    lines += [f"- {titles.get(n, n)}" for n in gone.split(", ") if n]
    return "\n".join(lines)


def detectable(d: Diagnosis) -> pd.DataFrame:
    """Return what these data would have shown, the surest first; without what was found.

    Returns
    -------
    DataFrame
        Rows of `Diagnosis.candidates` with a finite ``smallest_detectable``, and ``share``: that
        over the expected size. Below one the effect would have been seen at its expected size.
    """
    table = d.candidates
    if "expected" not in table or not len(table):
        return pd.DataFrame(columns=["name", "title", "smallest_detectable", "unit", "share"])
    found = {f.name for f in d.findings}
    kept = table[table["smallest_detectable"].notna() & ~table["name"].isin(list(found))]
    kept = kept.assign(share=kept["smallest_detectable"] / kept["expected"])
    return kept.sort_values("share", kind="stable").reset_index(drop=True)


def detectable_sentence(d: Diagnosis) -> str:
    """Name the effects that these data would have shown at their expected size."""
    table = detectable(d)
    seen = table[table["share"] < 1.0]
    if not len(seen):
        return "No candidate would have been seen at its expected size: these data decide little."
    named = [
        f"{row['title']} ({row['parameter']} {number(float(row['smallest_detectable']), 2)}"
        + ("" if row["unit"] == "1" else f" {row['unit']}")
        + ")"
        for _, row in seen.head(_MOST_NAMED).iterrows()
    ]
    more = f" and {len(seen) - len(named)} more" if len(seen) > len(named) else ""
    return f"These data would have shown (least size with 90 % power): {', '.join(named)}{more}."


def estimates_text(estimates: Sequence[Estimate]) -> str:
    """Return all parameters in one line."""
    return "; ".join(f"{e.name} = {estimate_text(e.value, e.sigma, e.unit)}" for e in estimates)
