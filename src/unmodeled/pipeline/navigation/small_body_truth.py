"""Truth about a small body: its full field, a gap in the measurements, a transfer further down."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, OrbitError
from unmodeled.datasets.bodies import Body, load_body
from unmodeled.datasets.elements import state_from_elements
from unmodeled.models.physics import Dynamics, Effect, PointMass, SphericalHarmonics, Zonal
from unmodeled.models.physics.motion import CentralBody
from unmodeled.models.physics.spherical_harmonics import coefficient_names
from unmodeled.pipeline.filters.linear import LinearMeasurement
from unmodeled.pipeline.navigation.flight import Flight
from unmodeled.pipeline.navigation.scenario_config import SmallBodyConfig

__all__ = ["small_body_flight"]


@dataclass(frozen=True)
class _Compiled:
    """A compiled force model as rates."""

    dynamics: Dynamics

    @property
    def size(self) -> int:
        return 6

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        rate = np.hstack([x[:, 3:], self.dynamics.acceleration(x, t)])
        J = np.zeros((len(x), 6, 6))
        J[:, :3, 3:] = np.eye(3)
        J[:, 3:] = self.dynamics.state_partials(x, t)
        return rate, J


def small_body_flight(config: SmallBodyConfig) -> Flight:
    """Fly about the body: measure, gap, measure, transfer, coast.

    Raises
    ------
    ConfigError
        Phases out of order, unknown coefficients.
    OrbitError
        If the orbit goes below the Brillouin sphere, where no harmonic series holds.
    """
    body = load_body(config.body)
    start_gap, end_gap = config.gap_s
    at = config.transfer.at_s
    if not start_gap < end_gap <= at < at + config.transfer.coast_s:
        raise ConfigError(
            f"gap_s {start_gap:g} to {end_gap:g}, transfer {at:g}",
            allowed="first the gap, then the transfer",
        )
    dynamics = _field(body, config)
    o = config.orbit
    angles = np.radians([o.inclination_deg, o.node_deg, o.periapsis_deg, o.true_anomaly_deg])
    first = state_from_elements([[o.semi_major_axis_km * 1e3, o.eccentricity, *angles]], body.gm)[0]
    step = config.measured.step_s
    times = np.arange(0.0, config.duration_s + 1e-6, step)
    k = round(at / step)
    high = dynamics.propagate(first, times[: k + 1])
    fired = _slowed(high[-1], body.gm, config.transfer.semi_major_axis_km * 1e3)
    low = dynamics.propagate(high[-1] + np.concatenate([np.zeros(3), fired]), times[k:])
    truth = np.vstack([high, low[1:]])
    lowest = float(np.linalg.norm(truth[:, :3], axis=1).min())
    if lowest < body.brillouin_radius:
        raise OrbitError(
            f"the orbit comes down to {lowest:.0f} m",
            allowed=f"above the Brillouin sphere of {body.title}, {body.brillouin_radius:.0f} m",
        )
    phases = {
        "gap": (start_gap, end_gap),
        "transfer": (float(times[k]), float(times[k]) + config.transfer.coast_s),
    }
    used = np.ones(len(times), dtype=bool)
    used[0] = False
    for start, end in phases.values():
        used &= ~((times > start) & (times <= end))
    base = CentralBody(body.gm * (1.0 + config.mass_error))
    m, sigma = config.measured, np.repeat([config.start.position_m, config.start.velocity_m_s], 3)
    columns = [0, 1, 2] if not m.velocity_m_s else [0, 1, 2, 3, 4, 5]
    sigmas = [m.position_m] * 3 + [m.velocity_m_s] * 3
    return Flight(
        name=config.name,
        title=f"proximity of {body.title}",
        times=times,
        truth=truth,
        disturbance=dynamics.acceleration(truth, times) - base.rates(truth, 0.0)[0][:, 3:],
        base=base,
        exact=_Compiled(dynamics),
        measurement=LinearMeasurement.of_sigma(columns, sigmas[: len(columns)], 6),
        used=used,
        start_sigma=sigma,
        believed_sigma=config.start.believed_factor * sigma,
        settle=config.settle_s,
        phases=phases,
        impulses=((float(times[k]), fired),),
        facts={
            "lowest_m": lowest,
            "gm": body.gm * (1.0 + config.mass_error),
            "radius": body.reference_radius,
            "spin_rate": (body.spin_rate or 0.0) if config.spins else 0.0,
        },
    )


def _field(body: Body, config: SmallBodyConfig) -> Dynamics:
    values = {"GM": body.gm, "R_ref": body.reference_radius}
    effects: list[Effect] = [PointMass()]
    if config.tesserals:
        degree = max(body.zonal_unnormalised())
        known = [n for n in coefficient_names(degree, None, 2) if not n.endswith("_0")]
        unknown = sorted(set(config.tesserals) - set(known))
        if unknown:
            raise ConfigError(f'tesserals has "{unknown[0]}"', allowed=", ".join(known))
        effects.append(SphericalHarmonics(degree))
        values |= {
            f"C_{n}_0": -j / np.sqrt(2 * n + 1) for n, j in body.zonal_unnormalised().items()
        }
        values |= config.tesserals
    else:
        effects.append(Zonal(tuple(body.zonal_unnormalised())))
        values |= {f"J{n}": j for n, j in body.zonal_unnormalised().items()}
    if config.spins:
        values |= {"spin_rate": body.spin_rate or 0.0, "prime_meridian": 0.0}
    return Dynamics(effects, values, spinning=config.spins)


def _slowed(state: Array, gm: float, semi_major_axis: float) -> Array:
    """Return the impulse (3,) along the track that gives an orbit another semi-major axis."""
    r, v = float(np.linalg.norm(state[:3])), float(np.linalg.norm(state[3:]))
    energy = 2.0 / r - 1.0 / semi_major_axis
    if energy <= 0.0:
        raise OrbitError(
            f"no orbit of semi-major axis {semi_major_axis:.0f} m passes {r:.0f} m",
            allowed=f"more than {r / 2:.0f} m",
        )
    impulse: Array = (np.sqrt(gm * energy) / v - 1.0) * state[3:]
    return impulse
