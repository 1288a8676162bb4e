"""From samples with noise to a field: what is repeated where positions are noisy."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.learned._potential_covariance import covariance_root
from unmodeled.models.learned._potential_evidence import Data, improve
from unmodeled.models.learned._potential_field import PotentialField
from unmodeled.models.learned._potential_noise import (
    EFFICIENCY,
    likely_places,
    mass_by_moments,
    student_factors,
    weight_roots,
)
from unmodeled.models.learned._potential_prior import Prior, Strengths, usual_strengths
from unmodeled.models.learned.learner import NoiseLevel, Progress

__all__ = ["Found", "Samples", "fit_field"]

#: Position noise over median radius above which only the mass is found.
_BLUNT = 0.2
#: Least noise, of accelerations GM / R^2 without stated noise, of the stated one with it. The first
#: is what the network can be trusted with without noise: at 1e-5 its 68 % band held 79 % of the
#: other orbit, at 1e-6 73 % (seeds 1 to 30).
_FLOOR, _STATED_FLOOR = 1e-6, 1e-3
#: Largest strength of the samples at the start, before the noise is estimated.
_FIRST = 1e10


@dataclass(frozen=True)
class Samples:
    """Positions and accelerations (n, 3) and their noise, all dimensionless."""

    x: Array
    y: Array
    noise: NoiseLevel


@dataclass(frozen=True)
class Found:
    """Unknowns (p,), a root (p, p) of their covariance, and the strengths."""

    unknowns: Array
    root: Array
    strengths: Strengths


def fit_field(
    field: PotentialField,
    samples: Samples,
    prior: Prior,
    *,
    known: bool,
    steps: tuple[int, int],
    passes: int,
    progress: Progress,
) -> Found:
    """Fit mass and weights.

    Parameters
    ----------
    field, samples, prior
        What is fitted, to what; the centre of the prior holds the reference mass.
    known : bool
        Whether something is known of the mass: then the fit starts from the reference.
    steps : (int, int)
        Most steps of the first fit and of each later one.
    passes : int
        Fits where positions are noisy.
    progress : callable
        Told the share done.

    Raises
    ------
    NumericalError
        If the fit breaks down, or positions are too noisy and nothing attracts.
    """
    noise, radius = samples.noise, np.linalg.norm(samples.x, axis=1)
    if noise.position > _BLUNT * float(np.median(radius)):
        return _mass_alone(field, samples, prior, known)
    start = prior.project(prior.centre)
    if not known:
        start[0] = _first_mass(field, samples, start)
        prior = replace(prior, centre=np.concatenate([start[:1], prior.centre[1:]]))
    if noise.position == 0:
        root, floor = _roots(field, samples, start, samples.x), _floor(noise)
        data = Data(samples.x, samples.y, root)
        first = _first_strengths(field, data, start, len(prior.points) > 0, floor)
        unknowns, strengths = improve(field, data, prior, (start, first), steps[0], progress, floor)
        covariance = covariance_root(field, data, prior, unknowns, strengths)
        return Found(unknowns, covariance, strengths)
    return _with_noisy_places(field, samples, prior, start, steps, passes, progress)


def _with_noisy_places(
    field: PotentialField,
    samples: Samples,
    prior: Prior,
    unknowns: Array,
    steps: tuple[int, int],
    passes: int,
    progress: Progress,
) -> Found:
    x, y, noise = samples.x, samples.y, samples.noise
    places, target, factors = x, y, np.ones(len(x))
    strengths = usual_strengths(len(prior.points) > 0)
    for k in range(passes):
        stated = _roots(field, samples, unknowns, places)
        data = Data(places, target, stated * factors[:, None, None])

        def tell(share: float, k: int = k) -> None:
            progress((k + share) / passes)

        count = steps[0] if k == 0 else steps[1]
        begin = (unknowns, strengths)
        unknowns, strengths = improve(field, data, prior, begin, count, tell, _STATED_FLOOR)
        if k == passes - 1:
            break
        rest = target - field.acceleration(places, unknowns)
        whitened = np.sqrt(strengths.data) * (stated @ rest[:, :, None])[:, :, 0]
        factors = student_factors(whitened)
        if noise.gradient is None:
            # Seen from the likely places, y = a(places) + G (x - places) + noise, G of this fit:
            # with G free in the next one, steep fields would be preferred.
            G = field.gradient(places, unknowns)
            away = (G @ (x - places)[:, :, None])[:, :, 0]
            rest = y - field.acceleration(places, unknowns) - away
            places = likely_places(x, noise, weight_roots(noise, G), G, rest)
            G = field.gradient(places, unknowns)
            target = y - (G @ (x - places)[:, :, None])[:, :, 0]
    less = replace(strengths, data=EFFICIENCY * strengths.data)
    return Found(unknowns, covariance_root(field, data, prior, unknowns, less), strengths)


def _mass_alone(field: PotentialField, samples: Samples, prior: Prior, known: bool) -> Found:
    """Find the mass, unless it is known, and leave the network at its prior."""
    centre, noise = prior.project(prior.centre), samples.noise
    if not known and noise.gradient is None:
        mass, error = mass_by_moments(samples.x, samples.y, noise.position)
        if not mass > 0:
            raise NumericalError(
                f"with position noise of {noise.position:.3g} radii only a mass can be found, and "
                "the accelerations do not point to the centre",
                do="use a smaller noise of the positions, or give mass_error",
            )
        centre[0], prior = mass, replace(prior, mass_precision=error**-2)
    elif not known:
        # On a known point mass: nothing is added to it, to the accuracy of such samples.
        radius = float(np.median(np.linalg.norm(samples.x, axis=1)))
        error = 2.0 * np.sqrt(2.0) * noise.position / radius / np.sqrt(len(samples.x))
        prior = replace(prior, mass_precision=float(error) ** -2)
    strengths = replace(usual_strengths(len(prior.points) > 0), data=0.0)
    data = Data(samples.x[:1], samples.y[:1], np.zeros((1, 3, 3)))
    return Found(centre, covariance_root(field, data, prior, centre, strengths), strengths)


def _first_mass(field: PotentialField, samples: Samples, start: Array) -> float:
    """Return the mass to start from."""
    noise = samples.noise
    if noise.position and noise.gradient is None:
        mass, _ = mass_by_moments(samples.x, samples.y, noise.position)
        if mass > 0:
            return mass
    radius = np.linalg.norm(samples.x, axis=1)[:, None]
    unit = -samples.x / radius**3
    return float((unit * samples.y).sum() / (unit * unit).sum())


def _roots(field: PotentialField, samples: Samples, unknowns: Array, places: Array) -> Array:
    noise = samples.noise
    if _silent(noise):
        return np.broadcast_to(np.eye(3), (len(places), 3, 3))
    gradient = np.zeros((len(places), 3, 3))
    if noise.position:
        gradient = field.gradient(places, unknowns)
        if noise.gradient is not None:
            gradient = gradient + noise.gradient
    return weight_roots(noise, gradient)


def _silent(noise: NoiseLevel) -> bool:
    own = noise.samples is not None and bool(noise.samples.any())
    return noise.position == 0 and noise.acceleration == 0 and not own


def _floor(noise: NoiseLevel) -> float:
    return _FLOOR if _silent(noise) else _STATED_FLOOR


def _first_strengths(
    field: PotentialField, data: Data, unknowns: Array, harmonic: bool, floor: float
) -> Strengths:
    strengths = usual_strengths(harmonic)
    if floor == _STATED_FLOOR:
        return strengths
    misfit = (data.target - field.acceleration(data.x, unknowns)).ravel()
    square = float(misfit @ misfit) / len(misfit)
    return replace(strengths, data=1.0 / max(square, 1.0 / _FIRST))
