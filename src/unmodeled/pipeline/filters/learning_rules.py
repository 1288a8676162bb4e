"""Rules by which an RBF network learns in a filter: Lyapunov, gradient, physics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.algebra import times
from unmodeled.pipeline.filters.basis import RBFFeatures
from unmodeled.pipeline.filters.interfaces import RateModel
from unmodeled.pipeline.filters.learning_filter import network_acceleration
from unmodeled.pipeline.filters.state import Predicted, Updated

__all__ = ["GradientRule", "LyapunovRule", "PhysicsRule"]


@dataclass(frozen=True)
class LyapunovRule:
    r"""W <- psi W + h (eta/xi) Phi(x) e^T: [Pesce2020] Eq. 17 and 18, [Marchese2023] Eq. 3.91.

    e is the velocity part of the error of the estimate, as its correction K d tells it. With the
    whole state measured the papers take the innovation itself: ``raw``. In a gap the weights
    stay.

    Parameters
    ----------
    features : RBFFeatures
    rate : float
        eta / xi, 1/s2: acceleration a second for each m/s of error.
    relaxation : float
        psi, 1 forgets nothing.
    raw : bool
        Use the innovation; needs measurements that are the state, position and velocity.
    """

    features: RBFFeatures
    rate: float
    relaxation: float = 1.0
    raw: bool = False

    def __post_init__(self) -> None:
        _check(self.rate, self.relaxation)

    def weights(self, predicted: Predicted, updated: Updated) -> Array:
        """Return the next weights (b, M, 3)."""
        old = updated.state.memory["weights"]
        before = predicted.previous
        h = predicted.state.time - before.time
        if self.raw:
            if updated.innovation.shape[1] < 6:
                raise ConfigError(
                    f"{updated.innovation.shape[1]} measurements are not the state",
                    allowed="position and velocity measured",
                    do="use raw=False",
                )
            error = updated.innovation[:, 3:6]
        else:
            error = times(updated.gain, updated.innovation)[:, 3:6]
        phi, _ = self.features.evaluate(before.mean)
        new = self.relaxation * old + h * self.rate * phi[:, :, None] * error[:, None, :]
        return np.where(updated.accepted[:, None, None], new, old)


@dataclass(frozen=True)
class GradientRule:
    r"""One step down J = rho^T rho / 2, rho = z - H x+: [Marchese2023] Eq. 3.92 to 3.103.

    With the gain as given, d rho / d w_ij = -phi_i H (I - K H) Gamma_j, Gamma the response of
    the state to an acceleration held over the step (dt_EU Omega_ps of Eq. 3.97, here by
    `held_push`). The papers stop there. But the estimate also remembers what the same weights
    did to it in the steps before, which for a small gain is most of it: ``through_time`` takes
    the whole response, M = (I - K H) (F M + Gamma), and divides by its square, so that the rate
    depends neither on gain nor on units. In a gap the weights stay.

    Parameters
    ----------
    features : RBFFeatures
    rate : float
        xi. Through time, the share of the residual that one step would remove, well below 1;
        as printed, m^2/s^4 for each m^2, and too large a one makes the filter diverge.
    relaxation : float
        Psi.
    through_time : bool
        False for the printed rule.
    """

    features: RBFFeatures
    rate: float
    relaxation: float = 1.0
    through_time: bool = True

    def __post_init__(self) -> None:
        _check(self.rate, self.relaxation)

    def weights(self, predicted: Predicted, updated: Updated) -> Array:
        """Return the next weights (b, M, 3)."""
        old = updated.state.memory["weights"]
        step = self.rate * data_direction(self.features, predicted, updated, self.through_time)
        new = self.relaxation * old + step
        return np.where(updated.accepted[:, None, None], new, old)


@dataclass(frozen=True)
class PhysicsRule:
    r"""PINN: the data term of `GradientRule` and a penalty from known physics.

    J = w_data rho^T rho / 2 + w_ODE e^T e / 2, e = d - (f_physics - f_base) at the estimate:
    [Marchese2023] Eq. 3.104 to 3.120. The data term is off in gaps; the penalty is not, so the
    network goes on learning where nothing is measured.

    Parameters
    ----------
    features : RBFFeatures
    physics : RateModel
        The better model, e.g. nonlinear relative motion with J2: evaluated, never integrated.
        Its first six states are those of the filter.
    base : RateModel
        The filter's own.
    rate : float
        xi, of both terms, as in `GradientRule`.
    data_weight : float
        w_data, 0 to 1; w_ODE = 1 - w_data.
    relaxation : float
        Psi.
    through_time : bool
        As in `GradientRule`; the penalty is then divided by |phi|^2.
    """

    features: RBFFeatures
    physics: RateModel
    base: RateModel
    rate: float
    data_weight: float = 0.5
    relaxation: float = 1.0
    through_time: bool = True

    def __post_init__(self) -> None:
        _check(self.rate, self.relaxation)
        if not 0.0 <= self.data_weight <= 1.0:
            raise ConfigError(f"data_weight is {self.data_weight}", allowed="0 to 1")

    def weights(self, predicted: Predicted, updated: Updated) -> Array:
        """Return the next weights (b, M, 3)."""
        old = updated.state.memory["weights"]
        data = data_direction(self.features, predicted, updated, self.through_time)
        data = np.where(updated.accepted[:, None, None], data, 0.0)
        ode = self.physics_direction(predicted, updated)
        step = self.data_weight * data + (1.0 - self.data_weight) * ode
        return self.relaxation * old + self.rate * step

    def physics_direction(self, predicted: Predicted, updated: Updated) -> Array:
        """Return minus the gradient (b, M, 3) of the penalty: Eq. 3.115 to 3.120."""
        state, t = updated.state, updated.state.time
        x, W = state.mean, state.memory["weights"]
        d, J, phi = network_acceleration(self.features, x, W)
        known, A_known = self.physics.rates(x, t)
        own, A_own = self.base.rates(x, t)
        e = d - (known - own)[:, 3:6]
        n = x.shape[1]
        # the state, too, depends on the weights, through the step that led here
        left = np.eye(n) - updated.gain @ updated.design
        through = (J - (A_known - A_own)[:, 3:6, :n]) @ left @ predicted.state.memory["push"]
        before, _ = self.features.evaluate(predicted.previous.mean)
        pull = (e[:, None, :] @ through)[:, 0]
        gradient = phi[:, :, None] * e[:, None, :] + before[:, :, None] * pull[:, None, :]
        if self.through_time:
            square = (phi**2).sum(axis=1)
            gradient = gradient / square[:, None, None]
        return -gradient


def data_direction(
    features: RBFFeatures, predicted: Predicted, updated: Updated, through_time: bool
) -> Array:
    """Return minus the gradient (b, M, 3) of rho^T rho / 2: Eq. 3.102; see `GradientRule`."""
    H = np.where(updated.used[:, :, None], updated.design, 0.0)
    K = updated.gain
    rho = updated.innovation - times(H @ K, updated.innovation)
    if through_time:
        response = H @ updated.state.memory["response"]
    else:
        response = H @ (np.eye(K.shape[1]) - K @ H) @ predicted.state.memory["push"]
    g = (rho[:, None, :] @ response)[:, 0]
    phi, _ = features.evaluate(predicted.previous.mean)
    direction: Array = phi[:, :, None] * g[:, None, :]
    if through_time:
        size = np.linalg.norm(response, ord=2, axis=(1, 2)) ** 2 * (phi**2).sum(axis=1)
        direction = direction / np.maximum(size, np.finfo(float).tiny)[:, None, None]
    return direction


def _check(rate: float, relaxation: float) -> None:
    if not rate > 0.0:
        raise ConfigError(f"rate is {rate}", allowed="> 0")
    if not 0.0 < relaxation <= 1.0:
        raise ConfigError(f"relaxation is {relaxation}", allowed="0 < relaxation <= 1")
