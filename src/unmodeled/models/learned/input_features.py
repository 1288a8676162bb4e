"""Inputs beyond the position: velocity, Sun, phase and time, with names and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, nearest
from unmodeled.core.frames import rtn_from_inertial, turned

__all__ = ["FEATURES", "InputFeatures"]

#: Columns and their units, by feature; lengths and times are those of the samples.
FEATURES: Mapping[str, tuple[tuple[str, str], ...]] = MappingProxyType(
    {
        "position": (("x", "length"), ("y", "length"), ("z", "length")),
        "velocity": (("vx", "length/time"), ("vy", "length/time"), ("vz", "length/time")),
        "velocity_rtn": (("v_radial", "length/time"), ("v_transverse", "length/time")),
        "sun_direction": (("sun_x", "1"), ("sun_y", "1"), ("sun_z", "1")),
        "sun_cosine": (("sun_cosine", "1"),),
        "phase": (("phase_sin", "1"), ("phase_cos", "1")),
        "time": (("time", "time"),),
    }
)


@dataclass(frozen=True)
class InputFeatures:
    """Which inputs a learner sees, and how they are made.

    The array starts with the position, whatever is declared, so that a point mass can be taken
    off; accelerations are components along the same axes.  Learners with ``takes_features`` accept
    it; those that are gravity fields refuse.

    ==============  ==========================================================================
    position        along the axes of the samples, or body-fixed, see ``of``
    velocity        inertial velocity along the axes of the position: drag follows it
    velocity_rtn    its radial and transverse components (the normal one is zero): they do not say
                    where the transverse axis points, so that drag on other orbits needs velocity
    sun_direction   unit vector to the Sun along the axes of the position
    sun_cosine      cosine of the angle at the centre between position and Sun: below zero is the
                    night side
    phase           sine and cosine of 2 pi t / ``period``
    time            t
    ==============  ==========================================================================

    Parameters
    ----------
    names : sequence of str
        Of `FEATURES`, each once; ``position`` first.
    period : float, optional
        Of ``phase``, in the unit of the times.

    Examples
    --------
    >>> features = InputFeatures(("position", "sun_cosine"))
    >>> features.columns
    ('x', 'y', 'z', 'sun_cosine')
    >>> features.of([[2.0, 0.0, 0.0]], sun_directions=[[0.6, 0.8, 0.0]])
    array([[2. , 0. , 0. , 0.6]])
    """

    names: tuple[str, ...] = ("position",)
    period: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        for name in self.names:
            if name not in FEATURES:
                raise ConfigError(f'unknown input "{name}"', do=nearest(name, FEATURES))
            if self.names.count(name) > 1:
                raise ConfigError(f'input "{name}" is declared twice', allowed="each once")
        if self.names[:1] != ("position",):
            raise ConfigError(
                f"the inputs are {', '.join(self.names) or 'none'}",
                allowed="position first, then the others",
            )
        phase = "phase" in self.names
        if phase and not (self.period and np.isfinite(self.period) and self.period > 0):
            raise ConfigError(f"input phase with a period of {self.period}", allowed="a period > 0")
        if self.period is not None and not phase:
            raise ConfigError(
                f"a period of {self.period} without the input phase", do="declare phase too"
            )

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of `of`."""
        return tuple(column for name in self.names for column, _ in FEATURES[name])

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the columns: ``length``, ``time``, ``length/time`` of the samples, or ``1``."""
        return tuple(unit for name in self.names for _, unit in FEATURES[name])

    def of(
        self,
        positions: Array | Sequence[Sequence[float]],
        velocities: Array | None = None,
        times: Array | None = None,
        sun_directions: Array | Sequence[Sequence[float]] | None = None,
        axes: Array | None = None,
    ) -> Array:
        """Return the inputs (n, d).

        Parameters
        ----------
        positions, velocities : array_like (n, 3)
            Inertial axes.
        times : array_like (n,)
            Since the epoch.
        sun_directions : array_like (n, 3)
            From the centre to the Sun, inertial axes, of any length.
        axes : array_like (n, 3, 3), optional
            Rotation from inertial axes to those wanted, e.g. `frames.body_fixed_from_inertial`: all
            vectors are turned. Turn the accelerations likewise.

        Raises
        ------
        DataError
            If what an input needs is not given, or has another shape.
        """
        x = as_array(positions, ("n", 3), "positions")
        needed = {
            "velocity": ("velocities", velocities, ("n", 3)),
            "velocity_rtn": ("velocities", velocities, ("n", 3)),
            "sun_direction": ("sun_directions", sun_directions, ("n", 3)),
            "sun_cosine": ("sun_directions", sun_directions, ("n", 3)),
            "phase": ("times", times, ("n",)),
            "time": ("times", times, ("n",)),
        }
        turn = None if axes is None else as_array(axes, (len(x), 3, 3), "axes")

        def along_axes(vectors: Array) -> Array:
            return vectors if turn is None else turned(turn, vectors)

        blocks = [along_axes(x)]
        for name in self.names[1:]:
            label, given, shape = needed[name]
            if given is None:
                raise DataError(f"input {name} without {label}", do=f"give {label} too")
            values = as_array(given, (len(x), *shape[1:]), label)
            if name.startswith("sun"):
                size = np.linalg.norm(values, axis=1, keepdims=True)
                if np.any(size == 0.0):
                    raise DataError(
                        f"sun_directions has length zero at sample {int(np.argmin(size))}",
                        allowed="vectors to the Sun",
                    )
                values = values / size
            if name == "velocity_rtn":
                rotation = rtn_from_inertial(np.hstack([x, values]))
                blocks.append(turned(rotation, values)[:, :2])
            elif name == "sun_cosine":
                along = (values * x).sum(axis=1) / np.linalg.norm(x, axis=1)
                blocks.append(along[:, None])
            elif name == "phase":
                angle = 2 * np.pi * values / float(self.period or 1.0)
                blocks.append(np.column_stack([np.sin(angle), np.cos(angle)]))
            elif name == "time":
                blocks.append(values[:, None])
            else:
                blocks.append(along_axes(values))
        return np.ascontiguousarray(np.hstack(blocks))

    def as_dict(self) -> dict[str, Any]:
        """Return plain data, e.g. for the context of ``Learner.save``."""
        return {"inputs": list(self.names), "period": self.period}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Take back what `as_dict` returned."""
        return cls(tuple(content["inputs"]), content["period"])
