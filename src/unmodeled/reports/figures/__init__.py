"""Figures of one characterisation, one a file; each returns a Matplotlib figure or None."""

from unmodeled.reports.figures.acceleration_curves import acceleration_curves
from unmodeled.reports.figures.calibration import calibration
from unmodeled.reports.figures.error_against_radius import error_against_radius
from unmodeled.reports.figures.error_summary import error_summary
from unmodeled.reports.figures.flight_error import flight_error
from unmodeled.reports.figures.trajectories import trajectories

__all__ = [
    "acceleration_curves",
    "calibration",
    "error_against_radius",
    "error_summary",
    "flight_error",
    "trajectories",
]
