"""The results in words and numbers: every sentence follows from the results by a stated rule."""

from __future__ import annotations

import math
from dataclasses import dataclass

from unmodeled.pipeline.metrics import Calibration, ErrorSummary
from unmodeled.pipeline.results import CharacterizationResult, LearnerResult
from unmodeled.pipeline.use_check import UNFIT_RATIO, UseCheck, point_mass_summaries
from unmodeled.reports.data_words import data_sentences, elsewhere
from unmodeled.reports.numbers import number

__all__ = [
    "SAFE_RATIO",
    "UNFIT_RATIO",
    "Verdict",
    "calibration_sentence",
    "learner_sentence",
    "overview",
    "ranked",
    "summary_words",
    "verdict",
    "zonal_truth",
]

#: Safe: the interpolation median is at most this many times the training median ...
SAFE_RATIO = 3.0
#: Robust and moderately robust: at most this many decades from interpolation to extrapolation.
ROBUST_DECADES, MODERATE_DECADES = 0.5, 1.5
# A bare point mass within 5 % is no worse.
_NO_BETTER = 1 / 1.05
# Ratios of errors below this compare rounding with rounding.
_ROUNDING = 1e-12
# Kinds that know the answer's family or learn nothing: yardsticks, not candidates.
_YARDSTICKS = {"zonal_oracle": "knows the family of the simulated truth", "point_mass": ""}


@dataclass(frozen=True, slots=True)
class Verdict:
    """What three medians and the bare point mass say of a learner.

    Parameters
    ----------
    safety_ratio : float
        Interpolation median over training median.
    decades : float
        Decades from the interpolation to the extrapolation median.
    against_point_mass : float
        Extrapolation median over that of the bare point mass.
    safety, robustness : str
        In a word or two.
    unfit : bool
        True if it must not be used off its training orbit.
    """

    safety_ratio: float
    decades: float
    against_point_mass: float
    safety: str
    robustness: str
    unfit: bool


def verdict(summaries: dict[str, ErrorSummary], point_mass: dict[str, ErrorSummary]) -> Verdict:
    """Judge a learner.

    Safe: the interpolation error is at most 3 times the training error, both medians, and below
    that of the bare point mass on the same samples. Robust: at most half a decade is lost from
    interpolation to extrapolation (moderately: one and a half). Errors below 1e-12 count as 1e-12.

    Parameters
    ----------
    summaries, point_mass : dict of str to ErrorSummary
        Of the learner and of the bare point mass, on each set.
    """
    train, inside, outside = (
        max(summaries[name].median, _ROUNDING)
        for name in ("train", "interpolation", "extrapolation")
    )
    if math.isinf(inside):
        ratio, decades = math.inf, math.nan
    else:
        ratio, decades = inside / train, math.log10(outside / inside)
    # Rounding is compared with rounding here too, should the truth be a point mass.
    check = UseCheck(summaries["extrapolation"].median, point_mass["extrapolation"].median)
    against = check.ratio
    better_inside = inside < point_mass["interpolation"].median or inside <= _ROUNDING
    if ratio <= SAFE_RATIO and better_inside:
        safety = "safe"
    elif not better_inside:
        safety = "not safe"
    else:
        safety = "less safe"
    if decades <= ROBUST_DECADES:
        robustness = "robust"
    elif decades <= MODERATE_DECADES:
        robustness = "moderately robust"
    else:
        robustness = "not robust"
    return Verdict(ratio, decades, against, safety, robustness, check.unfit)


def learner_sentence(
    learner: LearnerResult,
    point_mass: dict[str, ErrorSummary],
    where: str = "on other orbits",
    *,
    simulated: bool = True,
) -> str:
    """Return what was found of one learner.

    Parameters
    ----------
    learner : LearnerResult
        Its label is used as it is; escape the sentence for HTML.
    point_mass : dict of str to ErrorSummary
        Errors of the bare point mass on the same sets.
    where : str
        What extrapolation is: "on other orbits", "on another orbit" or "on later revolutions".
    simulated : bool
        True if the truth is a simulated zonal field; of others no learner knows the family.
    """
    if learner.failure:
        return f"{learner.label}: the fit failed ({learner.failure.rstrip('.')}); nothing to judge."
    s = learner.summaries
    inside, outside = number(s["interpolation"].median), number(s["extrapolation"].median)
    if learner.kind == "point_mass":
        return (
            f"{learner.label}: the yardstick; it learns nothing. Median error {inside} on the "
            f"training orbit, {outside} {where}."
        )
    v = verdict(s, point_mass)
    known = _YARDSTICKS.get(learner.kind, "") if simulated else ""
    role = f" ({known}: a bound, not a candidate)" if known else ""
    only = "only " if v.robustness == "moderately robust" else ""
    joint = ("and" if (v.safety == "safe") == (v.robustness == "robust") else "but") + f" {only}"
    # "Robust" compares a learner with itself; the point mass says whether it is any use.
    turn = "and" if (v.robustness == "robust") == (v.against_point_mass < _NO_BETTER) else "yet"
    text = (
        f"{learner.label}{role}: {v.safety} on its own orbit (interpolation median {inside}, "
        f"{_training(v, s)}) {joint}{v.robustness}: {where} {outside}{_loss(v)}, {turn} "
        f"{_against(v.against_point_mass)}."
    )
    if v.unfit:
        reference = number(point_mass["extrapolation"].median)
        text += (
            f" Do not use it off its training orbit: the bare point mass, which learns nothing, "
            f"has {reference} {where}."
        )
    return text + _failures(s)


