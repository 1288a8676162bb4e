"""Sun, Moon, planets and small bodies from a JPL kernel (.bsp)."""

from __future__ import annotations

import struct
import weakref
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import erfa
import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.ephemeris_pairs import PLANETS, check_pair
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.kepler_orbit import HeliocentricOrbit
from unmodeled.core.time import terrestrial_time

__all__ = ["NAIF_NUMBERS", "KernelEphemeris"]

_DAY = 86_400.0
_SUN = 10
#: NAIF numbers of bodies in order of preference. From Mars outwards the barycentre of planet and
#: satellites: planetary kernels have nothing else, and its attraction goes with the GM of the
#: whole system.
NAIF_NUMBERS: dict[str, tuple[int, ...]] = {
    "sun": (_SUN,),
    "mercury": (199, 1),
    "venus": (299, 2),
    "earth": (399,),
    "moon": (301,),
    "mars": (4, 499),
    "jupiter": (5, 599),
    "saturn": (6, 699),
    "uranus": (7, 799),
    "neptune": (8, 899),
    "bennu": (2_101_955, 20_101_955),
    "eros": (2_000_433, 20_000_433),
}
_READABLE = (2, 3)
_ICRF = 1


class KernelEphemeris:
    """Positions from an SPK kernel, read by the optional package ``jplephem``.

    Parameters
    ----------
    path : Path
        A ``.bsp`` file with Chebyshev segments (SPK types 2 and 3) along ICRF axes, such as
        DE421 or DE440s.
    small_bodies : mapping of str to HeliocentricOrbit, optional
        Two-body orbits for bodies that the kernel lacks; they are named in :attr:`source`.

    Raises
    ------
    ConfigError
        If ``jplephem`` is not installed.
    DataError
        If the file is missing, truncated or no kernel.

    Notes
    -----
    Interpolation is exact to about a millimetre for the Moon and centimetres for planets; what
    the kernel's makers state of its accuracy comes on top. Times are turned to TDB by
    ``erfa.dtdb`` (microseconds).
    """

    def __init__(
        self, path: Path, small_bodies: Mapping[str, HeliocentricOrbit] | None = None
    ) -> None:
        self.path = Path(path)
        self.small_bodies = {n.lower(): o for n, o in (small_bodies or {}).items()}
        kernel = _open(self.path)
        weakref.finalize(self, kernel.close)
        self._segments: dict[int, list[Any]] = {}
        for segment in kernel.segments:
            self._segments.setdefault(segment.target, []).append(segment)
        self._named = {
            name: next(n for n in numbers if n in self._segments or n == _SUN)
            for name, numbers in NAIF_NUMBERS.items()
            if any(n in self._segments for n in numbers) or name == "sun"
        }

    def __reduce__(self) -> tuple[Any, ...]:
        # Workers open the file again.
        return KernelEphemeris, (self.path, self.small_bodies)

    @property
    def source(self) -> str:
        """One line for provenance."""
        added = [n for n in self.small_bodies if n not in self._named]
        return f"kernel {self.path.name}" + (f"; two-body: {', '.join(added)}" if added else "")

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names that may be asked for, the planets first."""
        names = {*self._named, *self.small_bodies}
        first = [n for n in PLANETS if n in names]
        return (*first, *sorted(names - set(first)))

    def position(self, body: str, centre: str, epoch: str, times: npt.ArrayLike) -> Array:
        """Return where ``body`` is as seen from ``centre``.

        Parameters
        ----------
        body, centre : str
            Names; see :attr:`bodies`.
        epoch : str
            Time zero with its scale, e.g. ``"2019-01-01T00:00:00 TDB"``.
        times : array_like (n,)
            SI seconds since it, in any order.

        Returns
        -------
        ndarray (n, 3)
            Metres along ICRF axes; geometric, without light time.

        Raises
        ------
        DataError
            If a name is unknown, both are the same, the epoch cannot be read, a time lies outside
            the kernel, or the kernel does not connect the two bodies.
        """
        pair = check_pair(body, centre, self.bodies, self.source)
        seconds = as_array(times, ("n",), "times")
        stamps = terrestrial_time(epoch, seconds)
        tt = np.asarray(stamps.jd1, dtype=float), np.asarray(stamps.jd2, dtype=float)
        tdb = tt[0], tt[1] + erfa.dtdb(*tt, 0.0, 0.0, 0.0, 0.0) / _DAY
        chains, ellipses = [], np.zeros((2, len(seconds), 3))
        for k, name in enumerate(pair):
            if name not in self._named:
                ellipses[k] = self.small_bodies[name].position(epoch, seconds)
            chains.append(self._chain(self._named.get(name, _SUN)))
        kilometres = self._between(chains, pair, tdb)
        position: Array = 1e3 * kilometres + (ellipses[0] - ellipses[1])
        return position

    def _chain(self, number: int) -> list[int]:
        """Numbers from a body to the kernel's root."""
        chain = [number]
        while chain[-1] in self._segments:
            chain.append(self._segments[chain[-1]][-1].center)
        return chain

    def _between(
        self, chains: list[list[int]], pair: tuple[str, str], tdb: tuple[Array, Array]
    ) -> Array:
        up, down = chains
        if up[-1] != down[-1]:
            raise DataError(
                f'{self.path.name} does not connect "{pair[0]}" with "{pair[1]}"',
                allowed="bodies whose segments lead to one origin",
                do="give a kernel that holds both, such as a planetary ephemeris (DE440s)",
            )
        # What both chains share is never added, so nothing is lost to rounding.
        while up and down and up[-1] == down[-1]:
            up, down = up[:-1], down[:-1]
        total = np.zeros((len(tdb[0]), 3))
        for sign, chain in ((1.0, up), (-1.0, down)):
            for number in chain:
                total += sign * self._segment(number, tdb)
        return total

    def _segment(self, number: int, tdb: tuple[Array, Array]) -> Array:
        """Position (n, 3) of a number relative to its centre, km; later segments come first."""
        centre = self._segments[number][-1].center
        segments = [s for s in self._segments[number] if s.center == centre]
        jd = tdb[0] + tdb[1]
        out = np.full((len(jd), 3), np.nan)
        for s in reversed(segments):
            inside = np.isnan(out[:, 0]) & (s.start_jd <= jd) & (jd <= s.end_jd)
            if inside.any():
                self._check_kind(s, number)
                out[inside] = s.compute(tdb[0][inside], tdb[1][inside]).T[:, :3]
        if np.isnan(out).any():
            raise DataError(
                f"times from {_date(jd.min())} to {_date(jd.max())} lie outside {self.path.name}",
                allowed=", ".join(f"{_date(s.start_jd)} to {_date(s.end_jd)}" for s in segments),
                do="check the epoch, or give a kernel that covers it",
            )
        return out

    def _check_kind(self, segment: Any, number: int) -> None:
        if segment.data_type not in _READABLE:
            raise DataError(
                f"{self.path.name}: the segment of NAIF number {number} is of SPK type "
                f"{segment.data_type}",
                allowed="types " + " and ".join(str(t) for t in _READABLE),
                do="use the heliocentric elements of the body's card, or convert the kernel",
            )
        if segment.frame != _ICRF:
            raise DataError(
                f"{self.path.name}: the segment of NAIF number {number} has NAIF frame "
                f"{segment.frame}",
                allowed="frame 1 (J2000, ICRF axes)",
                do="convert the kernel",
            )


