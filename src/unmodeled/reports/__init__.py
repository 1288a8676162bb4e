"""Figures, tables, captions and the HTML page: everything a person looks at."""
