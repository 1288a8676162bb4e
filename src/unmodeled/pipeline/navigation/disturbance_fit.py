"""Networks of Gaussians fitted at once to a disturbance along a flight: [Marchese2023] 3.4.2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.core.seeds import Streams
from unmodeled.pipeline.filters.basis import RBFFeatures
from unmodeled.pipeline.navigation.flight import Flight

__all__ = ["DisturbanceFit", "fit_disturbance"]

#: Singular values below this share of the largest are cut.
_RCOND = 1e-10


@dataclass(frozen=True)
class DisturbanceFit:
    """A fitted network along the flight that it was fitted to.

    Parameters
    ----------
    neurons : int
    eta : float
    samples : int
    noise : float
        Standard deviation added to each axis of the labels, m/s2.
    truth, said : ndarray (k, 3)
        Disturbance and what the network makes of it, m/s2.
    """

    neurons: int
    eta: float
    samples: int
    noise: float
    truth: Array
    said: Array

    @property
    def axis_errors(self) -> tuple[Array, Array]:
        """Mean and largest size of the error on each axis (3,), m/s2: Eq. 3.78."""
        error = np.abs(self.said - self.truth)
        return error.mean(axis=0), error.max(axis=0)

    @property
    def length_errors(self) -> tuple[float, float]:
        """Mean and largest length of the error, m/s2: Tables 3.6 and 3.7."""
        length = np.linalg.norm(self.said - self.truth, axis=1)
        return float(length.mean()), float(length.max())


def fit_disturbance(
    flight: Flight, neurons: int, eta: float, noise: float, seed: int = 1
) -> DisturbanceFit:
    """Fit a network to the true disturbance with white noise, by the pseudo-inverse (Eq. 3.77).

    Inputs are the six states, scaled to -1 to 1 over the flight; centres are samples of the flight
    at equal distances in time. As many neurons as samples are solved for exactly.

    Parameters
    ----------
    flight : Flight
    neurons : int
        1 to the number of epochs.
    eta : float
        Of all Gaussians, in scaled inputs.
    noise : float
        m/s2.
    seed : int
        The same seed gives networks of any size the same labels.

    Raises
    ------
    ConfigError
        More neurons than samples.
    """
    x, d = flight.truth, flight.disturbance * flight.scale.acceleration
    if not 1 <= neurons <= len(x):
        raise ConfigError(f"{neurons} neurons", allowed=f"1 to {len(x)}, the number of samples")
    rng = Streams(seed).generator("navigate.labels")
    labels = d + noise * rng.normal(size=d.shape)
    low, high = x.min(axis=0), x.max(axis=0)
    span = np.where(high > low, high - low, 1.0)
    scaled = (2.0 * x - (low + high)) / span
    at = np.linspace(0, len(x) - 1, neurons).round().astype(int)
    phi, _ = RBFFeatures(scaled[at], eta).evaluate(scaled)
    if neurons == len(x):
        weights = np.linalg.solve(phi, labels)
    else:
        weights = np.linalg.lstsq(phi, labels, rcond=_RCOND)[0]
    return DisturbanceFit(neurons, eta, len(x), noise, d, phi @ weights)
