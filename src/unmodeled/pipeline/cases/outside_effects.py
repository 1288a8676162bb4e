"""Forces that no catalogue has: what a diagnosis must not call by a name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from heyoka import expression, sin, sqrt

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, cross, dot
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case

#: Family of what no catalogue has.
OUTSIDE = "outside"

__all__ = ["OUTSIDE", "PulseTrain", "Whirl", "outside_effects"]


@dataclass(frozen=True)
class PulseTrain(Effect):
    r"""Pushes in one inertial direction that come again and again.

    .. math::
        \mathbf a = \frac{\mathbf b}{1 + k \sin^2(\pi t / P)}, \qquad k = 24

    Smooth; a fifth of the period wide. With a period that is no multiple of the orbit's, of the
    body's spin or of a day, nothing in nature looks like it. Parameters: ``pulse_a_x``, ``_y``,
    ``_z`` (b) and ``pulse_period``.
    """

    name: ClassVar[str] = "pulse_train"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Peak acceleration and period."""
        return (
            *(
                Parameter(f"pulse_a_{k}", unit="m s-2", scale=1e-9, description=f"peak, {k} part")
                for k in "xyz"
            ),
            Parameter("pulse_period", unit="s", value=1.0, lower=1e-6, description="period"),
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the push."""
        wave = sin(np.pi * s.time / s["pulse_period"])
        level = 1.0 / (1.0 + 24.0 * wave * wave)
        x, y, z = (level * s[f"pulse_a_{k}"] for k in "xyz")
        return x, y, z


@dataclass(frozen=True)
class Whirl(Effect):
    r"""A force about an axis, strong near one place in inertial space, with curl.

    .. math::
        \mathbf a = k\, \frac{\mathbf e \times \mathbf r}{c}
        \left(1 + \frac{|\mathbf r - \mathbf c|^2}{w^2}\right)^{-2}, \qquad w = c / 3, \quad
        \mathbf e = (1, 1, 1) / \sqrt 3

    Parameters: ``whirl_k`` (m/s2) and the place c, ``whirl_x``, ``whirl_y``, ``whirl_z``. It is
    neither gravity (it has curl) nor does it act along the orbit's own axes.
    """

    name: ClassVar[str] = "whirl"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Strength and place."""
        return (
            Parameter("whirl_k", unit="m s-2", scale=1e-9, description="strength"),
            *(
                Parameter(f"whirl_{k}", unit="m", value=1.0, description=f"{k} of the place")
                for k in "xyz"
            ),
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the force."""
        x, y, z = (s[f"whirl_{k}"] for k in "xyz")
        place = (x, y, z)
        apart = s.position[0] - x, s.position[1] - y, s.position[2] - z
        size = dot(place, place)
        near = 1.0 + 9.0 * dot(apart, apart) / size
        axis: Vector = (expression(1.0), expression(1.0), expression(1.0))
        factor = s["whirl_k"] / (np.sqrt(3.0) * sqrt(size) * near * near)
        return combine([factor], [cross(axis, s.position)])


def outside_effects(case: Case) -> tuple[Candidate, ...]:
    """Return the outside effects sized for a case; they are never among its candidates.

    The pulses come 7.3 times; the whirl is at the
    first state of the first arc.
    """
    arc = case.arcs[0]
    end = max(float(m.times[-1]) for m in arc.measurements)
    r, v = arc.state[:3], arc.state[3:]
    pull = float(v @ v / np.linalg.norm(r))
    period = (end - arc.epoch) / 7.3
    return (
        Candidate(
            "pulse_train",
            "train of pushes",
            PulseTrain(),
            ("pulse_a_x", "pulse_a_y", "pulse_a_z"),
            {"pulse_a_x": 0.0, "pulse_a_y": 0.0, "pulse_a_z": 0.0, "pulse_period": period},
            (1e-5 * pull,) * 3,
            OUTSIDE,
        ),
        Candidate(
            "whirl",
            "force with curl about a place",
            Whirl(),
            ("whirl_k",),
            {
                "whirl_k": 0.0,
                "whirl_x": float(r[0]),
                "whirl_y": float(r[1]),
                "whirl_z": float(r[2]),
            },
            (1e-5 * pull,),
            OUTSIDE,
        ),
    )
