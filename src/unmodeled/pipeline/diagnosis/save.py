"""A diagnosis as files: the answer, its tables, the case as given and with what was found."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import pandas as pd

from unmodeled.core.provenance import Provenance, collect_provenance
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.cases.write_case import write_case
from unmodeled.pipeline.diagnosis.add_effect import Addition
from unmodeled.pipeline.diagnosis.next_case import moved, next_case, renamed
from unmodeled.pipeline.diagnosis.remainder_model import MODEL_FILE
from unmodeled.pipeline.diagnosis.result import Diagnosis
from unmodeled.pipeline.diagnosis.schema import as_text

__all__ = ["case_provenance", "final_source", "save_addition", "save_diagnosis"]


def save_diagnosis(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    case_folder: Path,
    provenance: Provenance | None = None,
    final_folder: Path | None = None,
    with_final_case: bool = False,
) -> None:
    """Write ``diagnosis.json``, the tables, the provenance and the case files into a folder.

    Parameters
    ----------
    diagnosis : Diagnosis
        What to save.
    folder : Path
        Exists.
    case_folder : Path
        Folder of the case file: names of measurement files start there.
    provenance : Provenance, optional
        Collected now if not given.
    final_folder : Path, optional
        Where the folder will lie in the end, if it is a staging folder.
    with_final_case : bool
        Write ``case-final.yaml`` too: the model with all that was found.
    """
    home = final_folder or folder
    (folder / "diagnosis.json").write_text(as_text("diagnose", diagnosis.as_json()) + "\n")
    _write_provenance(provenance or case_provenance(diagnosis.case), folder)
    diagnosis.candidates.to_csv(folder / "candidates.csv", index=False)
    if len(diagnosis.whiteness):
        diagnosis.whiteness.to_csv(folder / "whiteness.csv", index=False)
    residuals = diagnosis.fit.residuals.merge(
        diagnosis.final_fit.residuals[["residual", "used"]].add_suffix("_after"),
        left_index=True,
        right_index=True,
    )
    pd.DataFrame(residuals).to_parquet(folder / "residuals.parquet", index=False)
    if (rest := diagnosis.remainder) is not None:
        rest.accelerations().to_csv(folder / "remainder-acceleration.csv", index=False)
        if rest.model is not None:
            rest.model.save(folder / MODEL_FILE)
    if diagnosis.case.source:
        source = dict(diagnosis.case.source)
        write_case(moved(source, case_folder, home), folder / "case.yaml")
        if with_final_case:
            final = final_source(diagnosis)
            write_case(moved(final, case_folder, home), folder / "case-final.yaml")


def save_addition(addition: Addition, folder: Path) -> Provenance:
    """Write ``addition.json`` and the provenance, which is returned, into a folder."""
    (folder / "addition.json").write_text(as_text("add", addition.as_json()) + "\n")
    return _write_provenance(case_provenance(addition.case), folder)


def final_source(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the content of the case file with all that was found, paths as in the case."""
    return renamed(next_case(diagnosis.final_case, _found(diagnosis)), "final")


def case_provenance(case: Case) -> Provenance:
    """Record versions, host and time, with the hash of the case file's content."""
    text = json.dumps(dict(case.source), sort_keys=True, default=str)
    return collect_provenance(hashlib.sha256(text.encode()).hexdigest(), case.seed)


def _write_provenance(provenance: Provenance, folder: Path) -> Provenance:
    (folder / "provenance.json").write_text(json.dumps(provenance.as_dict(), indent=2) + "\n")
    return provenance


def _found(diagnosis: Diagnosis) -> list[Candidate]:
    by_name = {c.name: c for c in diagnosis.case.candidates}
    return [by_name[f.name] for f in diagnosis.findings]
