"""Series of tracks and orientation as runtime parameters without a name of a compiled system."""

from __future__ import annotations

import numpy as np

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics.orientation import Orientation
from unmodeled.models.physics.system import System
from unmodeled.models.physics.tracks import Tracks

__all__ = ["runtime_series"]


def runtime_series(
    system: System,
    needed: set[str],
    tracks: Tracks | None,
    orientation: Orientation | None,
) -> list[float]:
    """Return the numbers that follow the named parameters, in the order of `System`.

    Parameters
    ----------
    system : System
        The effects together.
    needed : set of str
        Bodies whose positions the effects ask for.
    tracks : Tracks or None
        Their positions, Chebyshev series.
    orientation : Orientation or None
        How the central body is turned.

    Returns
    -------
    list of float
        Middle of the interval (s), 2 / its length (1/s), coefficients; empty without series.

    Raises
    ------
    ConfigError
        A body without a track, or tracks and orientation on different intervals.
    """
    interval: tuple[float, float] | None = None
    flat: list[float] = []
    if needed:
        if tracks is None or not needed <= set(tracks.coefficients):
            missing = sorted(needed - set(tracks.coefficients if tracks else ()))
            raise ConfigError(
                f"the force model needs the position of {', '.join(missing)}",
                do="give tracks with it",
            )
        interval = (tracks.start, tracks.end)
        for name in system.bodies:
            flat += tracks.coefficients[name].T.ravel().tolist()
    if orientation is not None:
        moves = orientation.degree > 0
        if moves and interval not in (None, (orientation.start, orientation.end)):
            raise ConfigError(
                "tracks and orientation on different intervals", do="fit both on the same"
            )
        interval = interval or (orientation.start, orientation.end)
        flat += np.moveaxis(orientation.slow, 0, -1).ravel().tolist()
        flat += orientation.fixed.ravel().tolist()
    if interval is None:
        return []
    start, end = interval
    return [0.5 * (start + end), 2.0 / (end - start), *flat]
