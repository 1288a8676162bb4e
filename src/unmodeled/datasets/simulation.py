"""True orbits about a body, propagated with heyoka and with the paper's RK4."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.datasets.bodies import Body
from unmodeled.datasets.elements import kepler_period
from unmodeled.datasets.runge_kutta import propagate_rk4
from unmodeled.datasets.trajectory import Trajectory
from unmodeled.models.physics import Dynamics, PointMass, Zonal
from unmodeled.models.physics.effect import Effect

__all__ = ["SimulatedOrbits", "gravity_of", "simulate_orbits"]


@dataclass(frozen=True)
class SimulatedOrbits:
    """True orbits and how well two integrators agree on them.

    Parameters
    ----------
    orbits : tuple of Trajectory
        SI, inertial, with exact accelerations.
    periods : tuple of float
        Kepler period of each at its initial condition, s.
    rk4_difference : ndarray (b,)
        Largest distance between the RK4 and the heyoka orbit, m; NaN if not compared.
    lowest_radius : ndarray (b,)
        Smallest sampled distance from the centre, m.
    """

    orbits: tuple[Trajectory, ...]
    periods: tuple[float, ...]
    rk4_difference: Array
    lowest_radius: Array


def gravity_of(body: Body) -> Dynamics:
    """Return the gravity field of a body card: point mass and zonal harmonics, SI.

    Axes: origin at the centre of mass, z along the pole, not rotating (a zonal field does not
    notice the spin).
    """
    zonals = body.zonal_unnormalised()
    effects: list[Effect] = [PointMass()]
    values = {"GM": body.gm}
    if zonals:
        effects.append(Zonal(tuple(sorted(zonals))))
        values |= {"R_ref": body.reference_radius} | {f"J{n}": j for n, j in zonals.items()}
    return Dynamics(effects, values)


def simulate_orbits(
    dynamics: Dynamics,
    elements: pd.DataFrame,
    states: Array,
    radius: float,
    *,
    periods: list[float],
    samples_per_period: int = 25,
    integrator: Literal["heyoka", "rk4"] = "heyoka",
    rk4_steps_per_period: int = 200,
    source: str = "simulated",
    compare: bool = True,
) -> SimulatedOrbits:
    """Propagate orbits and sample them evenly.

    Parameters
    ----------
    dynamics : Dynamics
        The true field, SI.
    elements : DataFrame (b rows)
        Initial elements; the semi-major axis (in units of ``radius``) sets the Kepler period.
    states : ndarray (b, 6)
        The same as states, m and m/s.
    radius : float
        Length unit of the elements, m.
    periods : list of float (b)
        How many Kepler periods to follow each orbit.
    samples_per_period : int
        Even sampling; [Neamati2022] uses 25.
    integrator : {"heyoka", "rk4"}
        Which orbit becomes the truth. heyoka keeps errors at rounding level; RK4 is the paper's.
    rk4_steps_per_period : int
        Steps of the RK4 orbit; a multiple of ``samples_per_period`` (the paper states no step).
    source : str
        Name given to the trajectories.
    compare : bool
        Whether to propagate the orbit that is not the truth too, and state the difference.
    """
    if samples_per_period < 4:
        raise ConfigError(f"samples_per_period is {samples_per_period}", allowed="4 or more")
    if dynamics.system.spinning and (compare or integrator == "rk4"):
        raise ConfigError(
            "the RK4 orbit of a field that turns with the body",
            allowed="integrator heyoka, without comparison",
            do="write data.integrator: heyoka",
        )
    steps, rest = divmod(rk4_steps_per_period, samples_per_period)
    if (compare or integrator == "rk4") and (rest or steps < 1):
        raise ConfigError(
            f"rk4_steps_per_period is {rk4_steps_per_period}",
            allowed=f"a multiple of samples_per_period ({samples_per_period})",
        )
    kepler = kepler_period(
        elements["semi_major_axis"].to_numpy(dtype=np.float64) * radius, dynamics.values["GM"]
    )
    orbits, differences = [], []
    for k, period in enumerate(kepler):
        n = round(periods[k] * samples_per_period)
        if n < 4:
            raise ConfigError(
                f"{periods[k]:g} periods with {samples_per_period} samples each give {n} samples",
                allowed="at least 4",
                do="use more periods or a higher data.samples_per_period",
            )
        spacing = period / samples_per_period
        times = spacing * np.arange(n)
        both = {}
        if compare or integrator == "heyoka":
            both["heyoka"] = dynamics.propagate(states[k], times)
        if compare or integrator == "rk4":
            start = states[k : k + 1], np.array([spacing])
            both["rk4"] = propagate_rk4(dynamics.acceleration, *start, n, steps)[0]
        differences.append(_largest_distance(both["heyoka"], both["rk4"]) if compare else np.nan)
        chosen = both[integrator]
        orbits.append(
            Trajectory(
                times,
                chosen[:, :3],
                chosen[:, 3:],
                dynamics.acceleration(chosen, times),
                source=f"{source} orbit {k}",
            )
        )
    return SimulatedOrbits(
        tuple(orbits),
        tuple(float(p) for p in kepler),
        np.array(differences),
        np.array([orbit.radii.min() for orbit in orbits]),
    )


def _largest_distance(one: Array, other: Array) -> float:
    """Between positions of the same times, m."""
    return float(np.linalg.norm(one[:, :3] - other[:, :3], axis=1).max())
