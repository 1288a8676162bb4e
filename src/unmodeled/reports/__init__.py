"""Figures, tables, captions and the HTML page: everything a person looks at."""

from unmodeled.reports.page import write_report
from unmodeled.reports.words import overview

__all__ = ["overview", "write_report"]
