"""The yardstick of every report: the error of the bare known point mass on the same samples."""

from __future__ import annotations

from unmodeled.pipeline.use_check import point_mass_summaries

__all__ = ["point_mass_summaries"]
