"""Compiled code of a system, kept for the life of the process.

A compilation takes from tenths of a second to seconds; everything here is therefore cached by
the system's structure. Numbers (parameters, states, radii) go in at run time. The cached objects
hold state while they work: one process, one thread.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import heyoka as hy

from unmodeled.core.errors import InputError
from unmodeled.models.physics.system import STATE_NAMES, System

# heyoka logs to stdout, where the answers go; every outcome of an integration is checked here.
hy.set_logger_level_critical()

__all__ = [
    "STOPS",
    "acceleration_function",
    "batch_integrator",
    "integrator",
    "parameter_partials_function",
    "potential_function",
    "state_partials_function",
    "variational_integrator",
]

# Compact mode compiles in tenths of a second; unrolled code of a small system runs 1.5 times
# faster and takes seconds to compile, which only many orbits pay back.
_COMPACT = {"compact_mode": True}

# Partial derivatives are asked at thousands of points at most: code that is not optimised is
# compiled in a quarter of the time and loses a few milliseconds a call.
_QUICK = {"compact_mode": True, "opt_level": 0}

#: When the integrators stopped at an edge of a force since the list was last emptied, s.
STOPS: list[float] = []

# Whether an orbit hits the body is asked of thousands of orbits; at this tolerance it costs half
# of full accuracy. Orbits that are used afterwards are propagated again at full accuracy.
_SCREENING_TOLERANCE = 1e-12


@lru_cache(maxsize=64)
def acceleration_function(system: System) -> Any:
    """Compile the acceleration: six state variables to 3 values."""
    return hy.cfunc(list(system.acceleration), list(system.state_symbols), **_COMPACT)


@lru_cache(maxsize=64)
def state_partials_function(system: System) -> Any:
    """Compile d acceleration / d state: six state variables to 3 x 6 values, row by row."""
    return _partials(system, system.state_symbols)


@lru_cache(maxsize=64)
def parameter_partials_function(system: System, parameters: tuple[str, ...]) -> Any:
    """Compile d acceleration / d parameter: six state variables to 3 x p values, row by row."""
    return _partials(system, [system.parameter_symbols[name] for name in parameters])


@lru_cache(maxsize=64)
def potential_function(system: System) -> Any:
    """Compile the force function U.

    Raises
    ------
    InputError
        If an effect of the system has no potential.
    """
    if system.potential is None:
        names = ", ".join(e.name for e in system.effects)
        raise InputError(f"not every effect of this force model has a potential ({names})")
    return hy.cfunc([system.potential], list(system.state_symbols), **_COMPACT)


@lru_cache(maxsize=32)
def integrator(system: System) -> Any:
    """Taylor integrator of one orbit; set ``time``, ``state`` and ``pars`` before use."""
    return hy.taylor_adaptive(
        system.equations, state=[1.0] * 6, t_events=_stops(system), **_COMPACT
    )


@lru_cache(maxsize=32)
def batch_integrator(system: System) -> Any:
    """Integrator of as many orbits at once as the processor has lanes.

    It stops an orbit that comes down through the sphere whose radius is the parameter after the
    last of the system.
    """
    x, y, z = system.state_symbols[:3]
    limit = hy.par[system.count]
    event = hy.t_event_batch(
        x * x + y * y + z * z - limit * limit, direction=hy.event_direction.negative
    )
    lanes = hy.recommended_simd_size()
    return hy.taylor_adaptive_batch(
        system.equations,
        state=[[1.0] * lanes] * 6,
        t_events=[event],
        tol=_SCREENING_TOLERANCE,
        **_COMPACT,
    )


@lru_cache(maxsize=32)
def variational_integrator(system: System, parameters: tuple[str, ...]) -> Any:
    """Integrator of state, state-transition matrix and sensitivities to ``parameters``."""
    symbols = [system.parameter_symbols[name] for name in parameters]
    equations = hy.var_ode_sys(system.equations, [*system.state_symbols, *symbols], order=1)
    return hy.taylor_adaptive(
        equations, state=[1.0] * len(STATE_NAMES), t_events=_stops(system), **_COMPACT
    )


def _partials(system: System, symbols: Sequence[Any]) -> Any:
    tensors = hy.diff_tensors(list(system.acceleration), list(symbols), diff_order=1)
    return hy.cfunc(tensors.jacobian.ravel().tolist(), list(system.state_symbols), **_QUICK)


def _stops(system: System) -> list[Any]:
    """Events at which a step ends and the next begins."""
    return [hy.t_event(edge, callback=_go_on) for edge in system.edges]


def _go_on(integrator: Any, _direction: int) -> bool:
    STOPS.append(float(integrator.time))
    return True
