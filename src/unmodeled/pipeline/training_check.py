"""The check before any test: a learner on training samples that it was not shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, NumericalError
from unmodeled.models.learned import Learner, NoiseLevel, PointMassOnly
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.use_check import UseCheck

__all__ = ["TrainingCheck", "training_check"]

Mask = npt.NDArray[np.bool_]

#: Share of the samples of a single orbit in each of its two held-out stretches.
_STRETCH = 0.2
#: Most orbits that are left out, one after the other.
_MOST_FOLDS = 5


@dataclass(frozen=True, slots=True)
class TrainingCheck(UseCheck):
    """What a learner does where its own training data are held back from it; needs no truth.

    The errors are counted from the *observed* accelerations, so that noise is in both medians and
    a learner at the level of the noise passes.

    Parameters
    ----------
    held_out : str
        What was held back: ``"each of 3 orbits"`` or ``"the far and the near stretch"``.
    samples : int
        How many samples were predicted unseen.
    failure : str
        Why a fit without them failed; the median is then infinite.
    """

    held_out: str
    samples: int
    failure: str = ""


def training_check(
    make: Callable[[], Learner],
    X: Array,
    y: Array,
    noise: NoiseLevel | None = None,
    orbits: npt.NDArray[Any] | None = None,
) -> TrainingCheck:
    """Train on a part of the training data and compare with the bare point mass on the rest.

    With samples of several orbits each orbit is left out once (at most five of them, evenly
    chosen). One orbit leaves two stretches: the fifth of the samples that is nearest in
    direction to the farthest sample, then that about the nearest one, every revolution of it.
    Stretches of an orbit are an easier test than other orbits: to pass proves little, not to
    pass says all.

    Parameters
    ----------
    make : callable
        Returns an unfitted learner.
    X : ndarray (n, 3) or (n, d)
        Observed positions, normalised, or inputs that begin with them.
    y : ndarray (n, 3)
        Observed accelerations, normalised.
    noise : NoiseLevel, optional
        As for `Learner.fit`.
    orbits : ndarray (n,), optional
        Which orbit each sample is from; one orbit if not given.

    Raises
    ------
    DataError
        If the learner refuses the samples that are left.
    """
    noise = noise or NoiseLevel()
    positions = X[:, :3]
    folds, held_out = _folds(positions, orbits)
    point_mass = PointMassOnly()  # its mass is known: nothing to fit
    errors, references, failure = [], [], ""
    for held in folds:
        references.append(fractional_error(y[held], point_mass._predict(positions[held])))
        try:
            learner = make().fit(X[~held], y[~held], _part(noise, ~held))
        except NumericalError as error:
            failure = str(error)
            errors.append(np.full(len(references[-1]), np.inf))
        else:
            errors.append(fractional_error(y[held], learner.predict(X[held])))
    unseen = np.concatenate(errors)
    # An infinite half of the errors must not become inf - inf.
    median = float(np.quantile(unseen, 0.5, method="higher"))
    reference = float(np.quantile(np.concatenate(references), 0.5, method="higher"))
    return TrainingCheck(median, reference, held_out, len(unseen), failure)


def _folds(X: Array, orbits: npt.NDArray[Any] | None) -> tuple[list[Mask], str]:
    names = np.unique(orbits) if orbits is not None else np.zeros(1)
    if orbits is not None and len(names) > 1:
        chosen = names[np.unique(np.linspace(0, len(names) - 1, _MOST_FOLDS).round().astype(int))]
        text = f"each of {len(chosen)} orbits"
        if len(chosen) < len(names):
            text += f" of {len(names)}"
        return [orbits == name for name in chosen], text
    return list(_stretches(X)), "the far and the near stretch"


def _stretches(X: Array) -> Iterator[Mask]:
    """Yield the samples about apoapsis, then those about periapsis."""
    count = max(1, round(_STRETCH * len(X)))
    if len(X) - count < 1:
        raise DataError(f"{len(X)} samples", allowed="2 or more", do="use a longer trajectory")
    radius = np.linalg.norm(X, axis=1)
    unit = X / radius[:, None]
    for centre in (int(np.argmax(radius)), int(np.argmin(radius))):
        held = np.zeros(len(X), dtype=bool)
        held[np.argsort(-(unit @ unit[centre]), kind="stable")[:count]] = True
        yield held


def _part(noise: NoiseLevel, kept: Mask) -> NoiseLevel:
    return replace(
        noise,
        samples=None if noise.samples is None else noise.samples[kept],
        gradient=None if noise.gradient is None else noise.gradient[kept],
    )
