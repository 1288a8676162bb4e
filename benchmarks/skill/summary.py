"""From runs to cells: medians and means over pairs of orbits, verdicts, and whether they hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from skill.fields import REGIONS
from skill.learners import ORACLE, REFERENCES
from skill.runner import NO_DATA
from unmodeled.pipeline.use_check import DO_NOT_USE, UNFIT_RATIO, UseCheck

__all__ = [
    "CELL",
    "SETS",
    "UseOfTable",
    "check_use",
    "is_candidate",
    "over_point_mass",
    "summarize_cells",
]

#: What a cell is.
CELL = ["field", "volume", "sigma_s", "sigma_a", "learner", "kind", "baseline"]
#: Where errors are counted.
SETS = ("interpolation", "extrapolation", *REGIONS)
_FLIGHTS = ("flight_1", "flight_10")
_SHARES = tuple(f"{s}_coverage_{k}" for s in ("interpolation", "extrapolation") for k in (68, 95))


def summarize_cells(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row a cell.

    ``SET_median`` is the median over the pairs of the median over the samples, ``SET_mean`` the
    mean over the pairs of the mean; a fit that failed counts as infinite, a pair of orbits that
    could not be made does not count. ``SET_point_mass`` is the median of the bare point mass on the
    same pairs. ``verdict`` is "do not use" where at least half of the runs' own reports say so
    (share ``flagged``), or where the cell's median on other orbits is more than twice the point
    mass's; ``worse_at`` names all sets where it is.

    Parameters
    ----------
    runs : DataFrame
        As `Opened.table` gives it.
    """
    table = runs[~runs["failure"].str.startswith(NO_DATA)]
    rows = [
        dict(zip(CELL, key, strict=True)) | _cell(own)
        for key, own in table.groupby(CELL, sort=False)
    ]
    cells = pd.DataFrame(rows)
    return cells.sort_values(["volume", "field", "sigma_s", "sigma_a"], kind="stable").reset_index(
        drop=True
    )


def over_point_mass(cells: pd.DataFrame) -> pd.DataFrame:
    """Return how each learner does against the bare point mass, over fields and noise.

    One row a volume and learner: ``cells``, median and worst of the ratio of the cells' medians on
    another orbit, and in how many cells it is above `UNFIT_RATIO` there, ``below`` and ``far``.
    """
    sets = ("extrapolation", "below", "far")
    ratios = {s: cells[f"{s}_median"] / cells[f"{s}_point_mass"] for s in sets}
    table = cells[["volume", "learner"]].assign(
        ratio=ratios["extrapolation"],
        **{f"worse: {s}": r > UNFIT_RATIO for s, r in ratios.items()},
    )
    groups = table.groupby(["volume", "learner"])
    found = (
        groups["ratio"]
        .agg(["size", "median", "max"])
        .set_axis(["cells", "median ratio", "worst ratio"], axis=1)
    )
    return found.join(groups[[f"worse: {s}" for s in sets]].sum()).sort_values(
        ["volume", "median ratio"], kind="stable"
    )


def is_candidate(learner: str, kind: str) -> bool:
    """Return False for the references: point masses and the oracle."""
    return learner != ORACLE and kind not in REFERENCES


