"""A comparison in words: every sentence follows from the numbers by a stated rule."""

from __future__ import annotations

import numpy as np

from unmodeled.pipeline.comparison.dependence import PLACE, ResidualMap
from unmodeled.pipeline.comparison.result import Comparison
from unmodeled.reports.numbers import engineering, number, seconds_text

__all__ = ["comparison_overview", "comparison_words"]

#: A variable is named as that on which the residuals depend below this probability of chance.
_LEVEL = 0.01
#: The residuals are worst in a third of a range if they are larger by this factor there.
_WORSE = 1.3
#: A period is named if it explains this share of the residuals.
_SHARE = 0.1
#: Kinds below this probability are not mentioned.
_MENTIONED = 0.1
#: A slower period than this share of the arc is called a drift.
_FEW = 1.0 / 3.0
#: Two periods are the same within this share.
_SAME = 0.04
_LOOKS = {
    "gravity": "gravity",
    "radiation": "radiation pressure",
    "drag": "drag",
    "impulsive": "a manoeuvre or another sudden change",
    "instrument": "the instruments, not a force",
}


def comparison_overview(comparison: Comparison) -> str:
    """Return the answer in a sentence or two.

    Only noise: reduced chi-square in its window, all series white, no force asked for. A period
    is named if it explains a tenth of the residuals, a range if they are 1.3 times larger there
    than elsewhere, a kind if its probability is 0.8; below that all kinds above 0.1 are named.
    """
    c = comparison
    if c.only_noise:
        return "The residuals are what the noise alone would give."
    if c.structureless:
        word = "larger" if c.reduced > 1 else "smaller"
        return (
            f"The residuals are {number(c.sigmas_left)} times the stated noise and have no "
            f"structure: it is the noise that is {word} than stated."
        )
    parts = [f"The residuals are {number(c.sigmas_left)} times the noise"]
    parts += [p for p in (_worst(c), _repeats(c), _depends(c), _curl(c)) if p]
    return f"{parts[0]}{'; ' if len(parts) > 1 else ''}{', '.join(parts[1:])}: {_looks(c)}."


def comparison_words(comparison: Comparison) -> list[str]:
    """Return all sentences: the overview, the fit, whiteness, dependence, the force."""
    c = comparison
    low, high = c.reduced_window
    size = "inside" if low <= c.reduced <= high else "outside"
    sentences = [
        comparison_overview(c),
        f"Reduced chi-square is {number(c.reduced, 3)} with {c.freedom} degrees of freedom, "
        f"{size} the 95 % window {number(low, 3)} to {number(high, 3)} of noise as stated.",
        _white(c),
    ]
    telling = [m for m in c.maps if m.p < _LEVEL]
    if telling:
        names = ", ".join(m.title for m in telling[:4])
        how = " even if what is correlated is kept together" if c.coloured else ""
        sentences.append(f"Mean residuals differ{how} with: {names}.")
    else:
        drift = (
            " Several revolutions of correlated residuals tell less than as many of white noise."
            if c.coloured
            else ""
        )
        sentences.append(f"No variable has bins whose mean residuals differ beyond chance.{drift}")
    sentences.append(_force(c))
    sentences.append(_weighed(c))
    return sentences


def _worst(c: Comparison) -> str:
    """Name the end of a range where the residuals are largest, of the clearest variable."""
    found: list[tuple[float, str]] = []
    for m in c.maps:
        if m.variable in ("radius", "time") and len(m.bins) >= 6:
            third = len(m.bins) // 3
            square, count = m.bins["rms"] ** 2 * m.bins["count"], m.bins["count"]
            first, last = (
                float(square.iloc[part].sum() / count.iloc[part].sum())
                for part in (slice(None, third), slice(-third, None))
            )
            rest = float(square.iloc[third:-third].sum() / count.iloc[third:-third].sum())
            for value, other, low in ((first, last, True), (last, first, False)):
                ratio = np.sqrt(value / max(other, rest))
                if ratio > _WORSE:
                    found.append((float(ratio), _end(c, m, third, low=low)))
    return f"worst {max(found)[1]}" if found else ""