def zonal_truth(result: CharacterizationResult) -> bool:
    """Return whether the truth is a simulated zonal field, whose family the oracle knows."""
    data = result.config.data
    return data.simulated and data.field is None and data.effects is None


def _training(v: Verdict, s: dict[str, ErrorSummary]) -> str:
    if s["train"].median == 0:
        return "though it repeats its training samples exactly"
    if s["interpolation"].median <= _ROUNDING and s["train"].median <= _ROUNDING:
        return "like the training error at rounding level"
    return f"{number(v.safety_ratio)} times the training error"


def _loss(v: Verdict) -> str:
    if math.isnan(v.decades) or math.isinf(v.decades):
        return ""
    if abs(v.decades) < 0.05:
        return ", no worse"
    word = "worse" if v.decades > 0 else "better"
    return f", {abs(v.decades):.1f} decades {word}"


def _against(ratio: float) -> str:
    if math.isinf(ratio):
        return "without a finite error to compare with a bare point mass"
    if ratio > 1 / _NO_BETTER:
        return f"{number(ratio)} times worse than a bare point mass"
    if ratio < _NO_BETTER:
        return f"{number(1 / ratio)} times better than a bare point mass"
    return "no better than a bare point mass"


def _failures(summaries: dict[str, ErrorSummary]) -> str:
    bad = sum(s.failures for s in summaries.values())
    if not bad:
        return ""
    count = sum(s.count for s in summaries.values())
    return f" {bad} of its {count} predictions are not finite."


def calibration_sentence(
    label: str, calibrations: dict[str, Calibration], counts: dict[str, int]
) -> str:
    """Return whether the predicted uncertainty can be believed off the training orbit.

    Over-confident if the 68 % or the 95 % interval holds less than 58 % or 90 % of the components
    (more slack where samples are few: two binomial standard errors), cautious if the 68 %
    interval holds more than 78 %.

    Parameters
    ----------
    label : str
        Of the learner.
    calibrations : dict of str to Calibration
        Of each set.
    counts : dict of str to int
        Samples in each set.
    """
    words = []
    for name in ("interpolation", "extrapolation"):
        c = calibrations[name]
        word = _calibrated(c, counts[name])
        words.append(
            f"{word} in {name} ({counts[name]} samples: {100 * c.coverage_68:.0f} % and "
            f"{100 * c.coverage_95:.0f} % of the components lie in the 68 % and 95 % intervals)"
        )
    return f"{label}: its predicted uncertainty is {words[0]} and {words[1]}."


def _calibrated(c: Calibration, count: int) -> str:
    # Components of a sample are not independent, so samples are counted, not components.
    slack_68, slack_95 = (2 * math.sqrt(p * (1 - p) / count) for p in (0.683, 0.95))
    if c.coverage_68 < 0.583 - slack_68 or c.coverage_95 < 0.90 - slack_95:
        return "over-confident"
    return "cautious" if c.coverage_68 > 0.783 + slack_68 else "well calibrated"


def overview(result: CharacterizationResult) -> str:
    """Return the answer in one or two sentences: the most robust learner, and how many to avoid."""
    point_mass = point_mass_summaries(result.data)
    yardsticks = _YARDSTICKS if zonal_truth(result) else {"point_mass"}
    candidates = [r for r in result.learners if r.summaries and r.kind not in yardsticks]
    where = elsewhere(result)
    if not candidates:
        return "No learner was fitted that could be judged against the yardsticks."
    best = min(candidates, key=lambda r: r.summaries["extrapolation"].median)
    ratio = verdict(best.summaries, point_mass).against_point_mass
    text = (
        f"Of {len(candidates)} learner{'s' if len(candidates) > 1 else ''}, {best.label} is the "
        f"most accurate {where} (median fractional error "
        f"{number(best.summaries['extrapolation'].median)}, {_against(ratio)})."
    )
    if ratio >= _NO_BETTER:
        text += f" No learner beats the bare point mass {where}."
    unfit = [r for r in candidates if verdict(r.summaries, point_mass).unfit]
    if unfit:
        text += (
            f" Do not use {len(unfit)} of {len(candidates)} off the training orbit: more "
            f"than {UNFIT_RATIO:g} times worse than a bare point mass there."
        )
    return text


def ranked(result: CharacterizationResult) -> list[LearnerResult]:
    """Return the learners by extrapolation median, the most robust first, failed ones last."""
    return sorted(
        result.learners,
        key=lambda r: r.summaries["extrapolation"].median if r.summaries else math.inf,
    )


def summary_words(result: CharacterizationResult) -> list[str]:
    """Return all sentences: the overview, one a learner, calibration, data, noise.

    Parameters
    ----------
    result : CharacterizationResult
        What they are about. Labels in them are the user's words: escape them for HTML.
    """
    point_mass = point_mass_summaries(result.data)
    where = elsewhere(result)
    counts = {s.name: len(s) for s in result.data.sets}
    return [
        overview(result),
        *(
            learner_sentence(r, point_mass, where, simulated=zonal_truth(result))
            for r in ranked(result)
        ),
        *(
            calibration_sentence(r.label, r.calibrations, counts)
            for r in ranked(result)
            if r.calibrations
        ),
        *data_sentences(result),
    ]
