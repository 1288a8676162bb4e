"""What `diagnose` answers, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import pandas as pd

from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = ["Diagnosis", "Estimate", "Finding", "Rival", "Step", "Verdict"]

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

    @property
    def class_names(self) -> tuple[str, ...]:
        """The finding and its rivals."""
        return (self.name, *(r.name for r in self.rivals))


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
    steps : tuple of Step
        The waterfall; the first is the model as given.
    noise : float
        Standard deviation of what is left, in stated sigmas: 2 says that the noise is twice what
        was stated.
    remainder_log10_p : float
        p-value of a free acceleration in what is left: small means that something remains.
    log_p_limit : float
        ln of the p-value that a candidate had to reach.
    candidates : DataFrame
        One row a candidate, first look: name, family, drop, log10_p, estimate, sigma, unit,
        smallest_detectable (by these data with 90 % power, for single parameters).
    further : DataFrame
        Which further data would tell classes apart: pair, data, correlation, probability.
    final_case : Case
        With what was found added.
    fit, final_fit : OrbitFit
        Before and after.
    whiteness : DataFrame
        Tests of the final residuals.
    seconds : float
        Wall time, compilation included.
    """

    case: Case = field(repr=False)
    verdict: Verdict
    findings: tuple[Finding, ...]
    steps: tuple[Step, ...]
    noise: float
    remainder_log10_p: float
    log_p_limit: float
    candidates: pd.DataFrame = field(repr=False)
    further: pd.DataFrame = field(repr=False)
    final_case: Case = field(repr=False)
    fit: OrbitFit = field(repr=False)
    final_fit: OrbitFit = field(repr=False)
    whiteness: pd.DataFrame = field(repr=False)
    seconds: float

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        if self.verdict == "nothing missing":
            return "Nothing is missing at this noise."
        if not self.findings:
            return "Something is missing that no effect of the catalogue explains."
        parts = []
        for f in self.findings:
            if f.rivals:
                others = ", ".join(r.title for r in f.rivals)
                parts.append(f"{f.title} (these data cannot tell it from: {others})")
            else:
                parts.append(f.title)
        text = "Missing: " + "; ".join(parts) + "."
        if self.verdict == "outside the catalogue":
            text += " Something else remains that no effect of the catalogue explains."
        return text

    def as_json(self) -> dict[str, Any]:
        """Return the answer as plain data; the schema is in docs/diagnose.md."""
        return {
            "case": self.case.name,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "found": [_finding(f) for f in self.findings],
            "residual_rms_before": self.steps[0].rms,
            "residual_rms_after": self.steps[-1].rms,
            "held_out_rms_before": self.steps[0].held_out_rms,
            "held_out_rms_after": self.steps[-1].held_out_rms,
            "noise": self.noise,
            "remainder_log10_p": self.remainder_log10_p,
            "waterfall": [vars(s) for s in self.steps],
            "whiteness": _records(self.whiteness),
            "smallest_detectable": _records(
                self.candidates[["name", "parameter", "smallest_detectable", "unit"]].dropna()
                if len(self.candidates)
                else self.candidates
            ),
            "further_data": _records(self.further),
            "seconds": self.seconds,
        }


def _finding(f: Finding) -> dict[str, Any]:
    return {
        "effect": f.name,
        "title": f.title,
        "family": f.family,
        "class": list(f.class_names),
        "parameters": [vars(e) for e in f.estimates],
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
