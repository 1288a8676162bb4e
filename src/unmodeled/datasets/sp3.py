"""Reader of precise orbits in the Standard Product 3 format, SP3-a to SP3-d [Hilla2010].

Own reader: of the packages tried, ``orbit-formats`` 0.5 reads only versions c and d, ``sp3``
refuses real headers, and all refuse minute 60 or a missing leading blank.

What the format means, and what is done with it:

* Positions are km and velocities dm/s, Earth-fixed, *relative to the rotating Earth*.  Some
  centres write m/s: the velocities are compared with the positions' differences and put right.
* The time system is the third field of the first ``%c`` line; ``ccc`` (SP3-a) means GPS time.
* A position of zeros, or a velocity of zeros or 999999.999999, is absent: the sample is left out.
* The noise of positions and velocities is estimated from their roughness, not taken from the last
  printed digit: combined orbits of LAGEOS-2 print 1e-7 m/s and scatter by 4e-6 m/s.
* Coordinates refer to the frame's origin.  SLR and GNSS products realise the centre of mass on
  long time scales but the centre of figure on short ones; the difference (a few mm) is ignored.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.earth_orientation import icrf_from_itrf, inertial_from_earth_fixed
from unmodeled.core.errors import DataError
from unmodeled.datasets.smoother import smooth, with_accelerations
from unmodeled.datasets.sp3_format import read_sp3_table
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["read_sp3"]


def read_sp3(
    path: str | Path,
    *,
    satellite: str | None = None,
    frame: str = "inertial",
    accelerations: bool = True,
) -> Trajectory:
    """Read one satellite of an SP3 file as a trajectory.

    Parameters
    ----------
    path : str or Path
        The file, plain or ``.gz``.
    satellite : str, optional
        Identifier such as ``"L52"`` or ``"G01"``; needed where the file has several.
    frame : str
        ``"inertial"`` (GCRS axes) or ``"body_fixed"`` (ITRF axes; the velocity is still the one
        relative to inertial axes).
    accelerations : bool
        Whether to add accelerations from :mod:`unmodeled.datasets.smoother`.

    Returns
    -------
    Trajectory
        SI; velocities come from the smoother where the file has none.

    Raises
    ------
    DataError
        If the file is missing, empty, not SP3, cut short or malformed, has no or several
        satellites of that name, or its dates lie outside the tables of Earth orientation.
    """
    if frame not in ("inertial", "body_fixed"):
        raise DataError(f'frame "{frame}" is unknown', allowed="inertial, body_fixed")
    table = read_sp3_table(path, satellite)
    zeros = np.zeros_like(table.positions)
    fixed = zeros if table.velocities is None else table.velocities
    r, v = inertial_from_earth_fixed(table.epoch, table.times, table.positions, fixed)
    notes = dict(table.notes)
    name = Path(path).name
    if table.velocities is None:
        v = smooth(table.times, r).velocities
        notes["velocities"] = "from the smoother; the file has none"
    found = Trajectory(table.times, r, v, source=name, epoch=table.epoch, notes=notes)
    if accelerations:
        found = with_accelerations(found, use_velocities=table.velocities is not None)
    return found if frame == "inertial" else _to_body_fixed(found)


def _to_body_fixed(trajectory: Trajectory) -> Trajectory:
    rotation = icrf_from_itrf(trajectory.epoch, trajectory.times)

    def turned(vectors: Array) -> Array:
        components: Array = np.einsum("nji,nj->ni", rotation, vectors)
        return components

    acc = trajectory.accelerations
    return Trajectory(
        trajectory.times,
        turned(trajectory.positions),
        turned(trajectory.velocities),
        None if acc is None else turned(acc),
        "body_fixed",
        trajectory.source,
        trajectory.epoch,
        trajectory.acceleration_sigma,
        trajectory.notes,
    )
