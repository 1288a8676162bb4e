"""A fitted learner with its units: an acceleration field in SI that can be flown."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError
from unmodeled.core.units import NormalisedUnits
from unmodeled.models.learned import InputFeatures, Learner, load_learner, read_context

__all__ = ["LearnedField"]

_POSITION = InputFeatures()


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
    features : InputFeatures
        What the learner was trained on; a period of the phase is in normalised units.
    """

    learner: Learner
    units: NormalisedUnits
    frame: str = "inertial"
    features: InputFeatures = _POSITION

    def acceleration(
        self,
        positions: Array,
        velocities: Array | None = None,
        times: Array | None = None,
        sun_directions: Array | None = None,
    ) -> Array:
        """Return accelerations (n, 3), m/s2.

        Parameters
        ----------
        positions : ndarray (n, 3)
            m from the body's centre, along the axes of ``frame``.
        velocities : ndarray (n, 3), optional
            m/s, relative to inertial axes, components along the same; needed if they are an input.
        times : ndarray (n,), optional
            s since the epoch.
        sun_directions : ndarray (n, 3), optional
            Towards the Sun, of any length.

        Raises
        ------
        DataError
            If what an input needs is not given, or has another shape.
        """
        x = self._inputs(positions, velocities, times, sun_directions)
        return self.learner.predict(x) * self.units.acceleration

    def covariance(
        self,
        positions: Array,
        velocities: Array | None = None,
        times: Array | None = None,
        sun_directions: Array | None = None,
    ) -> Array:
        """Return covariances (n, 3, 3), (m/s2)^2; arguments as for `acceleration`."""
        x = self._inputs(positions, velocities, times, sun_directions)
        return self.learner.predict_covariance(x) * self.units.acceleration**2

    def jacobian(self, positions: Array) -> Array:
        """Return d acceleration / d position (n, 3, 3), 1/s2.

        Raises
        ------
        DataError
            If the learner depends on more than the position.
        """
        self.require_position_alone("jacobian")
        x = as_array(positions, ("n", 3), "positions")
        return self.learner.jacobian(x / self.units.length) / self.units.time**2

    def require_position_alone(self, what: str) -> None:
        """Refuse a learner that depends on more than the position.

        Raises
        ------
        DataError
            Naming its inputs.
        """
        if self.features.names != ("position",):
            raise DataError(
                f"{what} of a field learned from {', '.join(self.features.names)}",
                allowed="fields of the position alone",
                do="train one without other inputs, or use its acceleration",
            )

    def _inputs(
        self,
        positions: Array,
        velocities: Array | None,
        times: Array | None,
        sun_directions: Array | None,
    ) -> Array:
        x = as_array(positions, ("n", 3), "positions")
        return self.features.of(
            x / self.units.length,
            None if velocities is None else np.asarray(velocities) / self.units.velocity,
            None if times is None else np.asarray(times) / self.units.time,
            sun_directions,
        )

    def save(self, path: Path | str) -> None:
        """Write one ``.safetensors`` file; it holds numbers and names, no code."""
        context = {"length_m": self.units.length, "time_s": self.units.time, "frame": self.frame}
        beyond = self.features.names != ("position",)
        self.learner.save(path, context | (self.features.as_dict() if beyond else {}))

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
        features = InputFeatures.from_dict(context) if "inputs" in context else _POSITION
        return cls(load_learner(path), units, str(context["frame"]), features)
