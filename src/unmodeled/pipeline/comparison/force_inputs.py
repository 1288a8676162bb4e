"""What a force may be a function of: sets of three inputs, and the axes that its parts lie in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.datasets.bodies import Body
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.comparison.orbit_geometry import (
    body_axes,
    orbit_geometry,
    sun_position,
)
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["ForceInputs", "input_sets"]

Kind = Literal["inertial", "body", "sun", "latitude", "speed", "time", "period"]
Axes = Literal["inertial", "body", "sun", "rtn"]
#: The Sun must turn by this much (rad), or its axes are inertial ones.
_TURNED = 0.2
#: A radius or speed that changes by less than this share is constant.
_NARROW = 2e-3


@dataclass(frozen=True)
class ForceInputs:
    """Three inputs of a force and the axes of its components.

    Parameters
    ----------
    kind : str
        "inertial", "body", "sun": position in these axes; "latitude": argument of latitude, as a
        point on the unit circle; "speed": radius and speed; "time"; "period": phase of a period.
    axes : str
        Of the components: "inertial", "body", "sun" (x towards the Sun, y in the xy plane of the
        inertial axes) or "rtn".
    centre, scale : tuple of float
        What is taken from the raw inputs, and what they are divided by: m, s, m/s.
    period : float
        s; of "period" only, counted from the epoch.
    """

    kind: Kind
    axes: Axes
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    period: float = 0.0

    @property
    def title(self) -> str:
        """On what the force depends, in words."""
        return {
            "inertial": "inertial position",
            "body": "body-fixed position",
            "sun": "position relative to the Sun",
            "latitude": "argument of latitude",
            "speed": "radius and speed",
            "time": "time",
            "period": "the phase of a period",
        }[self.kind]

    @property
    def names(self) -> tuple[str, ...]:
        """The inputs by name, for files and machines."""
        return {
            "inertial": ("x", "y", "z"),
            "body": ("x_body", "y_body", "z_body"),
            "sun": ("x_sun", "y_sun", "z_sun"),
            "latitude": ("cos_argument_of_latitude", "sin_argument_of_latitude"),
            "speed": ("radius", "speed"),
            "time": ("time",),
            "period": ("cos_phase", "sin_phase"),
        }[self.kind]

    @property
    def is_place(self) -> bool:
        """True if inputs and components share their axes: a field, which may have a curl."""
        return self.kind in ("inertial", "body", "sun")

    @property
    def circular(self) -> bool:
        """True if the inputs lie on the unit circle."""
        return self.kind in ("latitude", "period")

    def values(self, model: Dynamics, body: Body, states: Array, times: Array) -> Array:
        """Return the inputs (n, 3), dimensionless; those not used are zero.

        Parameters
        ----------
        model, body : Dynamics, Body
            Know how the body is turned and where the Sun is.
        states : ndarray (n, 6)
            Inertial, m and m/s.
        times : ndarray (n,)
            s since the epoch.
        """
        raw = np.zeros((len(states), 3))
        if self.is_place:
            turn = self.turn(model, body, states, times)
            raw = np.einsum("nij,nj->ni", turn, states[:, :3])
        elif self.kind == "speed":
            raw[:, 0] = np.linalg.norm(states[:, :3], axis=1)
            raw[:, 1] = np.linalg.norm(states[:, 3:], axis=1)
        elif self.kind == "time":
            raw[:, 0] = times
        else:
            if self.kind == "latitude":
                shape = orbit_geometry(model, body, states, times)
                angle = shape["argument_of_latitude"].to_numpy()
            else:
                angle = 2 * np.pi * times / self.period
            raw[:, 0], raw[:, 1] = np.cos(angle), np.sin(angle)
        scaled: Array = (raw - np.array(self.centre)) / np.array(self.scale)
        return scaled

    def turn(self, model: Dynamics, body: Body, states: Array, times: Array) -> Array:
        """Return own_from_inertial (n, 3, 3): rows are the axes of the components."""
        if self.axes == "rtn":
            return rtn_from_inertial(states)
        if self.axes == "body":
            return body_axes(model, times)
        if self.axes == "sun":
            sun = sun_position(model, body, times)
            assert sun is not None  # such a set is only made where the Sun is known
            return _sun_axes(sun)
        return np.broadcast_to(np.eye(3), (len(states), 3, 3))

    def as_plain(self) -> dict[str, Any]:
        """Return plain data from which ``ForceInputs(**data)`` makes it again."""
        return {**vars(self), "centre": list(self.centre), "scale": list(self.scale)}


def input_sets(lin: Linearisation) -> Iterator[ForceInputs]:
    """Yield the sets of inputs that differ for these arcs, the simplest first.

    Body-fixed position only where the model turns the body, the Sun only where it is known, is
    not the body and moves; radius and speed only where they change.

    Parameters
    ----------
    lin : Linearisation
        At the fit.
    """
    states = np.concatenate([a.partials.node_states for a in lin.arcs])
    times = np.concatenate([a.partials.nodes for a in lin.arcs])
    radius = np.linalg.norm(states[:, :3], axis=1)
    size = (float(np.median(radius)),) * 3
    turned = body_axes(lin.model, times)
    if np.ptp(turned, axis=0).max() > 0:
        yield ForceInputs("body", "body", scale=size)
    yield ForceInputs("inertial", "inertial", scale=size)
    sun = sun_position(lin.model, lin.case.body, times)
    if sun is not None and np.any(sun):
        towards = sun / np.linalg.norm(sun, axis=1, keepdims=True)
        cosine = np.clip(towards @ towards[0], -1, 1)
        if np.arccos(cosine.min()) > _TURNED:
            yield ForceInputs("sun", "sun", scale=size)
    yield ForceInputs("latitude", "rtn")
    speed = np.linalg.norm(states[:, 3:], axis=1)
    if np.ptp(radius) > _NARROW * radius.max():
        centre = (float(radius.mean()), float(speed.mean()), 0.0)
        yield ForceInputs("speed", "rtn", centre, (float(radius.std()), float(speed.std()), 1.0))
    yield replace(
        ForceInputs("time", "rtn"),
        centre=(float(times.mean()), 0.0, 0.0),
        scale=(float(np.ptp(times)), 1.0, 1.0),
    )


def _sun_axes(sun: Array) -> Array:
    """Rows: towards the Sun, across in the inertial xy plane, and their normal."""
    x = sun / np.linalg.norm(sun, axis=1, keepdims=True)
    y = np.stack([-x[:, 1], x[:, 0], np.zeros(len(x))], axis=1)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=1)
