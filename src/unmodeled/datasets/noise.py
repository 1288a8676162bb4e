"""Noise on the observed states and accelerations, [Neamati2022] Eq. 4, in both readings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.core.seeds import Streams

__all__ = ["Noise", "observe"]


@dataclass(frozen=True, slots=True)
class Noise:
    """Gaussian noise, uncorrelated between samples and axes.

    Parameters
    ----------
    state, acceleration : float
        Standard deviation on each axis of position and acceleration, normalised units.
    draws : {"independent", "consistent"}
        Eq. 4 reads ``a_obs = a(x_true + n_s) + n_a`` and ``x_obs = x_true + n_s'``. In the
        ``consistent`` reading the two position errors are the same draw, so that the pair
        (x_obs, a_obs) lies on the true field; in the ``independent`` reading (default) they are
        two draws. The reading decides the result: only independent draws hurt a learner.
    velocity : float
        Standard deviation on each axis of the velocity, which is an input of some learners.
    """

    state: float = 0.0
    acceleration: float = 0.0
    draws: Literal["independent", "consistent"] = "independent"
    velocity: float = 0.0

    def __post_init__(self) -> None:
        for name in ("state", "acceleration", "velocity"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise ConfigError(f"noise.{name} is {value}", allowed="a standard deviation >= 0")
        if self.draws not in ("independent", "consistent"):
            raise ConfigError(f'noise.draws is "{self.draws}"', allowed="independent, consistent")


def observe(
    positions: Array,
    accelerations: Array,
    noise: Noise,
    field: Callable[[Array], Array] | None,
    streams: Streams,
    label: str,
) -> tuple[Array, Array]:
    """Return observed positions and accelerations.

    Parameters
    ----------
    positions, accelerations : ndarray (n, 3)
        The truth, normalised.
    noise : Noise
        What to add.
    field : callable or None
        The true field, positions (n, 3) to accelerations (n, 3), normalised; needed for state
        noise only.
    streams : Streams
        Uses the streams ``noise.<label>.argument``, ``.state`` and ``.acceleration``; the draws
        scale with sigma, so that a sweep over sigma sees the same noise pattern.
    label : str
        Name of the orbit.

    Raises
    ------
    ConfigError
        If state noise is wanted for measured data, whose true field is unknown.
    """
    shape = positions.shape

    def draw(part: str) -> Array:
        return streams.generator(f"noise.{label}.{part}").standard_normal(shape)

    observed_x, observed_a = positions, accelerations
    if noise.state > 0:
        if field is None:
            raise ConfigError(
                f"noise.state is {noise.state} for a measured trajectory",
                allowed="0",
                do="Eq. 4 needs the true field; add state noise to simulated data only",
            )
        argument = noise.state * draw("argument")
        shift = argument if noise.draws == "consistent" else noise.state * draw("state")
        observed_x = positions + shift
        observed_a = field(positions + argument)
    if noise.acceleration > 0:
        observed_a = observed_a + noise.acceleration * draw("acceleration")
    return observed_x, observed_a
