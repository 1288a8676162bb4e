"""A fitted learner as a filter flies it: frozen, SI, no torch in the loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.units import NormalisedUnits
from unmodeled.pipeline.filters.frozen_fields import FrozenField, freeze
from unmodeled.pipeline.learned_field import LearnedField

__all__ = ["FlightForm"]


@dataclass(frozen=True)
class FlightForm:
    """Frozen learner in SI: a `LearnedAcceleration` of the position.

    Parameters
    ----------
    field : FrozenField
        From `freeze`, normalised units.
    units : NormalisedUnits
    """

    field: FrozenField
    units: NormalisedUnits

    @classmethod
    def of(cls, learned: LearnedField) -> FlightForm:
        """Freeze a fitted learner with its units; later fits of it change nothing here.

        Raises
        ------
        DataError
            If it depends on more than the position.
        """
        learned.require_position_alone("the flight form")
        return cls(freeze(learned.learner), learned.units)

    def evaluate(self, x: Array, t: float) -> tuple[Array, Array, Array | None]:
        """Return acceleration (b, 3), Jacobian (b, 3, n) and covariance (b, 3, 3) or None.

        Parameters
        ----------
        x : ndarray (b, n)
            States, position from the body's centre first, m.
        t : float
            Not used: learned fields are fixed in their axes.
        """
        a, slope, C = self.field(x[:, :3] / self.units.length)
        J = np.zeros((*a.shape, x.shape[1]))
        J[:, :, :3] = slope / self.units.time**2
        unit = self.units.acceleration
        return a * unit, J, None if C is None else C * unit**2
