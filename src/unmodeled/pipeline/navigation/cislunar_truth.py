"""Truth of a flight near the Moon: Earth, Moon, Sun and sunlight; the filter knows two of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

from unmodeled.core.arrays import Array
from unmodeled.core.errors import OrbitError
from unmodeled.models.physics.motion import RestrictedThreeBody
from unmodeled.pipeline.navigation.flight import Flight, Scale
from unmodeled.pipeline.navigation.scenario_config import CislunarConfig

__all__ = ["MOON_RADIUS_M", "RangeAndRate", "cislunar_flight"]

#: Distance of the primaries, m, and 1 / their mean motion, s, that [Fereoli2024] counts in:
#: 5e-5 are 18.76 s and 0.5 are 2.17 days.
LENGTH, TIME = 384_400e3, 375_190.0
MOON_RADIUS_M = 1_737_400.0
#: Mass of the Sun in masses of Earth and Moon, [Simo1995].
SUN_MASS = 328_900.54


@dataclass(frozen=True)
class RangeAndRate:
    """Range and range rate from the origin, [Fereoli2024] Eq. 10 to 16, without its slips.

    Parameters
    ----------
    range_sigma, rate_sigma : float
        In the units of the states.
    """

    range_sigma: float
    rate_sigma: float

    @property
    def R(self) -> Array:  # noqa: N802
        """Covariance (2, 2)."""
        return np.diag([self.range_sigma**2, self.rate_sigma**2])

    def h(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return range and rate (b, 2) and their partials (b, 2, n)."""
        r, v = x[:, :3], x[:, 3:6]
        distance = np.sqrt((r * r).sum(axis=1))
        unit = r / distance[:, None]
        rate = (unit * v).sum(axis=1)
        H = np.zeros((len(x), 2, x.shape[1]))
        H[:, 0, :3] = H[:, 1, 3:6] = unit
        H[:, 1, :3] = (v - rate[:, None] * unit) / distance[:, None]
        return np.stack([distance, rate], axis=1), H


def cislunar_flight(config: CislunarConfig) -> Flight:
    """Fly the bicircular problem with sunlight; the base knows Earth and Moon.

    Raises
    ------
    OrbitError
        If the orbit cannot be integrated.
    """
    full = RestrictedThreeBody(config.mass_share, sun_mass=SUN_MASS, push=config.push)
    base = replace(full, sun_mass=0.0, push=0.0)
    times: Array = np.arange(config.steps + 1, dtype=np.float64) * config.step
    found = solve_ivp(
        lambda t, x: full.rates(x[None], t)[0][0],
        (0.0, times[-1]),
        [*config.position, *config.velocity],
        method="DOP853",
        t_eval=times,
        rtol=3e-14,
        atol=1e-16,
    )
    if not found.success:
        raise OrbitError(f"the orbit was not integrated ({found.message})")
    truth = found.y.T
    used = np.ones(len(times), dtype=bool)
    used[0] = False
    lowest = np.linalg.norm(truth[:, :3] - [1.0 - config.mass_share, 0, 0], axis=1).min() * LENGTH
    # nothing pulls out of the plane: a state that is known exactly gets no first error
    plane = not np.any(truth[:, [2, 5]])
    sigma = np.repeat(config.start_sigma, 3).astype(float)
    if plane:
        sigma[[2, 5]] = 0.0
    return Flight(
        name=config.name,
        title="flight near the Moon",
        times=times,
        truth=truth,
        disturbance=np.concatenate(
            [full.disturbance(x[None], float(t)) for x, t in zip(truth, times, strict=True)]
        ),
        base=base,
        exact=full,
        measurement=RangeAndRate(config.range_sigma, config.rate_sigma),
        used=used,
        start_sigma=sigma,
        believed_sigma=np.where(sigma > 0.0, sigma, 1e-12),
        settle=config.settle * float(times[-1]),
        longest=config.step / 2.0,
        scale=Scale(LENGTH, TIME),
        facts={"lowest_above_moon_m": float(lowest) - MOON_RADIUS_M},
    )
