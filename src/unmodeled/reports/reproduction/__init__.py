"""Figures of a source paper drawn again, with the paper's statements beside ours."""