def _cell(own: pd.DataFrame) -> dict[str, float | str]:
    failed = own["failure"] != ""
    row: dict[str, float | str] = {"pairs": len(own), "failures": int(failed.sum())}
    worse = []
    for name in SETS:
        medians, means = (
            own.get(f"{name}_{kind}", pd.Series(np.inf, own.index)).fillna(np.inf)
            for kind in ("median", "mean")
        )
        reference = own[f"{name}_point_mass"].median() if f"{name}_point_mass" in own else np.nan
        row[f"{name}_median"] = _middle(medians)
        row[f"{name}_mean"] = float(means.mean())
        row[f"{name}_point_mass"] = float(reference)
        if failed.all() or UseCheck(float(row[f"{name}_median"]), float(reference)).unfit:
            worse.append(name)
    flown = own[own["flight_radius"].notna()] if "flight_radius" in own else own[:0]
    row["flown"] = len(flown)
    for name in _FLIGHTS:
        # In Brillouin radii: fields differ in size.
        errors = flown[name] / flown["flight_radius"] if len(flown) else pd.Series(dtype=float)
        row[f"{name}_median"] = _middle(errors)
        row[f"{name}_mean"] = float(errors.mean()) if len(errors) else np.nan
    for name in _SHARES:
        row[name] = float(own[name].mean()) if name in own else np.nan
    nll = "extrapolation_negative_log_likelihood"
    row[nll] = _middle(own[nll].dropna()) if nll in own else np.nan
    for name in ("cost_train_s", "cost_evaluate_one_s", "cost_evaluate_batch_s_per_point"):
        row[name] = float(own[name].median()) if name in own else np.nan
    flagged = failed | (own.get("advice", pd.Series("", own.index)) == DO_NOT_USE)
    row["flagged"] = float(flagged.mean())
    if "training_advice" in flown and flown["training_advice"].notna().any():
        told = flown["training_advice"].dropna()
        row["flagged_by_training_check"] = float((told == DO_NOT_USE).mean())
    # A tie is no recommendation; nor is a median of all that the single runs did not see.
    most = 2 * flagged.sum() >= len(own)
    row["verdict"] = DO_NOT_USE if most or "extrapolation" in worse else "passes"
    row["worse_at"] = ", ".join(worse)
    return row


def _middle(values: pd.Series) -> float:
    """Return the median; never the mean of a number and infinity."""
    if not len(values):
        return float("nan")
    low, high = (float(np.quantile(values, 0.5, method=m)) for m in ("lower", "higher"))
    return high if np.isinf(high) else (low + high) / 2


@dataclass(frozen=True)
class UseOfTable:
    """Whether what is worse than twice the point mass says so itself.

    Parameters
    ----------
    runs, worse_runs, silent_runs : int
        Runs; those whose median error on other orbits is above twice the point mass's; and those
        of them whose own report does not say "do not use".
    cells, worse_cells, silent_cells : int
        The same for the medians of cells and their verdicts.
    split_cells : int
        Worse cells in which fewer than half of the runs' reports say so: the medians of the cell
        compare other pairs than each run's own ratio does.
    """

    runs: int
    worse_runs: int
    silent_runs: int
    cells: int
    worse_cells: int
    silent_cells: int
    split_cells: int

    @property
    def holds(self) -> bool:
        """True if none is silent."""
        return self.silent_runs == 0 and self.silent_cells == 0

    def sentence(self) -> str:
        """Return it in words."""
        return (
            f'"{DO_NOT_USE}" {"holds" if self.holds else "FAILS"}: of {self.runs} runs '
            f"{self.worse_runs} are worse than twice the bare point mass on other orbits, "
            f"{self.silent_runs} of them without saying so; of {self.cells} cells "
            f"{self.worse_cells}, {self.silent_cells} of them without saying so "
            f"({self.split_cells} say so by the median of the cell only)"
        )


def check_use(runs: pd.DataFrame, cells: pd.DataFrame) -> UseOfTable:
    """Compare numbers with verdicts, from the medians alone.

    Parameters
    ----------
    runs, cells : DataFrame
        Of `summarize_cells` and what it was made from.
    """
    fit = runs[runs["failure"] == ""]
    worse = fit["extrapolation_median"] > 2 * fit["extrapolation_point_mass"].clip(lower=1e-12)
    silent = worse & (fit["advice"] != DO_NOT_USE)
    bad = cells["extrapolation_median"] > 2 * cells["extrapolation_point_mass"].clip(lower=1e-12)
    quiet = bad & (cells["verdict"] != DO_NOT_USE)
    split = bad & (cells["flagged"] < 0.5)
    return UseOfTable(
        len(fit),
        int(worse.sum()),
        int(silent.sum()),
        len(cells),
        int(bad.sum()),
        int(quiet.sum()),
        int(split.sum()),
    )
