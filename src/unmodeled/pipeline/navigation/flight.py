"""What filters are tried on: a true flight, what is measured of it, and what is known before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.seeds import Streams
from unmodeled.pipeline.filters.interfaces import MeasurementModel, ProcessModel, RateModel
from unmodeled.pipeline.filters.state import Booleans

__all__ = ["Flight", "Scale", "draw"]


@dataclass(frozen=True)
class Scale:
    """Units of a flight in SI: metres and seconds in one of its own."""

    length: float = 1.0
    time: float = 1.0

    @property
    def speed(self) -> float:
        """m/s in one unit of speed."""
        return self.length / self.time

    @property
    def acceleration(self) -> float:
        """m/s2 in one unit of acceleration."""
        return self.length / self.time**2


@dataclass(frozen=True)
class Flight:
    """A true flight.

    Parameters
    ----------
    name, title : str
    times : ndarray (k,)
        Epochs of measurements; the first is the start.
    truth : ndarray (k, 6)
    disturbance : ndarray (k, 3)
        What truly acts beyond ``base``.
    base, exact : RateModel
        What a simple filter knows, and what a filter that knows everything would.
    measurement : MeasurementModel
    used : ndarray (k,) of bool
        False in gaps, and at the start, where there is no measurement.
    start_sigma, believed_sigma : ndarray (6,)
        Of the error of the first guess, and what the filter is told of it.
    settle : float
        Errors count from this time on.
    phases : mapping of str to (float, float)
        Named intervals, such as gaps.
    longest : float
        Longest integration step for ``base``.
    scale : Scale
    axes : tuple of str
        Names of the three axes.
    impulses : tuple of (float, ndarray (3,))
        Known changes of velocity: time and size.
    nonlinear : RateModel, optional
        The best model that the papers fly, where it is neither ``base`` nor ``exact``.
    facts : mapping of str to float
        What is worth knowing of the truth.
    suspects : mapping of str to ndarray (k, 3)
        Effects of the catalogue that may act: acceleration at each epoch for a unit of their
        parameter, in the axes of the states. How much there is of each is not said.
    """

    name: str
    title: str
    times: Array
    truth: Array
    disturbance: Array
    base: RateModel
    exact: RateModel
    measurement: MeasurementModel
    used: Booleans
    start_sigma: Array
    believed_sigma: Array
    settle: float
    phases: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    longest: float = float("inf")
    scale: Scale = Scale()
    axes: tuple[str, str, str] = ("x", "y", "z")
    impulses: tuple[tuple[float, Array], ...] = ()
    nonlinear: RateModel | None = None
    facts: Mapping[str, float] = field(default_factory=dict)
    suspects: Mapping[str, Array] = field(default_factory=dict)

    @property
    def settled(self) -> Booleans:
        """Epochs (k,) that count for mean errors: after settling, outside every phase."""
        counted: Booleans = self.times >= self.settle
        for start, end in self.phases.values():
            counted = counted & ~((self.times >= start) & (self.times <= end))
        return counted

    @property
    def free(self) -> Booleans:
        """States (6,) that are not known exactly from the start to the end.

        A flight in a plane has four; process noise makes filters unsure of the others, but there
        is nothing to be wrong about.
        """
        unsure: Booleans = self.start_sigma > 0.0
        return unsure

    def during(self, phase: str) -> Booleans:
        """Epochs (k,) of a phase."""
        start, end = self.phases[phase]
        inside: Booleans = (self.times >= start) & (self.times <= end)
        return inside

    def flown(self, model: ProcessModel) -> ProcessModel:
        """Return a model with the impulses of the flight."""
        return _WithImpulses(model, self.impulses) if self.impulses else model


@dataclass(frozen=True)
class _WithImpulses:
    model: ProcessModel
    impulses: tuple[tuple[float, Array], ...]

    @property
    def size(self) -> int:
        return self.model.size

    def propagate(self, x: Array, t: float, dt: float) -> tuple[Array, Array]:
        """Add to the velocity what was fired at the start of the step; impulses lie on epochs."""
        for at, change in self.impulses:
            if abs(at - t) < 1e-9 * max(1.0, abs(at)):
                x = x.copy()
                x[:, 3:6] += change
        return self.model.propagate(x, t, dt)


def draw(flight: Flight, runs: int, seed: int) -> tuple[Array, Array]:
    """Draw first guesses (b, 6) and measurements (k, b, m).

    The same seed gives run i the same draws whatever the number of runs.
    """
    streams = Streams(seed)
    R = flight.measurement.R
    root = np.linalg.cholesky(R)
    clean, _ = flight.measurement.h(flight.truth, 0.0)
    starts = np.empty((runs, 6))
    z = np.empty((len(flight.times), runs, len(R)))
    for i in range(runs):
        rng = streams.generator(f"navigate.run.{i}")
        starts[i] = flight.truth[0] + flight.start_sigma * rng.normal(size=6)
        z[:, i] = clean + rng.normal(size=clean.shape) @ root.T
    z[~flight.used] = np.nan
    return starts, z
