"""The field of a mass and a network: U = m / r + N(inputs) / r^p, and its slopes by the weights.

Dimensionless: lengths in radii of the reference sphere, U in GM / R. The unknowns are the mass m
first, then the weights of the network.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned._potential_inputs import DECAY, input_jet, power
from unmodeled.models.learned._potential_network import Jet, Network

__all__ = ["PotentialField", "shell"]


@dataclass(frozen=True)
class PotentialField:
    """Mass and network.

    Parameters
    ----------
    network : Network
        Of the inputs.
    inputs : {"kelvin", "direction"}
        See `input_jet`.
    """

    network: Network
    inputs: str

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return self.network.count + 1

    def potential(self, x: Array, unknowns: Array) -> Array:
        """Return U (n,)."""
        jet, factor, mass = self._jets(x, unknowns)
        value: Array = (mass.value + factor.value * jet.value)[:, 0]
        return value

    def acceleration(self, x: Array, unknowns: Array) -> Array:
        """Return grad U (n, 3)."""
        jet, factor, mass = self._jets(x, unknowns)
        return np.ascontiguousarray(_gradient(jet, factor, mass).T)

    def gradient(self, x: Array, unknowns: Array) -> Array:
        """Return the second derivatives of U (n, 3, 3)."""
        return self.acceleration_and_gradient(x, unknowns)[1]

    def acceleration_and_gradient(self, x: Array, unknowns: Array) -> tuple[Array, Array]:
        """Return first (n, 3) and second (n, 3, 3) derivatives of U in one pass."""
        jet, factor, mass = self._jets(x, unknowns, hessian=True)
        assert jet.hessian is not None
        assert factor.hessian is not None
        assert mass.hessian is not None
        cross = factor.gradient[:, None] * jet.gradient[None]
        total = mass.hessian + factor.hessian * jet.value + factor.value * jet.hessian
        total = total + cross + cross.swapaxes(0, 1)
        second = np.ascontiguousarray(total[..., 0].transpose(2, 0, 1))
        return np.ascontiguousarray(_gradient(jet, factor, mass).T), second

    def slopes(self, x: Array, unknowns: Array) -> tuple[Array, Array]:
        """Return grad U (n, 3) and its slopes by the unknowns (n, 3, count)."""
        weights = unknowns[1:]
        jet, kept = self.network.forward(weights, _flat(input_jet(self.inputs, x)))
        constant, lower = self._far_slopes(weights)
        jet = Jet(jet.value - constant, jet.gradient)
        factor, mass = power(x, DECAY[self.inputs], False), power(x, 1, False)
        slopes = np.empty((len(x), 3, self.count))
        slopes[:, :, 0] = mass.gradient[:, :, 0].T
        none = np.zeros(len(x))
        for i in range(3):
            along = np.zeros((3, len(x)))
            along[i] = factor.value[:, 0]
            own = factor.gradient[i, :, 0]
            slopes[:, i, 1:] = self.network.slopes(weights, kept, own, along, none)
            slopes[:, i, 1:] -= own[:, None] * lower
        scaled = Jet(unknowns[0] * mass.value, unknowns[0] * mass.gradient)
        return np.ascontiguousarray(_gradient(jet, factor, scaled).T), slopes

    def laplacian(self, x: Array, unknowns: Array) -> Array:
        """Return r^5 times the Laplacian of U (n,): in the ball of x / r^2 it is the network's."""
        jet, _ = self.network.forward(unknowns[1:], input_jet(self.inputs, x))
        value, gradient, laplacian = self._laplacian_factors(x)
        assert jet.laplacian is not None
        total = value * jet.value[:, 0] + (gradient * jet.gradient[:, :, 0]).sum(axis=0)
        return np.asarray(total + laplacian * jet.laplacian[:, 0])

    def laplacian_slopes(self, x: Array, unknowns: Array) -> tuple[Array, Array]:
        """Return `laplacian` (n,) and its slopes by the unknowns (n, count)."""
        jet, kept = self.network.forward(unknowns[1:], input_jet(self.inputs, x))
        value, gradient, laplacian = self._laplacian_factors(x)
        assert jet.laplacian is not None
        total = value * jet.value[:, 0] + (gradient * jet.gradient[:, :, 0]).sum(axis=0)
        total = total + laplacian * jet.laplacian[:, 0]
        slopes = np.zeros((len(x), self.count))
        slopes[:, 1:] = self.network.slopes(unknowns[1:], kept, value, gradient, laplacian)
        return total, slopes

    def _far_slopes(self, weights: Array) -> tuple[float, Array]:
        """Return the network's value at infinity and its slopes by the weights.

        It is taken off: there it would be a second mass. ``direction`` has the power 2 instead.
        """
        if self.inputs != "kelvin":
            return 0.0, np.zeros(len(weights))
        none, one = np.zeros((3, 1)), np.ones(1)
        jet, kept = self.network.forward(weights, Jet(none.T, np.zeros((3, 1, 3))))
        slopes = self.network.slopes(weights, kept, one, none, one)
        return float(jet.value[0, 0]), slopes[0]

    def _laplacian_factors(self, x: Array) -> tuple[Array, Array, Array]:
        factor, fifth = power(x, DECAY[self.inputs], False), (x * x).sum(axis=1) ** 2.5
        assert factor.laplacian is not None
        value, gradient = factor.laplacian[:, 0], 2.0 * factor.gradient[:, :, 0]
        return fifth * value, fifth * gradient, fifth * factor.value[:, 0]

    def _jets(self, x: Array, unknowns: Array, hessian: bool = False) -> tuple[Jet, Jet, Jet]:
        inputs = input_jet(self.inputs, x, hessian)
        inputs = Jet(inputs.value, inputs.gradient, None, inputs.hessian)
        jet, _ = self.network.forward(unknowns[1:], inputs)
        constant, _ = self._far_slopes(unknowns[1:])
        jet = Jet(jet.value - constant, jet.gradient, None, jet.hessian)
        mass, m = power(x, 1, hessian), unknowns[0]
        second = None if mass.hessian is None else m * mass.hessian
        scaled = Jet(m * mass.value, m * mass.gradient, None, second)
        return jet, power(x, DECAY[self.inputs], hessian), scaled


def _flat(jet: Jet) -> Jet:
    """Leave out what the acceleration does not need."""
    return Jet(jet.value, jet.gradient)


def _gradient(jet: Jet, factor: Jet, mass: Jet) -> Array:
    total = mass.gradient + factor.gradient * jet.value + factor.value * jet.gradient
    return np.asarray(total[:, :, 0])


def shell(count: int) -> Array:
    """Return points (count, 3) all around, from the reference sphere to twenty radii.

    Directions on a golden spiral; 1/r has density 1/r, so that most points are near the sphere,
    where the high degrees are, and the field far away is held, too.
    """
    k = np.arange(count) + 0.5
    up = 1.0 - 2.0 * k / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * k
    flat = np.sqrt(1.0 - up * up)
    unit = np.stack([flat * np.cos(turn), flat * np.sin(turn), up], axis=1)
    # An additive sequence of low discrepancy, by the plastic number..
    inverse = np.sqrt(np.arange(count) * 0.7548776662466927 % 1.0)
    points: Array = unit / np.maximum(inverse, 0.05)[:, None]
    return points
