"""From true orbits to what a learner sees and what it is tested on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.frames import body_fixed_from_inertial, turned
from unmodeled.core.seeds import Streams
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.noise import Noise, observe
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["LearningData", "NormalisedField", "SampleSet", "make_learning_data"]


@dataclass(frozen=True)
class SampleSet:
    """Samples of one role, normalised units, axes of `LearningData.frame`.

    Parameters
    ----------
    name : str
        ``"train"``, ``"interpolation"`` or ``"extrapolation"``.
    orbit : ndarray of int (n,)
        Which trajectory of `LearningData.orbits` each sample is from.
    times : ndarray (n,)
        Seconds since that trajectory's epoch.
    positions, accelerations : ndarray (n, 3)
        The truth (for measured data: the best knowledge of it).
    observed_positions, observed_accelerations : ndarray (n, 3)
        With the noise of Eq. 4; what a learner is trained on.
    """

    name: str
    orbit: np.ndarray[Any, np.dtype[np.int64]]
    times: Array
    positions: Array
    accelerations: Array
    observed_positions: Array
    observed_accelerations: Array

    def __len__(self) -> int:
        return len(self.times)


@dataclass(frozen=True)
class NormalisedField:
    """A field in SI as a function of normalised positions.

    Parameters
    ----------
    field : callable
        Positions (n, 3), m, to accelerations (n, 3), m/s2.
    units : NormalisedUnits
        What one unit is in SI.
    """

    field: Callable[[Array], Array]
    units: NormalisedUnits

    def __call__(self, positions: Array) -> Array:
        """Return normalised accelerations (n, 3) at normalised positions (n, 3)."""
        return self.field(positions * self.units.length) / self.units.acceleration


@dataclass(frozen=True)
class LearningData:
    """Training samples, the two test sets, and the orbits that they come from.

    Parameters
    ----------
    units : NormalisedUnits
        Length and time unit of all samples.
    train, interpolation, extrapolation : SampleSet
        Interpolation samples are siphoned from the training orbit; extrapolation samples are
        other orbits (or later revolutions).
    orbits : tuple of Trajectory
        The true orbits, SI, the training orbit first.
    periods : tuple of float
        Kepler period of each orbit, s.
    noise : Noise
        What was added.
    facts : dict
        Plain facts for the report (shares of sigma, integrator difference, file notes).
    true_field : NormalisedField or None
        The field that made the orbits, in body-fixed axes if it turns; None for measured data.
    spin_rate : float
        With which the true field turns about z, rad/s; body axes are the inertial ones at time 0.
    frame : str
        Axes of the samples: ``"inertial"`` or ``"body_fixed"``. Orbits are always inertial.
    axes_rate : float, optional
        With which the body-fixed axes of the samples turn, rad/s, where that is not ``spin_rate``
        but an estimate of it.
    """

    units: NormalisedUnits
    train: SampleSet
    interpolation: SampleSet
    extrapolation: SampleSet
    orbits: tuple[Trajectory, ...]
    periods: tuple[float, ...]
    noise: Noise
    facts: dict[str, Any] = field(default_factory=dict)
    true_field: NormalisedField | None = None
    spin_rate: float = 0.0
    frame: str = "inertial"
    axes_rate: float | None = None

    @property
    def learned_spin_rate(self) -> float:
        """With which a field learned from the samples turns in inertial space, rad/s."""
        if self.frame != "body_fixed":
            return 0.0
        return self.spin_rate if self.axes_rate is None else self.axes_rate

    @property
    def sets(self) -> tuple[SampleSet, SampleSet, SampleSet]:
        """The three sets: train, interpolation, extrapolation."""
        return self.train, self.interpolation, self.extrapolation


def make_learning_data(
    orbits: Sequence[Trajectory],
    periods: Sequence[float],
    units: NormalisedUnits,
    noise: Noise,
    streams: Streams,
    *,
    interpolation_share: float = 0.05,
    true_field: Callable[[Array], Array] | None = None,
    facts: dict[str, Any] | None = None,
    spin_rate: float = 0.0,
    frame: str = "inertial",
    axes_rate: float | None = None,
) -> LearningData:
    """Normalise, add noise, shuffle the training orbit and siphon the interpolation set.

    Parameters
    ----------
    orbits : sequence of Trajectory
        Inertial, with accelerations; the first is the training orbit, at least one more.
    periods : sequence of float
        Kepler period of each, s.
    units : NormalisedUnits
        Units of the samples.
    noise : Noise
        Added to every set's observed values; the truth is kept beside them.
    streams : Streams
        Uses the streams ``split`` and ``noise.*``.
    interpolation_share : float
        Share of the training orbit that is held out, in (0, 0.5].
    true_field : callable, optional
        True acceleration (m/s2) at positions (m); needed for state noise.
    facts : dict, optional
        Facts to keep.
    spin_rate, frame, axes_rate
        As in `LearningData`; ``true_field`` is then in body-fixed axes.

    Raises
    ------
    ConfigError
        If the share is out of range or state noise lacks the true field.
    DataError
        If an orbit has no accelerations, is not inertial, or leaves too few samples.
    """
    if not 0 < interpolation_share <= 0.5:
        raise ConfigError(
            f"interpolation_share is {interpolation_share}", allowed="more than 0, at most 0.5"
        )
    if len(orbits) < 2:
        raise DataError("no orbit to extrapolate to", do="give at least one other orbit")

    normal_field = None if true_field is None else NormalisedField(true_field, units)
    parts = [
        _samples(k, orbit, units, noise, normal_field, streams, spin_rate, frame, axes_rate)
        for k, orbit in enumerate(orbits)
    ]
    n = len(parts[0])
    held = math.ceil(interpolation_share * n - 1e-9)  # 0.07 * 100 is 7.000000000000001
    if n - held < 1:
        raise DataError(f"the training orbit has {n} samples", do="use more periods or samples")
    order = streams.generator("split").permutation(n)
    train = _take(parts[0], order[held:], "train")
    interpolation = _take(parts[0], order[:held], "interpolation")
    extrapolation = _join(parts[1:], "extrapolation")
    return LearningData(
        units,
        train,
        interpolation,
        extrapolation,
        tuple(orbits),
        tuple(periods),
        noise,
        (facts or {}) | _noise_facts(parts[0], noise, units),
        normal_field,
        spin_rate,
        frame,
        axes_rate,
    )


def _samples(
    index: int,
    orbit: Trajectory,
    units: NormalisedUnits,
    noise: Noise,
    field: Callable[[Array], Array] | None,
    streams: Streams,
    spin_rate: float,
    frame: str,
    axes_rate: float | None,
) -> SampleSet:
    if orbit.accelerations is None:
        raise DataError(f"{orbit.source}: no accelerations", do="let the smoother make them")
    if orbit.frame != "inertial":
        raise DataError(
            f"{orbit.source} is given in {orbit.frame} axes",
            allowed="inertial axes",
            do="rotate it to inertial axes first",
        )
    x = orbit.positions / units.length
    a = orbit.accelerations / units.acceleration
    if spin_rate != 0.0:
        turns = body_fixed_from_inertial(orbit.times, spin_rate)
        if frame == "body_fixed":
            axes = turns
            if axes_rate is not None:
                axes = body_fixed_from_inertial(orbit.times, axes_rate)
            x, a = turned(axes, x), turned(axes, a)
            turns = turns @ axes.mT  # from the axes of the samples into the body
        if field is not None and (frame != "body_fixed" or axes_rate is not None):
            body_field = field

            def field(x: Array) -> Array:
                return turned(turns.mT, body_field(turned(turns, x)))

    observed_x, observed_a = observe(x, a, noise, field, streams, f"orbit-{index}")
    return SampleSet("orbit", np.full(len(orbit), index), orbit.times, x, a, observed_x, observed_a)


def _take(s: SampleSet, index: Any, name: str) -> SampleSet:
    return SampleSet(
        name,
        s.orbit[index],
        s.times[index],
        s.positions[index],
        s.accelerations[index],
        s.observed_positions[index],
        s.observed_accelerations[index],
    )


def _join(parts: Sequence[SampleSet], name: str) -> SampleSet:
    return SampleSet(
        name,
        np.concatenate([p.orbit for p in parts]),
        np.concatenate([p.times for p in parts]),
        np.concatenate([p.positions for p in parts]),
        np.concatenate([p.accelerations for p in parts]),
        np.concatenate([p.observed_positions for p in parts]),
        np.concatenate([p.observed_accelerations for p in parts]),
    )


def _noise_facts(s: SampleSet, noise: Noise, units: NormalisedUnits) -> dict[str, float]:
    """Sigma in SI and as a share of the medians: the units of sigma are easily misread."""
    median_a = float(np.median(np.linalg.norm(s.accelerations, axis=1)))
    median_r = float(np.median(np.linalg.norm(s.positions, axis=1)))
    inside = np.linalg.norm(s.observed_positions, axis=1) < 1.0
    return {
        "median acceleration, normalised": median_a,
        "median acceleration, m/s2": median_a * units.acceleration,
        "sigma_s, m": noise.state * units.length,
        "sigma_s as share of median radius": noise.state / median_r,
        "sigma_a, m/s2": noise.acceleration * units.acceleration,
        "sigma_a as share of median acceleration": noise.acceleration / median_a,
        "samples of the training orbit observed inside the Brillouin sphere": int(inside.sum()),
    }
