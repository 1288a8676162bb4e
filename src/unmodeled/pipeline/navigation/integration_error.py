"""Errors of integrators of linear relative motion against its closed form: [Marchese2023] 3.3.1."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.models.physics.motion.clohessy_wiltshire import (
    clohessy_wiltshire_matrix,
    clohessy_wiltshire_transition,
)

__all__ = ["IntegrationError", "euler_transition", "integration_error", "runge_kutta_transition"]

#: Eq. 3.50; a circular orbit of radius 6,771 km about the Earth.
START = np.array([10.0, -1.0, 5.0, -0.01, 1e-3, -0.05])
MEAN_MOTION = math.sqrt(3.986004418e14 / 6771e3**3)
STEP_S, DURATION_S = 30.0, 36_000.0


@dataclass(frozen=True)
class IntegrationError:
    """How far a transition of one step, applied again and again, leads from the closed form.

    Parameters
    ----------
    times : ndarray (k,)
        s.
    position, velocity : ndarray (k,)
        Lengths of the errors, m and m/s.
    milliseconds : float
        Time to make the transition and apply it to all steps.
    """

    times: Array
    position: Array
    velocity: Array
    milliseconds: float


def integration_error(
    make: Callable[[], Array], step: float = STEP_S, duration: float = DURATION_S
) -> IntegrationError:
    """Return the error of a transition matrix, as a filter without measurements makes it.

    Parameters
    ----------
    make : callable
        Returns the transition (6, 6) over ``step``.
    step, duration : float
        s.
    """
    count = round(duration / step)
    began = time.perf_counter()
    F = make()
    x = np.empty((count, 6))
    before = START
    for k in range(count):
        x[k] = before = F @ before
    spent = time.perf_counter() - began
    times = step * np.arange(1.0, count + 1.0)
    exact = np.stack([clohessy_wiltshire_transition(MEAN_MOTION, float(t)) @ START for t in times])
    error = x - exact
    return IntegrationError(
        times,
        np.linalg.norm(error[:, :3], axis=1),
        np.linalg.norm(error[:, 3:], axis=1),
        1e3 * spent,
    )


def euler_transition(dt: float, step: float = STEP_S) -> Array:
    """Return (I + dt A)^(step / dt): Eq. 3.47.

    Raises
    ------
    ConfigError
        If ``dt`` does not divide the step.
    """
    count = round(step / dt)
    if count < 1 or not math.isclose(count * dt, step, rel_tol=1e-9):
        raise ConfigError(f"an Euler step of {dt:g} s", allowed=f"a whole share of {step:g} s")
    A = clohessy_wiltshire_matrix(MEAN_MOTION)
    return np.linalg.matrix_power(np.eye(6) + dt * A, count)


def runge_kutta_transition(rtol: float = 1e-3, atol: float = 1e-6, step: float = STEP_S) -> Array:
    """Return the solution of Eq. 3.49 by ``scipy``'s RK45 with the tolerances of the thesis."""
    A = clohessy_wiltshire_matrix(MEAN_MOTION)
    found = solve_ivp(
        lambda _, y: (A @ y.reshape(6, 6)).ravel(),
        (0.0, step),
        np.eye(6).ravel(),
        method="RK45",
        rtol=rtol,
        atol=atol,
    )
    transition: Array = found.y[:, -1].reshape(6, 6)
    return transition
