"""What a learner is shown of samples, and how it flies: its declared inputs from the data."""

from __future__ import annotations

from unmodeled.core.arrays import Array
from unmodeled.core.frames import turned
from unmodeled.datasets.learning_data import LearningData, SampleSet
from unmodeled.models.learned import InputFeatures, Learner
from unmodeled.pipeline.flight import Force

__all__ = ["inputs_at", "learned_force", "observed_inputs", "true_inputs"]


def observed_inputs(features: InputFeatures, data: LearningData, samples: SampleSet) -> Array:
    """Return the inputs (n, d) of samples as they were observed: what a learner is trained on.

    Parameters
    ----------
    features : InputFeatures
        Which; a period of the phase is in normalised units.
    data : LearningData
        Gives units.
    samples : SampleSet
        Of ``data``.

    Raises
    ------
    DataError
        If an input needs the Sun and the data do not know where it stands.
    """
    return features.of(
        samples.observed_positions,
        samples.observed_velocities,
        samples.times / data.units.time,
        samples.sun_directions,
    )


def true_inputs(features: InputFeatures, data: LearningData, samples: SampleSet) -> Array:
    """Return the inputs (n, d) of samples without noise: where a learner is tested.

    Parameters
    ----------
    features, data, samples
        As for `observed_inputs`.
    """
    return features.of(
        samples.positions,
        samples.velocities,
        samples.times / data.units.time,
        samples.sun_directions,
    )


def inputs_at(
    features: InputFeatures, data: LearningData, positions: Array, velocities: Array, times: Array
) -> Array:
    """Return the inputs (n, d) at places that are no samples.

    Parameters
    ----------
    features, data
        As for `observed_inputs`.
    positions, velocities : ndarray (n, 3)
        Normalised, along the axes of the samples.
    times : ndarray (n,)
        Seconds since the epoch.
    """
    if features.names == ("position",):
        return positions
    towards = None
    if data.sun is not None:
        axes = data.axes_at(times)
        towards = data.sun(times) if axes is None else turned(axes, data.sun(times))
    return features.of(positions, velocities, times / data.units.time, towards)


def learned_force(learner: Learner, features: InputFeatures, data: LearningData) -> Force:
    """Return a fitted learner as what `fly_force` flies.

    Parameters
    ----------
    learner : Learner
        Fitted on ``features``.
    features, data
        As for `observed_inputs`.
    """
    return lambda x, v, t: learner.predict(inputs_at(features, data, x, v, t))
