"""A comparison as files: the answer, the residuals with their geometry, the provenance."""

from __future__ import annotations

import json
from pathlib import Path

from unmodeled.core.provenance import Provenance
from unmodeled.pipeline.comparison.result import Comparison
from unmodeled.pipeline.comparison.schema import ComparisonJson

__all__ = ["comparison_text", "save_comparison"]


def comparison_text(comparison: Comparison) -> str:
    """Return the JSON text of an answer, checked against its schema."""
    return ComparisonJson.model_validate(comparison.as_json()).model_dump_json(indent=2)


def save_comparison(comparison: Comparison, folder: Path, provenance: Provenance) -> None:
    """Write ``comparison.json``, ``residuals.parquet`` and the provenance into a folder."""
    (folder / "comparison.json").write_text(comparison_text(comparison) + "\n")
    (folder / "provenance.json").write_text(json.dumps(provenance.as_dict(), indent=2) + "\n")
    comparison.residuals.to_parquet(folder / "residuals.parquet", index=False)
