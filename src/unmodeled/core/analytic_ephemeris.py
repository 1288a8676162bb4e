"""Sun, Moon and planets from series: no file, no network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar

import erfa
import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.constants import ASTRONOMICAL_UNIT
from unmodeled.core.ephemeris_pairs import PLANETS, check_pair
from unmodeled.core.errors import DataError
from unmodeled.core.kepler_orbit import HeliocentricOrbit
from unmodeled.core.time import terrestrial_time

__all__ = ["AnalyticEphemeris"]

# Numbers of the planets in erfa.plan94; its 3 is the Earth-Moon barycentre and is not used.
_PLAN94 = {"mercury": 1, "venus": 2, "mars": 4, "jupiter": 5, "saturn": 6, "uranus": 7}
_PLAN94["neptune"] = 8
# erfa.epv00 is stated for 1900 to 2100; erfa.plan94 would reach further.
_FIRST_JD, _LAST_JD = 2_415_020.5, 2_488_069.5


@dataclass(frozen=True)
class AnalyticEphemeris:
    r"""Series of the SOFA collection, and two-body orbits for small bodies.

    Earth: ``erfa.epv00`` (VSOP2000); Moon: ``erfa.moon98`` [Meeus1998]; planets: ``erfa.plan94``
    [Simon1994]. From 1900 to 2100. Planets from Mars outwards stand for planet and satellites.
    Difference to DE421 [Folkner2009] at 4000 random instants, 1990 to 2040, root mean square and
    largest:

    ======= =========== =========== ================================
    body    RMS, km     largest, km largest, relative to its distance
    ======= =========== =========== ================================
    earth   3.6         11          7e-8 (relative to the Sun)
    moon    6.3         31          9e-5 (relative to the Earth)
    mercury 330         1150        2.3e-5
    venus   1080        2730        2.6e-5
    mars    7600        26900       1.3e-4
    jupiter 75000       172000      2.3e-4
    saturn  236000      536000      4.0e-4
    uranus  339000      723000      2.6e-4
    neptune 96000       143000      3.2e-5
    ======= =========== =========== ================================

    So the Moon's tidal acceleration is right to 3e-4, the Sun's to 3e-7. TT stands for TDB (they
    differ by less than 2 ms, 0.1 km for the fastest planet), and the axes of the series for those
    of the ICRF (planets: 0.02 arcseconds): both far below the table.

    Parameters
    ----------
    small_bodies : mapping of str to HeliocentricOrbit
        Further bodies, by name.
    """

    small_bodies: Mapping[str, HeliocentricOrbit] = field(default_factory=dict)

    span: ClassVar[str] = "1900-01-01 to 2100-01-01"

    def __post_init__(self) -> None:
        named = {name.lower(): orbit for name, orbit in self.small_bodies.items()}
        object.__setattr__(self, "small_bodies", MappingProxyType(named))

    def __reduce__(self) -> tuple[Any, ...]:
        # Read-only views cannot be pickled.
        return AnalyticEphemeris, (dict(self.small_bodies),)

    @property
    def source(self) -> str:
        """One line for provenance."""
        small = f"; two-body: {', '.join(self.small_bodies)}" if self.small_bodies else ""
        return f"analytic: epv00, moon98, plan94 of pyerfa {erfa.__version__}{small}"

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names that may be asked for."""
        return (*PLANETS, *self.small_bodies)

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
            If a name is unknown, both are the same, the epoch cannot be read, or a time lies
            outside 1900 to 2100.

        Examples
        --------
        >>> r = AnalyticEphemeris().position("sun", "earth", "2019-01-03T05:20:00 UTC", [0.0])
        >>> float(np.round(np.linalg.norm(r) / 1.495978707e11, 4))  # perihelion of the Earth
        0.9833
        """
        pair = check_pair(body, centre, self.bodies, "analytic")
        seconds = as_array(times, ("n",), "times")
        stamps = terrestrial_time(epoch, seconds)
        dates = np.asarray(stamps.jd1, dtype=float), np.asarray(stamps.jd2, dtype=float)
        self._check_span(dates[0] + dates[1], epoch)
        # The small vector is not left to be the difference of two large ones.
        if set(pair) == {"earth", "moon"}:
            sign = 1.0 if pair[0] == "moon" else -1.0
            return sign * _moon(*dates)
        return self._heliocentric(pair[0], epoch, seconds, dates) - self._heliocentric(
            pair[1], epoch, seconds, dates
        )

    def _heliocentric(
        self, name: str, epoch: str, seconds: Array, dates: tuple[Array, Array]
    ) -> Array:
        if name == "sun":
            return np.zeros((len(seconds), 3))
        if name in self.small_bodies:
            return self.small_bodies[name].position(epoch, seconds)
        if name in _PLAN94:
            return _metres(erfa.plan94(*dates, _PLAN94[name])["p"])
        earth = _metres(erfa.epv00(*dates)[0]["p"])
        return earth + _moon(*dates) if name == "moon" else earth

    def _check_span(self, jd: Array, epoch: str) -> None:
        if len(jd) and not (jd.min() >= _FIRST_JD and jd.max() <= _LAST_JD):
            raise DataError(
                f"times since {epoch} reach from Julian date {jd.min():.1f} to {jd.max():.1f}, "
                "outside the analytic series",
                allowed=self.span,
                do="check the epoch, or give a JPL kernel that covers it",
            )


def _moon(one: Array, two: Array) -> Array:
    return _metres(erfa.moon98(one, two)["p"])


def _metres(position: Any) -> Array:
    return np.asarray(position, dtype=np.float64) * ASTRONOMICAL_UNIT.value
