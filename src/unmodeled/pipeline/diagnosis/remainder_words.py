"""What remains outside the catalogue, in words: its kind, and what was learned of it."""

from __future__ import annotations

import numpy as np

from unmodeled.pipeline.comparison.force_dependence import Dependence
from unmodeled.pipeline.comparison.force_kind import Explanation

__all__ = ["duration", "kind_words", "learned_words", "most_like"]

#: Two periods are the same within this share.
_SAME = 0.03
_LOOKS = {
    "gravity": "gravity",
    "radiation": "radiation pressure",
    "drag": "drag",
    "impulsive": "a sudden change of velocity",
    "instrument": "an error of the instruments",
}


def kind_words(found: Dependence, looks: Explanation, revolution: float, spin: float) -> str:
    """Return the kind of a force, e.g. "a force that depends on inertial position, with curl".

    Parameters
    ----------
    found : Dependence
        On what it depends.
    looks : Explanation
        What it looks like among the known kinds.
    revolution, spin : float
        Periods that are not its own, s.
    """
    inputs = found.best.inputs
    if inputs.kind == "period":
        axes = "fixed in space" if inputs.axes == "inertial" else "in orbital axes"
        own = _whose(inputs.period, revolution, spin)
        text = f"a push {axes} that repeats every {duration(inputs.period)}, {own}"
    elif inputs.kind == "time":
        text = "a force that changes with time, of which no place, angle or speed says more"
    else:
        curl = {None: "", True: ", curl-free", False: ", with curl"}[found.curl_free]
        text = f"a force that depends on {inputs.title}{curl}"
    others = [t for t in found.rivals if t != inputs.title]
    if others:
        text += f" (these data cannot tell it from a function of {' or '.join(others)})"
    if most_like(found, looks) in _LOOKS:
        text += f"; of the known kinds it is most like {_LOOKS[looks.kind]}"
    return text


def most_like(found: Dependence, looks: Explanation) -> str | None:
    """Return the known kind that describes the force as well as the chosen inputs; None if none.

    Both are Bayes factors against no force: a kind whose families need 20 to 1 is not mentioned.
    """
    if looks.kind not in _LOOKS:
        return None
    of_kind = looks.table.loc[looks.table["kind"] == looks.kind, "log_bayes"]
    return looks.kind if float(of_kind.max()) > found.best.log_bayes - 3.0 else None


def learned_words(
    learner: str | None,
    skill: tuple[float, float],
    rms: tuple[float, float],
    held_out: tuple[float, float] | None,
    *,
    learned: bool,
    carries: bool,
) -> str:
    """Return what was learned, without a claim beyond what was left out and predicted.

    Parameters
    ----------
    learner : str or None
        Name of the chosen one; None if none could be fitted.
    skill : (float, float)
        Share of left-out stretches that it predicts, and its standard error.
    rms, held_out : (float, float)
        Residual RMS before and after, sigmas; ``held_out`` is None without held-out arcs.
    learned, carries : bool
        The skill on left-out stretches, and the one on held-out arcs, are above zero by two
        standard errors.
    """
    if learner is None:
        return "Nothing could be learned that carries: no learner could be fitted to it."
    share = f"{100 * skill[0]:.1f} ± {100 * skill[1]:.1f} %"
    if not learned:
        return (
            "Nothing could be learned that carries: of stretches that were left out the best "
            f"model, {learner}, predicts {share} (0: no skill)."
        )
    text = (
        f"A model of it, {learner}, predicts {share} of stretches that were left out; in the orbit "
        f"it takes the residuals from {rms[0]:.3g} to {rms[1]:.3g} σ"
    )
    if held_out is None:
        return text + ". No arc is held out: whether it carries to another orbit is not known."
    change = f"from {held_out[0]:.3g} to {held_out[1]:.3g} σ"
    if carries:
        return f"{text} and the held-out error {change}."
    return f"{text}. It does not carry to the held-out arcs ({change}): use it on these days only."


def duration(seconds: float) -> str:
    """Return a time span in a unit that suits it.

    Examples
    --------
    >>> duration(35506.8), duration(6.48e6), duration(90.0)
    ('9.86 h', '75 d', '90 s')
    """
    for size, unit in ((2 * 86400.0, "d"), (7200.0, "h"), (120.0, "min")):
        if seconds >= size:
            whole = {"d": 86400.0, "h": 3600.0, "min": 60.0}[unit]
            return f"{seconds / whole:.3g} {unit}"
    return f"{seconds:.3g} s"


def _whose(period: float, revolution: float, spin: float) -> str:
    for whole, name in ((revolution, "revolution"), (spin, "turn of the body"), (86400.0, "day")):
        for k, word in ((1, "once"), (2, "twice"), (3, "three times")):
            if np.isfinite(whole) and abs(period * k / whole - 1) < _SAME:
                return f"{word} a {name}"
    return "a period of its own"
