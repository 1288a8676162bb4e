"""Where Sun, Moon, planets and small bodies are.

Series by default (:class:`AnalyticEphemeris`, no file), a JPL kernel when one is given
(:class:`KernelEphemeris`). Nothing switches silently between the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

import numpy.typing as npt

from unmodeled.core.analytic_ephemeris import AnalyticEphemeris
from unmodeled.core.arrays import Array
from unmodeled.core.kepler_orbit import HeliocentricOrbit
from unmodeled.core.kernel_ephemeris import KernelEphemeris

__all__ = ["AnalyticEphemeris", "Ephemeris", "KernelEphemeris", "load_ephemeris"]


class Ephemeris(Protocol):
    """What every ephemeris can do."""

    @property
    def source(self) -> str:
        """One line for provenance."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names that may be asked for."""

    def position(self, body: str, centre: str, epoch: str, times: npt.ArrayLike) -> Array:
        """Return positions (n, 3) of ``body`` relative to ``centre``.

        Metres along ICRF axes, geometric (no light time), at ``times`` (n,) SI seconds after
        ``epoch`` (text with its scale, e.g. ``"2019-01-01T00:00:00 TDB"``).
        """


def load_ephemeris(
    kernel: Path | None = None, small_bodies: Mapping[str, HeliocentricOrbit] | None = None
) -> Ephemeris:
    """Return the kernel's ephemeris if one is given, the analytic one otherwise.

    Parameters
    ----------
    kernel : Path, optional
        A JPL ``.bsp`` file.
    small_bodies : mapping of str to HeliocentricOrbit, optional
        Two-body orbits, e.g. ``datasets.bodies.heliocentric_orbits()``; a body that the kernel
        holds is taken from the kernel.

    Raises
    ------
    ConfigError
        If a kernel is given and ``jplephem`` is not installed.
    DataError
        If the kernel cannot be read.

    Examples
    --------
    >>> load_ephemeris().position("moon", "earth", "2019-01-01T00:00:00 TDB", [0.0]).shape
    (1, 3)
    """
    if kernel is None:
        return AnalyticEphemeris(small_bodies or {})
    return KernelEphemeris(kernel, small_bodies)
