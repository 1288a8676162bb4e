"""The five variables of the target's orbit that the Xu-Wang equations need."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import ConfigError, DataError, NumericalError

__all__ = ["Oblate", "ReferenceOrbit", "reference_from_positions", "reference_variables"]


@dataclass(frozen=True)
class Oblate:
    """Point mass with J2, axis along z.

    Parameters
    ----------
    gm : float
        m3/s2.
    j2 : float
        Unnormalised.
    radius : float
        Reference radius of J2, m.
    """

    gm: float
    j2: float
    radius: float

    def __post_init__(self) -> None:
        if not (self.gm > 0 and self.radius > 0):
            raise ConfigError(f"GM {self.gm} and radius {self.radius}", allowed="numbers > 0")

    @property
    def k(self) -> float:
        """3/2 J2 GM R^2, m5/s2."""
        return 1.5 * self.j2 * self.gm * self.radius**2


def reference_variables(states: npt.ArrayLike) -> Array:
    """Return radius, its rate, angular momentum, inclination and **argument of latitude**.

    Parameters
    ----------
    states : array_like (n, 6)
        Inertial states of the target, z along the axis of J2, m and m/s.

    Returns
    -------
    ndarray (n, 5)
        m, m/s, m2/s, rad, rad (continuous along the rows).

    Raises
    ------
    DataError
        If a state has no orbital plane or lies in the plane of the equator: no node.

    Notes
    -----
    [Marchese2023] Eq. 3.108 prints the true anomaly for the last one, with which the model is
    wrong by 2.8e-4 m/s2 on its own orbit: J2 knows the equator, not the perigee.
    """
    s = as_array(states, ("n", 6), "states")
    r = np.linalg.norm(s[:, :3], axis=1)
    h = np.cross(s[:, :3], s[:, 3:])
    size = np.linalg.norm(h, axis=1)
    in_plane = np.hypot(h[:, 0], h[:, 1])
    if np.any(in_plane == 0.0):
        raise DataError(
            f"state {int(np.argmin(in_plane))} lies in the plane of the equator, or has no plane",
            allowed="an inclined orbit: the argument of latitude is counted from the node",
        )
    inclination = np.arctan2(in_plane, h[:, 2])
    node = np.stack([-h[:, 1], h[:, 0], np.zeros_like(r)], axis=1) / in_plane[:, None]
    across = np.cross(h / size[:, None], node)
    latitude = np.arctan2((s[:, :3] * across).sum(axis=1), (s[:, :3] * node).sum(axis=1))
    rate = (s[:, :3] * s[:, 3:]).sum(axis=1) / r
    return np.stack([r, rate, size, inclination, np.unwrap(latitude)], axis=1)


def reference_from_positions(times: npt.ArrayLike, positions: npt.ArrayLike) -> Array:
    """Return the variables (n, 5) from positions alone, velocities by central differences.

    Parameters
    ----------
    times : array_like (n,)
        s, at least three.
    positions : array_like (n, 3)
        Inertial positions of the target, measured, m.

    Notes
    -----
    [Marchese2023] Eq. 3.38 and 3.108, with the argument of latitude.
    """
    t = as_array(times, ("n",), "times")
    r = as_array(positions, ("n", 3), "positions")
    if len(t) < 3:
        raise DataError(f"{len(t)} positions", allowed="three or more to take differences")
    check_increasing(t, "times")
    return reference_variables(np.hstack([r, np.gradient(r, t, axis=0, edge_order=2)]))


@dataclass(frozen=True)
class ReferenceOrbit:
    """The five variables as functions of time.

    Parameters
    ----------
    times : ndarray (n,)
        s, increasing.
    values : ndarray (n, 5)
        As `reference_variables` gives them.
    body : Oblate
        Gives their rates, between which cubics pass.
    """

    times: Array
    values: Array
    body: Oblate
    _spline: CubicHermiteSpline = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        t = as_array(self.times, ("n",), "times")
        check_increasing(t, "times")
        c = as_array(self.values, (len(t), 5), "reference variables")
        rates = reference_rates(c.T, self.body).T
        object.__setattr__(self, "_spline", CubicHermiteSpline(t, c, rates))

    @classmethod
    def from_states(
        cls, times: npt.ArrayLike, states: npt.ArrayLike, body: Oblate
    ) -> ReferenceOrbit:
        """Return the variables of a known orbit of the target (states (n, 6), inertial)."""
        return cls(np.asarray(times, dtype=float), reference_variables(states), body)

    @classmethod
    def integrated(cls, start: npt.ArrayLike, times: npt.ArrayLike, body: Oblate) -> ReferenceOrbit:
        """Integrate the variables from their values (5,) at the first of ``times`` (n,).

        Raises
        ------
        NumericalError
            If the integration fails.
        """
        t = as_array(times, ("n",), "times")
        found = solve_ivp(
            lambda _, c: reference_rates(c, body),
            (t[0], t[-1]),
            as_array(start, (5,), "start"),
            method="DOP853",
            t_eval=t,
            rtol=1e-12,
            atol=[1e-6, 1e-9, 1e-2, 1e-14, 1e-13],
        )
        if not found.success:
            raise NumericalError(f"the target's orbit was not integrated ({found.message})")
        return cls(t, found.y.T, body)

    def at(self, t: float | Array) -> Array:
        """Return the variables (5,) at one time, s, or (k, 5) at times (k,).

        Raises
        ------
        DataError
            Outside the interval.
        """
        low, high = (t, t) if isinstance(t, float) else (np.min(t), np.max(t))
        if not (self.times[0] <= low and high <= self.times[-1]):
            wrong = low if low < self.times[0] else high
            raise DataError(
                f"time {wrong:g} s",
                allowed=f"{self.times[0]:g} to {self.times[-1]:g} s, as the orbit",
            )
        values: Array = self._spline(np.asarray(t, dtype=np.float64))
        return values


def reference_rates(c: Array, body: Oblate) -> Array:
    """Return the rates of change of c (5, ...) under J2, [Marchese2023] Eq. 3.35."""
    r, rate, h, i, u = c
    si, su, k = np.sin(i), np.sin(u), body.k
    return np.stack(
        [
            rate,
            -body.gm / r**2 + h**2 / r**3 - k / r**4 * (1.0 - 3.0 * si**2 * su**2),
            -k * si**2 * np.sin(2 * u) / r**3,
            -k * np.sin(2 * i) * np.sin(2 * u) / (2.0 * h * r**3),
            h / r**2 + 2.0 * k * np.cos(i) ** 2 * su**2 / (h * r**3),
        ]
    )
