"""An effect that may be missing from a model, and how large it could be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.datasets.measurement_effects import MeasurementEffect
from unmodeled.models.physics import Effect
from unmodeled.models.physics.system import POLE_X, POLE_Y, PRIME_MERIDIAN, SPIN_RATE

__all__ = ["Candidate"]


@dataclass(frozen=True)
class Candidate:
    """One effect to be scored, with the parameters that would be estimated.

    Parameters
    ----------
    name : str
        Short name, e.g. ``"srp"``; the word that `add` takes.
    title : str
        For tables, e.g. ``"solar radiation pressure"``.
    effect : Effect or MeasurementEffect
        A force, or something that the instrument does.
    estimate : tuple of str
        Parameters whose null value is that in ``values``: with it, the effect does nothing.
    values : mapping of str to float
        All parameters of the effect that the model does not have yet.
    priors : tuple of float
        Standard deviation of what one expects of each estimated parameter about its null value
        before looking: the expected size.
    family : str
        "gravity", "third body", "radiation", "atmosphere", "relativity", "propulsion",
        "non-gravitational", "instrument".
    known : mapping of str to (float, float)
        Accepted value and standard deviation of parameters that are known from elsewhere: an
        estimate far from it speaks against the label.
    places : tuple of mappings
        Values to search over (mascon places, manoeuvre epochs); empty if there is no search.
        The places name parameters that a refit estimates too (``searched``).
    searched : tuple of str
        Parameters fixed in the search and free in the refit.
    positive : tuple of str
        Estimated parameters that nature has with one sign only (a mass, an area, a Love number): an
        estimate well below zero speaks against the label.
    """

    name: str
    title: str
    effect: Effect | MeasurementEffect
    estimate: tuple[str, ...]
    values: Mapping[str, float]
    priors: tuple[float, ...]
    family: str
    known: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    places: tuple[Mapping[str, float], ...] = ()
    searched: tuple[str, ...] = ()
    positive: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.estimate:
            raise ConfigError(f"candidate {self.name} estimates nothing")
        if len(self.priors) != len(self.estimate) or not all(p > 0 for p in self.priors):
            raise ConfigError(
                f"candidate {self.name}: priors {self.priors}",
                allowed="one standard deviation > 0 for each estimated parameter",
            )

    @property
    def is_force(self) -> bool:
        """True for a force, False for an effect of the measurements."""
        return isinstance(self.effect, Effect)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The estimated parameters."""
        turning = (SPIN_RATE, PRIME_MERIDIAN, POLE_X, POLE_Y)
        named = {p.name: p for p in (*turning, *self.effect.parameters)}
        return tuple(named[name] for name in self.estimate)

    def reach(self, name: str) -> float:
        """Return the distance between neighbouring places of a searched parameter.

        The prior of a refit: a place is kept near where it was found, for elsewhere it may leave
        no trace.
        """
        # Each value once: on a grid of two parameters every one of them comes many times.
        values = np.unique([place[name] for place in self.places])
        spread = float(np.ptp(values))
        return max(spread / max(len(values) - 1, 1), 1e-9 * max(spread, 1.0))
