"""Nonlinear relative motion about an oblate body, exact for a point mass with J2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.physics.motion.reference_orbit import Oblate

__all__ = ["Reference", "XuWang", "frame_rates", "xu_wang_rates"]


class Reference(Protocol):
    """The target's orbit: `ReferenceOrbit`, or `MeasuredReference` as on board."""

    @property
    def body(self) -> Oblate:
        """What the target flies about."""
        ...

    def at(self, t: float | Array) -> Array:
        """Return the five variables (5,) at ``t``, s, or (k, 5) at times (k,)."""
        ...


@dataclass(frozen=True)
class XuWang:
    r"""Xu-Wang equations: relative motion in the target's RTN axes under J2, no linearisation.

    .. math::
        \ddot{\mathbf r} = \mathbf g(\mathbf r_A + \mathbf r) - \mathbf g(\mathbf r_A)
        - 2\,\boldsymbol\omega\times\dot{\mathbf r} - \boldsymbol\alpha\times\mathbf r
        - \boldsymbol\omega\times(\boldsymbol\omega\times\mathbf r), \quad
        \mathbf g = -n_B^2\,\mathbf r_B - \zeta_B\,\hat{\mathbf K}

    which is [Marchese2023] Eq. 3.32-3.34 written with vectors ([XuWang2008]). Two slips of
    [Pesce2020] Eq. 32 are mended: the angle is the argument of latitude, and the first term of
    alpha_x has a minus sign.

    Parameters
    ----------
    reference : Reference
        The target's orbit.
    """

    reference: Reference

    @property
    def size(self) -> int:
        """Six: relative position and velocity."""
        return 6

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, 6) and its Jacobian (b, 6, 6) at ``t``, s."""
        return xu_wang_rates(x, self.reference.at(t), self.reference.body)

    def linear(self, times: Array) -> Array:
        """Return the Jacobians (k, 6, 6) of the rates at the target itself, at ``times`` (k,), s.

        dx/dt = A(t) x is the motion of a near chaser about an eccentric orbit under J2; what it
        leaves out is of the order of distance over radius.
        """
        c, body = self.reference.at(times), self.reference.body
        omega, alpha = frame_rates(c.T, body)
        W, turn = _cross(omega), _cross(alpha)
        place = np.zeros((len(c), 3))
        place[:, 0] = c[:, 0]
        _, gradient = _gravity(place, _pole(c.T), body)
        A = np.zeros((len(c), 6, 6))
        A[:, :3, 3:] = np.eye(3)
        A[:, 3:, :3] = gradient - turn - W @ W
        A[:, 3:, 3:] = -2.0 * W
        return A


def frame_rates(c: Array, body: Oblate) -> tuple[Array, Array]:
    """Return angular velocity and acceleration of the target's axes, (..., 3) in those axes.

    Along the radius: what J2 does to the plane; along the normal: h / r^2.
    """
    r, rate, h, i, u = c
    k, si, ci, su, cu = body.k, np.sin(i), np.cos(i), np.sin(u), np.cos(u)
    s2i = 2.0 * si * ci
    none = np.zeros_like(r)
    omega = np.stack([-k * s2i * su / (h * r**3), none, h / r**2], axis=-1)
    alpha = np.stack(
        [
            -k * s2i * cu / r**5
            + 3.0 * rate * k * s2i * su / (r**4 * h)
            - 8.0 * k**2 * si**3 * ci * su**2 * cu / (r**6 * h**2),
            none,
            -2.0 * h * rate / r**3 - k * si**2 * 2.0 * su * cu / r**5,
        ],
        axis=-1,
    )
    return omega, alpha


def xu_wang_rates(x: Array, c: Array, body: Oblate) -> tuple[Array, Array]:
    """Return dx/dt (b, 6) and d(dx/dt)/dx (b, 6, 6).

    Parameters
    ----------
    x : ndarray (b, 6)
        Relative states, m and m/s.
    c : ndarray (5,)
        Variables of the target's orbit.
    body : Oblate
    """
    r, pole = c[0], _pole(c)
    omega, alpha = frame_rates(c, body)
    W, turn = _cross(omega), _cross(alpha)
    by_position = -turn - W @ W
    by_velocity = -2.0 * W

    place = x[:, :3] + np.array([r, 0.0, 0.0])
    pull, gradient = _gravity(place, pole, body)
    own, _ = _gravity(np.array([[r, 0.0, 0.0]]), pole, body)
    out = np.empty_like(x)
    out[:, :3] = x[:, 3:]
    out[:, 3:] = pull - own + x[:, :3] @ by_position.T + x[:, 3:] @ by_velocity.T
    J = np.zeros((len(x), 6, 6), dtype=x.dtype)
    J[:, :3, 3:] = np.eye(3)
    J[:, 3:, :3] = gradient + by_position
    J[:, 3:, 3:] = by_velocity
    return out, J


def _pole(c: Array) -> Array:
    """Axis of the body (..., 3) in the target's axes."""
    si, u = np.sin(c[3]), c[4]
    return np.stack([si * np.sin(u), si * np.cos(u), np.cos(c[3])], axis=-1)


def _gravity(place: Array, pole: Array, body: Oblate) -> tuple[Array, Array]:
    """Attraction (b, 3) and its gradient (b, 3, 3) at ``place`` (b, 3) from the body's centre.

    The axis ``pole`` is (3,) or (b, 3).
    """
    k = body.k
    r2 = (place * place).sum(axis=1)
    r3 = r2 * np.sqrt(r2)
    r5 = r3 * r2
    r7 = r5 * r2
    Z = (place * pole).sum(axis=1)
    n2 = body.gm / r3 + k / r5 - 5.0 * k * Z * Z / r7
    zeta = 2.0 * k * Z / r5
    pull = -n2[:, None] * place - zeta[:, None] * pole
    along = -3.0 * body.gm / r5 - 5.0 * k / r7 + 35.0 * k * Z * Z / (r7 * r2)
    mixed = -10.0 * k * Z / r7
    grad_n2 = along[:, None] * place + mixed[:, None] * pole
    grad_zeta = (2.0 * k / r5)[:, None] * pole + mixed[:, None] * place
    gradient = -place[:, :, None] * grad_n2[:, None, :] - pole[..., :, None] * grad_zeta[:, None, :]
    gradient -= n2[:, None, None] * np.eye(3)
    return pull, gradient


def _cross(v: Array) -> Array:
    """Matrices (..., 3, 3) of the cross product with v (..., 3)."""
    out = np.zeros((*v.shape, 3), dtype=v.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., j, i], out[..., i, j] = v[..., k], -v[..., k]
    return out
