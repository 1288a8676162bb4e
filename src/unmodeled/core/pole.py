"""The direction of a body's spin axis and its prime meridian."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError
from unmodeled.core.frames import rotation_about_x, rotation_about_z
from unmodeled.core.time import seconds_between

__all__ = ["Pole"]

_J2000 = "2000-01-01T12:00:00 TDB"


@dataclass(frozen=True)
class Pole:
    """A spin axis fixed among the stars, after the IAU's convention.

    Precession, nutation and libration are left out: a card says how much they are.

    Parameters
    ----------
    right_ascension, declination : float
        Of the axis about which the spin is ``spin_rate`` (north pole of a body card with a
        positive rate), ICRF, rad.
    prime_meridian : float
        W at J2000 TDB: angle along the equator from its ascending node on the ICRF's xy-plane to
        the prime meridian, rad.

    Raises
    ------
    ConfigError
        If a value is not finite or the declination exceeds 90 degrees.

    Notes
    -----
    [Archinal2011] Fig. 1 and section 2: the node lies at right ascension ``right_ascension`` + 90
    degrees.
    """

    right_ascension: float
    declination: float
    prime_meridian: float = 0.0

    def __post_init__(self) -> None:
        for name in ("right_ascension", "declination", "prime_meridian"):
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(
                    f"pole: {name} is {getattr(self, name)}", allowed="a finite number"
                )
        if abs(self.declination) > math.pi / 2:
            raise ConfigError(
                f"pole: declination is {math.degrees(self.declination):g} degrees",
                allowed="-90 to 90 degrees",
            )

    @classmethod
    def from_degrees(
        cls, right_ascension_deg: float, declination_deg: float, prime_meridian_deg: float = 0.0
    ) -> Pole:
        """Return the pole of angles in degrees, the unit of published tables."""
        return cls(
            math.radians(right_ascension_deg),
            math.radians(declination_deg),
            math.radians(prime_meridian_deg),
        )

    @property
    def axis(self) -> Array:
        """Unit vector of the pole along ICRF axes, (3,)."""
        axis: Array = self.matrix()[2]
        return axis

    def matrix(self) -> Array:
        """Rotation from ICRF axes to the body's equatorial axes, (3, 3).

        R1(90 deg - declination) R3(90 deg + right ascension): z along the pole, x along the
        ascending node of the equator on the ICRF's xy-plane. The axes do not spin.

        Examples
        --------
        >>> np.round(Pole(0.0, np.pi / 2).matrix(), 12) + 0.0
        array([[ 0.,  1.,  0.],
               [-1.,  0.,  0.],
               [ 0.,  0.,  1.]])
        """
        tilt = rotation_about_x(math.pi / 2 - self.declination)
        turned: Array = tilt @ rotation_about_z(math.pi / 2 + self.right_ascension)
        return turned

    def body_fixed_from_icrf(self, epoch: str, times: npt.ArrayLike, spin_rate: float) -> Array:
        """Rotation from ICRF axes into the spinning body.

        Parameters
        ----------
        epoch : str
            Time zero with its scale.
        times : array_like (n,)
            SI seconds since it.
        spin_rate : float
            Rad/s about the pole.

        Returns
        -------
        ndarray (n, 3, 3)
            R3(W(t)) times :meth:`matrix`, with W(t) = W + ``spin_rate`` (t - J2000).

        Raises
        ------
        DataError
            If the epoch or the times cannot be read.
        """
        seconds = as_array(times, ("n",), "times")
        start = math.fmod(spin_rate * seconds_between(_J2000, epoch), 2 * math.pi)
        angle = np.asarray(self.prime_meridian + start + spin_rate * seconds)
        turned: Array = rotation_about_z(angle) @ self.matrix()
        return turned
