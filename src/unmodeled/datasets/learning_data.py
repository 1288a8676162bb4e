"""From true orbits to what a learner sees and what it is tested on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeAlias

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.frames import body_fixed_from_inertial, turned
from unmodeled.core.seeds import Streams
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.noise import Noise, observe
from unmodeled.datasets.trajectory import Trajectory

__all__ = [
    "LearningData",
    "NormalisedField",
    "SampleSet",
    "SunDirection",
    "TrueForce",
    "make_learning_data",
]

#: Times (n,), s since the epoch, to directions (n, 3) from the body to the Sun, inertial axes.
SunDirection: TypeAlias = Callable[[Array], Array]
#: Inertial states (n, 6), SI, and times (n,), s, to accelerations (n, 3), m/s2.
TrueForce: TypeAlias = Callable[[Array, Array], Array]


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
    positions, velocities, accelerations : ndarray (n, 3)
        The truth (for measured data: the best knowledge of it). Velocities are relative to
        inertial axes, components along those of the positions.
    observed_positions, observed_velocities, observed_accelerations : ndarray (n, 3)
        With the noise of Eq. 4; what a learner is trained on.
    sun_directions : ndarray (n, 3), optional
        Unit vectors to the Sun along the axes of the positions, where they are known.
    """

    name: str
    orbit: np.ndarray[Any, np.dtype[np.int64]]
    times: Array
    positions: Array
    velocities: Array
    accelerations: Array
    observed_positions: Array
    observed_velocities: Array
    observed_accelerations: Array
    sun_directions: Array | None = None

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, index: Any) -> SampleSet:
        """Return some of the samples."""
        columns: dict[str, Any] = {k: v[index] for k, v in self._columns().items()}
        return replace(self, **columns)

    def joined(self, others: Sequence[SampleSet]) -> SampleSet:
        """Return these samples followed by others."""
        columns: dict[str, Any] = {
            k: np.concatenate([v, *(getattr(s, k) for s in others)])
            for k, v in self._columns().items()
        }
        return replace(self, **columns)

    def _columns(self) -> dict[str, Array]:
        found = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "name"}
        return {k: v for k, v in found.items() if v is not None}


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
        The true orbits, SI: the training orbit, those of extrapolation, further training orbits.
    periods : tuple of float
        Kepler period of each orbit, s.
    noise : Noise
        What was added.
    facts : dict
        Plain facts for the report (shares of sigma, integrator difference, file notes).
    true_field : NormalisedField or None
        The field that made the orbits, in body-fixed axes if it turns; None for measured data
        and where the truth depends on more than the position.
    spin_rate : float
        With which the true field turns about z, rad/s; body axes are the inertial ones at time 0.
    frame : str
        Axes of the samples: ``"inertial"`` or ``"body_fixed"``. Orbits are always inertial.
    axes_rate : float, optional
        With which the body-fixed axes of the samples turn, rad/s, where that is not ``spin_rate``
        but an estimate of it.
    true_force : callable, optional
        In place of ``true_field``: inertial states (n, 6), SI, and times (n,), s, to
        accelerations, m/s2, inertial axes.
    sun : SunDirection, optional
        Where the Sun stands, if it is known.
    training_orbits : int
        How many of the orbits are trained on.
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
    true_force: TrueForce | None = None
    sun: SunDirection | None = None
    training_orbits: int = 1

    @property
    def extrapolation_orbits(self) -> range:
        """Which of ``orbits`` are not trained on."""
        return _others(len(self.orbits), self.training_orbits)

    @property
    def learned_spin_rate(self) -> float:
        """With which a field learned from the samples turns in inertial space, rad/s."""
        return _rate(self.frame, self.spin_rate, self.axes_rate)

    def axes_at(self, times: Array) -> Array | None:
        """Return the rotation (n, 3, 3) from inertial axes to those of the samples, if any."""
        return _turns(times, self.learned_spin_rate)

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
    true_force: TrueForce | None = None,
    sun: SunDirection | None = None,
    training_orbits: int = 1,
) -> LearningData:
    """Normalise, add noise, shuffle the training orbits and siphon the interpolation set.

    Parameters
    ----------
    orbits : sequence of Trajectory
        Inertial, with accelerations: the training orbit, at least one other, and further training
        orbits at the end, so that more of them change neither the first nor the others.
    periods : sequence of float
        Kepler period of each, s.
    units : NormalisedUnits
        Units of the samples.
    noise : Noise
        Added to every set's observed values; the truth is kept beside them.
    streams : Streams
        Uses the streams ``split`` and ``noise.*``.
    interpolation_share : float
        Share of the samples of training orbits that is held out, in (0, 0.5].
    true_field : callable, optional
        True acceleration (m/s2) at positions (m); it or ``true_force`` is needed for state noise.
    facts : dict, optional
        Facts to keep.
    spin_rate, frame, axes_rate, true_force, sun
        As in `LearningData`; ``true_field`` of a field that turns is in body-fixed axes.
    training_orbits : int
        How many of ``orbits`` are trained on.

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
    others = _others(len(orbits), training_orbits)
    if not others:
        raise DataError("no orbit to extrapolate to", do="give at least one other orbit")

    normal_field = None if true_field is None else NormalisedField(true_field, units)
    recipe = _Recipe(
        units, noise, normal_field, true_force, sun, spin_rate, _rate(frame, spin_rate, axes_rate)
    )
    parts = [recipe.samples(k, orbit, streams) for k, orbit in enumerate(orbits)]
    trained = parts[0].joined(parts[others.stop :])
    n = len(trained)
    held = math.ceil(interpolation_share * n - 1e-9)  # 0.07 * 100 is 7.000000000000001
    if n - held < 1:
        raise DataError(f"the training orbit has {n} samples", do="use more periods or samples")
    order = streams.generator("split").permutation(n)
    return LearningData(
        units,
        replace(trained[order[held:]], name="train"),
        replace(trained[order[:held]], name="interpolation"),
        replace(parts[1].joined(parts[2 : others.stop]), name="extrapolation"),
        tuple(orbits),
        tuple(periods),
        noise,
        (facts or {}) | _noise_facts(trained, noise, units),
        normal_field,
        spin_rate,
        frame,
        axes_rate,
        true_force,
        sun,
        training_orbits,
    )


def _others(orbits: int, training_orbits: int) -> range:
    """Return which orbits are not trained on: all but the first and the last ones."""
    return range(1, orbits - training_orbits + 1)


@dataclass(frozen=True)
class _Recipe:
    """How the samples of an orbit are made; names as in `LearningData`.

    ``axes_rate`` is that of the axes of the samples, zero if these are inertial.
    """

    units: NormalisedUnits
    noise: Noise
    true_field: NormalisedField | None
    true_force: TrueForce | None
    sun: SunDirection | None
    spin_rate: float
    axes_rate: float

    def samples(self, index: int, orbit: Trajectory, streams: Streams) -> SampleSet:
        """Return all samples of one orbit."""
        if orbit.accelerations is None:
            raise DataError(f"{orbit.source}: no accelerations", do="let the smoother make them")
        if orbit.frame != "inertial":
            raise DataError(
                f"{orbit.source} is given in {orbit.frame} axes",
                allowed="inertial axes",
                do="rotate it to inertial axes first",
            )
        x = orbit.positions / self.units.length
        v = orbit.velocities / self.units.velocity
        a = orbit.accelerations / self.units.acceleration
        towards = None if self.sun is None else self.sun(orbit.times)
        axes = _turns(orbit.times, self.axes_rate)
        if axes is not None:
            x, v, a = turned(axes, x), turned(axes, v), turned(axes, a)
            towards = None if towards is None else turned(axes, towards)
        label = f"orbit-{index}"
        seen_x, seen_a = observe(x, a, self.noise, self._along(orbit, axes), streams, label)
        seen_v = v
        if self.noise.velocity > 0:
            draw = streams.generator(f"noise.{label}.velocity").standard_normal(v.shape)
            seen_v = v + self.noise.velocity * draw
        which = np.full(len(orbit), index)
        return SampleSet("orbit", which, orbit.times, x, v, a, seen_x, seen_v, seen_a, towards)

    def _along(self, orbit: Trajectory, axes: Array | None) -> Callable[[Array], Array] | None:
        """Return the true field about the samples of one orbit, in their axes."""
        force, field = self.true_force, self.true_field
        if force is not None:

            def pushed(x: Array) -> Array:
                inertial = x if axes is None else turned(axes.mT, x)
                states = np.hstack([inertial * self.units.length, orbit.velocities])
                a: Array = force(states, orbit.times) / self.units.acceleration
                return a if axes is None else turned(axes, a)

            return pushed
        if field is None or self.axes_rate == self.spin_rate:
            return field  # it stands still in the axes of the samples
        turns = body_fixed_from_inertial(orbit.times, self.spin_rate)
        if axes is not None:
            turns = turns @ axes.mT  # from the axes of the samples into the body
        return lambda x: turned(turns.mT, field(turned(turns, x)))


def _rate(frame: str, spin_rate: float, axes_rate: float | None) -> float:
    """Return how fast the axes of samples turn, rad/s."""
    if frame != "body_fixed":
        return 0.0
    return spin_rate if axes_rate is None else axes_rate


def _turns(times: Array, rate: float) -> Array | None:
    """Return the rotation from inertial axes to those that turn, if they do."""
    return None if rate == 0.0 else body_fixed_from_inertial(times, rate)


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
