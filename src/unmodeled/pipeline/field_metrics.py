"""Places at which a learned field is compared with the true one, and the error summed in flight."""

from __future__ import annotations

import math

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.seeds import Streams

__all__ = ["cumulative_position_error", "plane_points", "shell_points"]


def plane_points(half_width: float, count: int) -> Array:
    """Return grids on the planes z = 0, y = 0 and x = 0 through the body, (3 count^2, 3).

    Parameters
    ----------
    half_width : float
        The grid runs from -half_width to half_width on both axes, ends included.
    count : int
        Points on an axis, 2 or more; an even count leaves out the centre.
    """
    if not (math.isfinite(half_width) and half_width > 0) or count < 2:
        raise ConfigError(
            f"planes of half width {half_width} with {count} points on an axis",
            allowed="a width > 0 and 2 points or more",
        )
    axis = np.linspace(-half_width, half_width, count)
    u, v = (g.ravel() for g in np.meshgrid(axis, axis, indexing="ij"))
    zero = np.zeros_like(u)
    return np.concatenate([np.stack(p, axis=1) for p in ((u, v, zero), (u, zero, v), (zero, u, v))])


def shell_points(inner: float, outer: float, count: int, streams: Streams, name: str) -> Array:
    """Return points at random in the volume of a shell: radii uniform, directions isotropic.

    Radii, not volume elements, are uniform: else nearly all points of 1 to 10 radii lie beyond 5.

    Parameters
    ----------
    inner, outer : float
        Radii, 0 <= inner < outer.
    count : int
        How many.
    streams : Streams
        Uses the stream ``field.<name>``.
    name : str
        Of the region, e.g. ``exterior``.

    Returns
    -------
    ndarray (count, 3)
    """
    if not (0 <= inner < outer and math.isfinite(outer)) or count < 1:
        raise ConfigError(
            f"{count} points between radii {inner} and {outer}",
            allowed="0 <= inner < outer, 1 point or more",
        )
    generator = streams.generator(f"field.{name}")
    direction = generator.standard_normal((count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    radius = generator.uniform(inner, outer, count)
    points: Array = radius[:, None] * direction
    return points


def cumulative_position_error(true: Array, predicted: Array) -> float:
    """Return the sum over nodes of the distance between two trajectories.

    The trajectory metric of the published gravity-network protocol: a sum, not a largest or a
    last value, so that it grows with the number of nodes.

    Parameters
    ----------
    true : ndarray (n, 3)
    predicted : ndarray (m, 3)
        A flight that ended before the true one, or is not finite, has an infinite error.
    """
    true = as_array(true, ("n", 3), "true positions")
    if np.ndim(predicted) != 2 or len(predicted) > len(true) or predicted.shape[1] != 3:
        raise DataError(
            f"predicted positions have shape {np.shape(predicted)}", allowed=f"{true.shape}"
        )
    if len(predicted) < len(true):
        return math.inf
    total = float(np.sum(np.linalg.norm(predicted - true, axis=1)))
    return total if math.isfinite(total) else math.inf
