"""Figures, tables, captions and the HTML page: everything a person looks at."""

from unmodeled.reports.page import write_report

__all__ = ["write_report"]
