"""Real orbits through `diagnose`: one known force left out after the other.

UNMODELED_DATA=../shared/real python benchmarks/real_data.py
UNMODELED_DATA=../shared/real python benchmarks/real_data.py --only moon srp
UNMODELED_DATA=../shared/real python benchmarks/real_data.py --days
UNMODELED_DATA=../shared/real python benchmarks/real_data.py --days --drop ocean_tide

Each rung is a case file less one line of its known model. The table says how far the fit is off
with all and without it, whether the effect is found (its place among the candidates at first look,
the class that the data cannot tell apart) and its estimate beside the accepted value. With --days
nothing is sought: each day of LAGEOS-2's week is fitted alone, with all or less what is dropped.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.cases.load_case import case_from_mapping
from unmodeled.pipeline.diagnosis.add_effect import add
from unmodeled.pipeline.diagnosis.diagnose import diagnose
from unmodeled.pipeline.diagnosis.result import Diagnosis
from unmodeled.pipeline.orbit_fit import OrbitFit, fit_orbits
from unmodeled.pipeline.yaml12 import read_yaml

ROOT = Path(__file__).parents[1]
DATA = Path(os.environ.get("UNMODELED_DATA", ROOT.parent / "shared" / "real"))
LAGEOS2, SPOT5 = "lageos2-three-days.yaml", "spot5-one-day.yaml"

#: Tides that are raised by another body.
RAISED = ("solid_tide", "fine_solid_tide", "ocean_tide")

Entry = dict[str, Any]


@dataclass(frozen=True)
class Rung:
    """One known effect left out of one case.

    Parameters
    ----------
    file : str
        Case file with everything in, or already without it.
    change : callable
        From an entry of ``known`` to the entries that replace it.
    effect : str or None
        Candidate that should be found; None: nothing is left out.
    accepted : float or None
        What its first parameter should come out as.
    """

    file: str
    change: Callable[[Entry], list[Entry]]
    effect: str | None = None
    accepted: float | None = None


def without(effect: str, body: str | None = None) -> Callable[[Entry], list[Entry]]:
    """Drop an entry; who does not know a body does not know its tides."""

    def change(entry: Entry) -> list[Entry]:
        gone = entry["effect"] == effect and entry.get("body") == body
        return [] if gone or (body and entry["effect"] in RAISED) else [entry]

    return change


def only_zonals(entry: Entry) -> list[Entry]:
    """Leave the tesserals out of a field."""
    return [entry | {"order": 0} if entry["effect"] == "spherical_harmonics" else entry]


RUNGS = {
    "everything": Rung(LAGEOS2, lambda entry: [entry]),
    "moon": Rung(LAGEOS2, without("third_body", "moon"), "third_body_moon", 4.902800118e12),
    "sun": Rung(LAGEOS2, without("third_body", "sun"), "third_body_sun", 1.3271244004e20),
    "solid tide": Rung(LAGEOS2, without("solid_tide"), "solid_tide", 0.30),
    "srp": Rung(LAGEOS2, without("srp"), "srp", 7.85e-4),
    "tesserals": Rung(LAGEOS2, only_zonals, "egm2008_tesserals_2_16", 1.0),
    "relativity": Rung(LAGEOS2, without("relativity"), "relativity", 1.0),
    "drag (SPOT-5)": Rung(SPOT5, lambda entry: [entry], "drag", None),
}


def load(rung: Rung) -> Case:
    """Return the case of a rung."""
    content: Mapping[str, Any] = read_yaml(ROOT / "cases" / rung.file)
    known = [new for entry in content["known"] for new in rung.change(entry)]
    return case_from_mapping({**content, "known": known}, ROOT / "cases", [DATA])


def rms(fit: OrbitFit) -> float:
    """Root mean square of the distance between orbit and measured positions, m."""
    used = fit.residuals[fit.residuals["used"]]
    return float(np.sqrt(3.0 * np.mean(used["residual"] ** 2)))


def row(name: str, rung: Rung, d: Diagnosis, seconds: float) -> dict[str, Any]:
    """Return one line of the table."""
    looked = d.candidates["name"].tolist()
    found = {f.name: f for f in d.findings}
    line: dict[str, Any] = {
        "left out": name,
        "rms without, m": rms(d.fit),
        "rms at the end, m": rms(d.final_fit),
        "held out without, sigma": d.steps[0].held_out_rms,
        "held out at the end, sigma": d.steps[-1].held_out_rms,
        "verdict": d.verdict,
        "found": ", ".join(found),
        "estimates": "; ".join(
            f"{e.name} = {e.value:.5g} +- {e.sigma:.2g} {e.unit}"
            for f in d.findings
            for e in f.estimates
        ),
        "noise, sigma": d.noise,
        "remainder, log10 p": d.remainder_log10_p,
        "seconds": seconds,
    }
    if rung.effect is None:
        return line
    first = d.candidates[d.candidates["name"] == rung.effect].iloc[0]
    line["rank"] = looked.index(rung.effect) + 1
    line["smallest detectable"] = first["smallest_detectable"]
    inside = [f for f in d.findings if rung.effect in f.class_names]
    if inside:
        line["class"] = ", ".join(inside[0].class_names)
    if inside:
        # Not named first but in the class: what it would be, if it is this.
        named = rung.effect in found
        e = (found[rung.effect] if named else add(d.case, rung.effect)).estimates[0]
        line |= {"estimate": e.value, "sigma": e.sigma, "unit": e.unit}
        if rung.accepted is not None:
            line["accepted"] = rung.accepted
            line["difference, %"] = 100.0 * (e.value / rung.accepted - 1.0)
    return line


def print_days(dropped: Sequence[str]) -> None:
    """Fit each day of a week of LAGEOS-2 alone; print how far it is off, cm."""
    case = load(Rung("lageos2.yaml", lambda e: [] if e["effect"] in dropped else [e]))
    print("without", ", ".join(dropped) or "nothing", "cm:", end="", flush=True)
    for arc in (*case.arcs, *case.held_out):
        off = 100.0 * rms(fit_orbits(case.dynamics, [arc], case.estimate))
        print(f" {off:.2f}", end="", flush=True)
    print()


def main() -> None:
    """Run the rungs, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(RUNGS), default=list(RUNGS))
    parser.add_argument("--days", action="store_true", help="fit the days of a week, no search")
    parser.add_argument("--drop", nargs="+", default=[], help="effects that --days leaves out")
    parser.add_argument("--out", type=Path, default=None, help="table, .csv")
    chosen = parser.parse_args()
    if chosen.days:
        print_days(chosen.drop)
        return
    lines = []
    for name in chosen.only:
        start = time.perf_counter()
        case = load(RUNGS[name])
        diagnosis = diagnose(case)
        lines.append(row(name, RUNGS[name], diagnosis, time.perf_counter() - start))
        print(f"{name}: {diagnosis.sentence}", flush=True)
        for finding in diagnosis.findings:
            for remark in finding.remarks:
                print(f"   {finding.name}: {remark}", flush=True)
        print(pd.Series(lines[-1]).to_string(), "\n", flush=True)
    if chosen.out:
        pd.DataFrame(lines).to_csv(chosen.out, index=False, float_format="%.6g")


if __name__ == "__main__":
    main()
