"""What `diagnose` answers, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import pandas as pd

from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.remainder_model import RemainderModel
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = [
    "Alternative",
    "Diagnosis",
    "Dismissed",
    "Estimate",
    "Finding",
    "Forecast",
    "Rival",
    "Step",
    "Verdict",
]

#: Pulls below this agree with an accepted value.
_AGREES = 4.0
#: Rivals of a finding, and effects of other sets, that a sentence names; the rest is counted.
_NAMED = 3
_NAMED_IN_SETS = 4

Verdict = Literal["found", "ambiguous", "outside the catalogue", "nothing missing"]


@dataclass(frozen=True)
class Estimate:
    """One estimated parameter: its value, standard deviation and unit.

    ``sigma`` is with the noise as found (`Diagnosis.noise`); ``pull`` is the distance from the
    accepted value in standard deviations of both, None if no value is accepted; ``expected`` is
    the size that was expected before looking.
    """

    name: str
    value: float
    sigma: float
    unit: str
    expected: float
    accepted: float | None = None
    pull: float | None = None


@dataclass(frozen=True)
class Rival:
    """Another effect that explains the same residuals nearly as well.

    ``correlation`` is the cosine between what is left of both signals after the fit; ``odds`` the
    Bayes factor of the finding against it; ``probability`` the chance to tell the two apart with
    these data, Phi(sqrt(lambda (1 - rho) / 2)).
    """

    name: str
    title: str
    correlation: float
    odds: float
    probability: float


@dataclass(frozen=True)
class Finding:
    """One effect that is missing.

    Parameters
    ----------
    name, title, family : str
        Of the candidate.
    estimates : tuple of Estimate
        Of its parameters.
    drop : float
        By how much chi-square rises without it (stated sigmas).
    threshold : float
        What the drop had to exceed.
    log10_p : float
        Of the F-test, one candidate; the threshold accounts for their number.
    evidence : float
        ln of the Bayes factor for it beside the others found.
    rivals : tuple of Rival
        With it, the class of effects that these data cannot tell apart.
    confidence : float
        Probability that the label is right within the class; never above what the correlation of
        the signals allows.
    consistency_p : float or None
        p-value of the agreement of the estimates of the arcs (Q test); None for one arc.
    largest_change : float
        Largest change of an estimate when one twelfth of the time is left out, in its own sigmas.
    remarks : tuple of str
        What speaks against the label, and what the estimate is known as.
    place : tuple of Estimate
        Where or when it acts, for an effect that was searched over places or times.
    """

    name: str
    title: str
    family: str
    estimates: tuple[Estimate, ...]
    drop: float
    threshold: float
    log10_p: float
    evidence: float
    rivals: tuple[Rival, ...]
    confidence: float
    consistency_p: float | None
    largest_change: float
    remarks: tuple[str, ...] = ()
    place: tuple[Estimate, ...] = ()

    @property
    def is_as_accepted(self) -> bool:
        """True if its parameters have accepted values, and agree with them within 4 sigma."""
        pulls = [e.pull for e in self.estimates if e.pull is not None]
        return bool(pulls) and max(abs(p) for p in pulls) < _AGREES

    @property
    def class_names(self) -> tuple[str, ...]:
        """The finding and its rivals."""
        return (self.name, *(r.name for r in self.rivals))

    @property
    def rivals_text(self) -> str:
        """Titles of the first rivals, and how many more there are."""
        named = "; ".join(r.title for r in self.rivals[:_NAMED])
        left = len(self.rivals) - _NAMED
        return f"{named}; and {left} more" if left > 0 else named


@dataclass(frozen=True)
class Alternative:
    """Another set of effects, in place of all findings together, that these data cannot exclude.

    ``odds`` is the Bayes factor of the findings against it, ``drop`` by how much chi-square falls
    with it (stated sigmas).
    """

    effects: tuple[str, ...]
    titles: tuple[str, ...]
    odds: float
    drop: float


@dataclass(frozen=True)
class Dismissed:
    """An effect that passes the threshold of white noise but not under residuals as coloured.

    ``drop`` is what it would explain of chi-square; ``strength`` its significance in sigmas if
    only whole stretches of time are independent.
    """

    name: str
    title: str
    drop: float
    strength: float


@dataclass(frozen=True)
class Forecast:
    """What the residual RMS of the held-out arcs should be, in stated sigmas.

    ``before`` is without what was found, if the estimates are right; ``after`` with it, from the
    noise as found and the covariance of the estimates; ``log10_p`` is the chance that they come
    out as large as they did, if the model and its covariance are right.
    """

    before: float
    after: float
    log10_p: float


@dataclass(frozen=True)
class Step:
    """One bar of the waterfall: normalised residual RMS after an addition."""

    added: str
    rms: float
    held_out_rms: float | None


@dataclass(frozen=True)
class Diagnosis:
    """The answer.

    Parameters
    ----------
    case : Case
        As given.
    verdict : str
        "found", "ambiguous", "outside the catalogue", "nothing missing".
    findings : tuple of Finding
        In the order of their share of chi-square.
    alternatives : tuple of Alternative
        Other sets that explain as much, beyond exchanging a finding by one of its rivals.
    dismissed : tuple of Dismissed
        What was found and taken out again, because what remains is not white.
    steps : tuple of Step
        The waterfall; the first is the model as given.
    noise : float
        Standard deviation of what is left, in stated sigmas: 2 says that the noise is twice what
        was stated.
    remainder_log10_p : float
        p-value of a free acceleration in what is left: small means that something remains.
    imitation : bool
        True: so many effects at once are less likely than one force that the catalogue lacks and
        that they imitate together; the verdict is then "outside the catalogue".
    within_stated_noise : bool
        True: what is left is not white, but the noise as stated covers it; a force and slow errors
        of the measurements cannot be told apart.
    log_p_limit : float
        ln of the p-value that a candidate had to reach.
    candidates : DataFrame
        One row a candidate, first look: name, family, drop, log10_p, estimate, sigma, unit,
        smallest_detectable (by these data with 90 % power, for single parameters).
    further : DataFrame
        Which further data would tell classes apart: pair, data, correlation, probability.
    forecast : Forecast or None
        What the held-out arcs should show; None without any.
    final_case : Case
        With what was found added.
    fit, final_fit : OrbitFit
        Before and after.
    whiteness : DataFrame
        Tests of the final residuals.
    remainder : RemainderModel or None
        Kind and learned model of what no effect explains; only if the verdict is "outside the
        catalogue".
    seconds : float
        Wall time, compilation included.
    """

    case: Case = field(repr=False)
    verdict: Verdict
    findings: tuple[Finding, ...]
    alternatives: tuple[Alternative, ...]
    dismissed: tuple[Dismissed, ...]
    steps: tuple[Step, ...]
    noise: float
    remainder_log10_p: float
    imitation: bool
    within_stated_noise: bool
    log_p_limit: float
    candidates: pd.DataFrame = field(repr=False)
    further: pd.DataFrame = field(repr=False)
    forecast: Forecast | None
    final_case: Case = field(repr=False)
    fit: OrbitFit = field(repr=False)
    final_fit: OrbitFit = field(repr=False)
    whiteness: pd.DataFrame = field(repr=False)
    seconds: float
    remainder: RemainderModel | None = field(default=None, repr=False)

    @property
    def sentence(self) -> str:
        """The verdict in a few sentences."""
        left = ""
        if self.verdict == "outside the catalogue" and self.findings:
            left = " Something else remains that no effect of the catalogue explains."
        elif self.within_stated_noise:
            left = " What remains is not white, but the stated noise covers it."
        if self.verdict == "nothing missing":
            return f"Nothing is missing at this noise.{left}"
        rest = f" {self.remainder.sentence}" if self.remainder is not None else ""
        if not self.findings:
            return f"Something is missing that no effect of the catalogue explains.{rest}"
        if self.imitation:
            names = ", ".join(f.title for f in self.findings)
            return (
                "Something is missing that the catalogue seems to lack: it takes "
                f"{len(self.findings)} of its effects together to imitate it ({names}).{rest}"
            )
        parts = []
        for f in self.findings:
            others = f" (these data cannot tell it from: {f.rivals_text})" if f.rivals else ""
            parts.append(f.title + others)
        return "Missing: " + "; ".join(parts) + "." + self._other_sets() + left + rest

    def _other_sets(self) -> str:
        """Name other sets that fit as well while they are short; count the rest."""
        count = len(self.alternatives)
        if not count:
            return ""
        if len(self.alternatives[0].titles) > _NAMED_IN_SETS:
            sets = "one other set" if count == 1 else f"{count} other sets"
            return f" In place of all of this {sets} of effects would fit as well."
        named: list[str] = []
        effects = 0
        for a in self.alternatives:
            effects += len(a.titles)
            if effects > _NAMED_IN_SETS:
                break
            named.append(" + ".join(a.titles))
        more = f"; or one of {count - len(named)} more sets" if count > len(named) else ""
        return f" In place of all of this would fit as well: {'; or '.join(named)}{more}."

    def as_json(self) -> dict[str, Any]:
        """Return the answer as plain data; the schema is in docs/diagnose.md."""
        return {
            "case": self.case.name,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "found": [_finding(f) for f in self.findings],
            "alternatives": [
                {
                    "effects": list(a.effects),
                    "titles": list(a.titles),
                    "odds": a.odds,
                    "delta_chi_square": a.drop,
                }
                for a in self.alternatives
            ],
            "dismissed": [
                {
                    "effect": d.name,
                    "title": d.title,
                    "delta_chi_square": d.drop,
                    "strength_in_sigmas": d.strength,
                }
                for d in self.dismissed
            ],
            "residual_rms_before": self.steps[0].rms,
            "residual_rms_after": self.steps[-1].rms,
            "held_out_rms_before": self.steps[0].held_out_rms,
            "held_out_rms_after": self.steps[-1].held_out_rms,
            "held_out_forecast": vars(self.forecast) if self.forecast else None,
            "noise": self.noise,
            "remainder_log10_p": self.remainder_log10_p,
            "imitation": self.imitation,
            "within_stated_noise": self.within_stated_noise,
            "waterfall": [vars(s) for s in self.steps],
            "whiteness": _records(self.whiteness),
            "smallest_detectable": _records(
                self.candidates[["name", "parameter", "smallest_detectable", "unit"]].dropna()
                if len(self.candidates)
                else self.candidates
            ),
            "further_data": _records(self.further),
            "remainder": self.remainder.as_json() if self.remainder is not None else None,
            "seconds": self.seconds,
        }


def _finding(f: Finding) -> dict[str, Any]:
    return {
        "effect": f.name,
        "title": f.title,
        "family": f.family,
        "class": list(f.class_names),
        "parameters": [vars(e) for e in f.estimates],
        "place": [vars(e) for e in f.place],
        "delta_chi_square": f.drop,
        "threshold": f.threshold,
        "log10_p": f.log10_p,
        "ln_evidence": f.evidence,
        "confidence": f.confidence,
        "rivals": [vars(r) for r in f.rivals],
        "consistency_p": f.consistency_p,
        "largest_change_in_sigmas": f.largest_change,
        "remarks": list(f.remarks),
    }


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [
        {str(k): (None if pd.isna(v) else v) for k, v in row.items()}
        for row in table.to_dict(orient="records")
    ]