def _open(path: Path) -> Any:
    try:
        from jplephem.spk import SPK  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError as exc:
        raise ConfigError(
            "JPL kernels need the package jplephem, which is not installed",
            do="run: pip install 'unmodeled[planets]'",
        ) from exc
    if not path.is_file():
        raise DataError(
            f"there is no kernel {path}",
            do="check the path; kernels are published at "
            "https://naif.jpl.nasa.gov/pub/naif/generic_kernels/spk/planets",
        )
    try:
        kernel = SPK.open(str(path))
    except (ValueError, struct.error, OSError) as exc:
        raise DataError(
            f"{path} is not a kernel, or its head is damaged ({exc})",
            allowed="a binary SPK file (.bsp)",
            do="download it again",
        ) from exc
    last = max((segment.end_i for segment in kernel.segments), default=0)
    size = path.stat().st_size
    if size < 8 * last or not last:
        kernel.close()
        raise DataError(
            f"kernel {path} is truncated: {size} bytes",
            allowed=f"at least {8 * last} bytes" if last else "a file with segments",
            do="download it again",
        )
    return kernel


def _date(jd: float) -> str:
    year, month, day, _ = erfa.jd2cal(float(jd), 0.0)
    return f"{int(year):04d}-{int(month):02d}-{int(day):02d}"
