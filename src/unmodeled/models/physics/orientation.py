"""How the body is turned: spin about a pole that may move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import chebyshev

from unmodeled.core.arrays import Array, as_array
from unmodeled.models.physics.tracks import fit_series

__all__ = ["Orientation"]


@dataclass(frozen=True)
class Orientation:
    r"""Rotation from inertial to body-fixed axes.

    .. math::
        R(t) = W \; R_3(\lambda_0 + \omega t) \; Q(t)

    Q turns inertial axes to the equator of the body and moves slowly (precession, nutation); the
    spin is fast and exact; W is fixed in the body (polar motion). The form is that of the
    celestial-to-terrestrial transformation, [IERS2010] Eq. 5.1.

    Parameters
    ----------
    spin_rate : float
        omega, rad/s.
    prime_meridian : float
        lambda_0, rad, at time zero.
    start, end : float
        Interval of the series, s.
    slow : ndarray (d + 1, 3, 3)
        Chebyshev coefficients of the elements of Q.
    fixed : ndarray (3, 3)
        W.
    """

    spin_rate: float
    prime_meridian: float = 0.0
    start: float = -1e30
    end: float = 1e30
    slow: Array = field(default_factory=lambda: np.eye(3)[None])
    fixed: Array = field(default_factory=lambda: np.eye(3))

    @classmethod
    def of_pole(
        cls, equator_from_inertial: Array, spin_rate: float, prime_meridian: float
    ) -> Orientation:
        """Return the rotation about a pole that stays: Q is constant."""
        turn = as_array(equator_from_inertial, (3, 3), "pole matrix")
        return cls(spin_rate, prime_meridian, slow=turn[None])

    @classmethod
    def fit(
        cls,
        body_from_inertial: Callable[[Array], Array],
        spin_rate: float,
        start: float,
        end: float,
        tolerance: float = 3e-8,
    ) -> Orientation:
        """Fit the form to rotations that a theory gives.

        Parameters
        ----------
        body_from_inertial : callable
            Takes times (n,) and returns rotations (n, 3, 3).
        spin_rate : float
            Approximate rate, rad/s; the slow part takes up the rest.
        start, end : float
            Interval, s.
        tolerance : float
            Largest error of an element of Q. W is the mean place of the body's own pole over the
            interval; what polar motion does within it (5e-9 rad a day on the Earth) is left out.
        """
        middle = 0.5 * (start + end)
        # The pole of rotation in body axes: the direction that stays put while the body turns.
        rotations = np.asarray(body_from_inertial(middle + np.arange(24) * np.pi / 12 / spin_rate))
        axis = np.mean(rotations @ rotations[0].T, axis=0)
        pole = np.linalg.svd(axis)[0][:, 0]
        pole = pole * np.sign(pole[2])
        wobble = _least_rotation(pole)

        def slow(times: Array) -> Array:
            turn = wobble.T @ np.asarray(body_from_inertial(times))
            back = np.swapaxes(_about_z(spin_rate * (times - middle)), 1, 2)
            flat: Array = (back @ turn).reshape(-1, 9)
            return flat

        series = fit_series({"slow": slow}, start, end, tolerance)["slow"]
        return cls(spin_rate, -spin_rate * middle, start, end, series.reshape(-1, 3, 3), wobble)

    @property
    def degree(self) -> int:
        """Degree of the series of Q."""
        return len(self.slow) - 1

    def matrices(self, times: Array) -> Array:
        """Return body_from_inertial (n, 3, 3)."""
        times = as_array(times, ("n",), "times")
        scaled = (2.0 * times - self.start - self.end) / (self.end - self.start)
        slow = np.moveaxis(chebyshev.chebval(scaled, self.slow), -1, 0)
        turned: Array = self.fixed @ _about_z(self.prime_meridian + self.spin_rate * times) @ slow
        return turned


def _about_z(angles: Array) -> Array:
    c, s = np.cos(angles), np.sin(angles)
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [[c, s, zero], [-s, c, zero], [zero, zero, one]]
    return np.moveaxis(np.array(rows), -1, 0)


def _least_rotation(pole: Array) -> Array:
    """Rotation W by the least angle with W e_z = pole."""
    x, y, z = pole
    k = 1.0 / (1.0 + z)
    return np.array([[1 - k * x * x, -k * x * y, x], [-k * x * y, 1 - k * y * y, y], [-x, -y, z]])
