"""A fitted learner with its units: an acceleration field in SI that can be flown."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError
from unmodeled.core.units import NormalisedUnits
from unmodeled.models.learned import Learner, load_learner, read_context

__all__ = ["LearnedField"]


@dataclass(frozen=True)
class LearnedField:
    """Acceleration about one body, learned from a trajectory.

    Parameters
    ----------
    learner : Learner
        Fitted, in normalised units.
    units : NormalisedUnits
        What one unit is in SI.
    frame : str
        Axes of positions and accelerations.
    """

    learner: Learner
    units: NormalisedUnits
    frame: str = "inertial"

    def acceleration(self, positions: Array) -> Array:
        """Return accelerations (n, 3), m/s2, at positions (n, 3), m from the body's centre."""
        x = as_array(positions, ("n", 3), "positions")
        return self.learner.predict(x / self.units.length) * self.units.acceleration

    def covariance(self, positions: Array) -> Array:
        """Return covariances (n, 3, 3), (m/s2)^2; see `Learner.predict_covariance`."""
        x = as_array(positions, ("n", 3), "positions")
        return self.learner.predict_covariance(x / self.units.length) * self.units.acceleration**2

    def jacobian(self, positions: Array) -> Array:
        """Return d acceleration / d position (n, 3, 3), 1/s2."""
        x = as_array(positions, ("n", 3), "positions")
        return self.learner.jacobian(x / self.units.length) / self.units.time**2

    def save(self, path: Path | str) -> None:
        """Write one ``.safetensors`` file; it holds numbers and names, no code."""
        self.learner.save(
            path,
            {"length_m": self.units.length, "time_s": self.units.time, "frame": self.frame},
        )

    @classmethod
    def load(cls, path: Path | str) -> LearnedField:
        """Read what `save` wrote.

        Raises
        ------
        DataError
            If the file is missing or damaged, or was saved without units.
        """
        context = read_context(path)
        if not {"length_m", "time_s", "frame"} <= set(context):
            raise DataError(
                f"{path} holds a learner without units",
                do="save it with LearnedField.save, which keeps length and time",
            )
        units = NormalisedUnits(float(context["length_m"]), float(context["time_s"]))
        return cls(load_learner(path), units, str(context["frame"]))