def _end(c: Comparison, m: ResidualMap, third: int, *, low: bool) -> str:
    edge = float(m.bins["high"].iloc[third - 1] if low else m.bins["low"].iloc[-third])
    if m.variable == "time":
        return "at the beginning" if low else "at the end"
    return f"{'below' if low else 'above'} {number(edge / c.case.body.reference_radius)} radii"


def _repeats(c: Comparison) -> str:
    r = c.rhythm
    if r.p > _LEVEL or r.share < _SHARE:
        return ""
    if r.period > _FEW * r.span:
        return "drifting over the arc"
    same = ""
    for whole, name in ((c.period, "revolution"), (c.spin_period, "turn of the body")):
        for k, word in ((1, "once"), (2, "twice"), (3, "three times")):
            if not same and np.isfinite(whole) and abs(r.period * k / whole - 1) < _SAME:
                same = f" ({word} a {name})"
    return f"repeating every {seconds_text(r.period)}{same}"


def _depends(c: Comparison) -> str:
    e = c.explanation
    if e.kind in ("nothing", "undecided"):
        telling = [m for m in c.maps if m.p < _LEVEL and m.variable not in ("time", PLACE)]
        return f"depending on {telling[0].title}" if telling else ""
    best = e.table[e.table["kind"] == e.kind].iloc[0]
    return f"depending on {best['depends_on']}"


def _curl(c: Comparison) -> str:
    free = c.explanation.curl_free
    return "" if free is None else "curl-free" if free else "with curl"


def _looks(c: Comparison) -> str:
    e = c.explanation
    if e.kind in _LOOKS:
        return f"it looks like {_LOOKS[e.kind]}"
    if e.kind == "nothing":
        return "no force or instrument is asked for"
    ordered = sorted(e.probabilities.items(), key=lambda i: -i[1])
    some = [k for k, v in ordered if k in _LOOKS and v > _MENTIONED]
    general = str(e.table[e.table["kind"] == "undecided"].iloc[0]["title"])
    if not some:
        return f"it has no known character ({general} describes it best)"
    words = [_LOOKS[k] for k in some]
    if e.probabilities["undecided"] > _MENTIONED:
        words.append(general)
    if len(words) == 1:
        return f"it may be {words[0]}, but does not predict what was left out"
    return "it may be " + ", ".join(words[:-1]) + f" or {words[-1]}"


def _white(c: Comparison) -> str:
    tests = c.whiteness
    series = tests[["arc", "label", "component"]].drop_duplicates()
    bad = tests[tests["verdict"] == "coloured"][["arc", "label", "component"]].drop_duplicates()
    if not len(bad):
        return f"All {len(series)} series of residuals are white over one revolution."
    names = ", ".join(dict.fromkeys(f"{r.label} {r.component}" for r in bad.itertuples()))
    return f"{len(bad)} of {len(series)} series of residuals are not white: {names}."


def _force(c: Comparison) -> str:
    f = c.force
    if f.prior_sigma == 0:
        return "The residuals ask for no acceleration along the orbit."
    factor, prefix = engineering(f.prior_sigma)
    return (
        f"An acceleration of about {number(f.prior_sigma * factor)} {prefix}m/s² on each axis, "
        f"correlated over {seconds_text(f.tau)}, explains them (ln of the Bayes factor "
        f"{number(f.log_bayes)}). The data determine {number(100 * f.known)} % of it; the rest is "
        f"what the initial state absorbs or what changes faster than {seconds_text(2 * f.step)}."
    )


def _weighed(c: Comparison) -> str:
    e = c.explanation
    best = e.table.iloc[0]
    if e.kind == "nothing":
        return "No family of forces or instrument errors is ten times as likely as nothing."
    return (
        f"The likeliest family is {best['title']} (ln of the Bayes factor against nothing "
        f"{number(float(best['log_bayes']))}); it predicts {number(100 * float(best['skill']))} % "
        f"of the residuals that were left out, of {number(100 * e.possible_skill)} % that noise "
        f"allows."
    )
