"""All effects that the contract test runs on; a new effect adds one line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from unmodeled.models.physics import Effect, PointMass, SphericalHarmonics, Zonal
from unmodeled.models.physics.spherical_harmonics import coefficient_names

SPIN = {"spin_rate": 0.7, "prime_meridian": 0.4}


@dataclass(frozen=True)
class EffectCase:
    """An effect with numbers, and what is claimed of it; lengths and times of order one."""

    effect: Effect
    values: Mapping[str, float] = field(default_factory=dict)
    #: acceleration = grad U, U independent of velocity
    potential: bool = True
    #: Laplace's equation holds outside the body
    harmonic: bool = True
    #: symmetric about z
    axisymmetric: bool = False
    spinning: bool = False


def coefficients(degree, order=None, min_degree=2):
    """Random coefficients, large enough to matter and falling like Kaula's rule."""
    generator = np.random.default_rng(degree)
    names = coefficient_names(degree, order, min_degree)
    size = [0.05 / max(int(name.split("_")[1]), 1) ** 2 for name in names]
    values = {n: s * generator.normal() for n, s in zip(names, size, strict=True)}
    if "C_0_0" in values:
        values["C_0_0"] = 1.1
    return {"GM": 1.3, "R_ref": 0.9} | values


def zonals(*degrees):
    return {"GM": 1.3, "R_ref": 0.9} | {f"J{n}": 0.1 / n * (-1) ** n for n in degrees}


def full(degree, order=None, min_degree=2, **claims):
    return EffectCase(
        SphericalHarmonics(degree, order, min_degree),
        coefficients(degree, order, min_degree),
        **claims,
    )


def spinning(degree):
    return EffectCase(SphericalHarmonics(degree), coefficients(degree) | SPIN, spinning=True)


EFFECT_CASES: dict[str, EffectCase] = {
    "point mass": EffectCase(PointMass(), {"GM": 1.3}, axisymmetric=True),
    "zonal 2": EffectCase(Zonal((2,)), zonals(2), axisymmetric=True),
    "zonal 3": EffectCase(Zonal((3,)), zonals(3), axisymmetric=True),
    "zonal 2-5": EffectCase(Zonal((2, 3, 4, 5)), zonals(2, 3, 4, 5), axisymmetric=True),
    "zonal 7, 4": EffectCase(Zonal((7, 4)), zonals(7, 4), axisymmetric=True),
    "harmonics 0": full(0, min_degree=0, axisymmetric=True),
    "harmonics 1": full(1, min_degree=0),
    "harmonics 2": full(2),
    "harmonics 5": full(5),
    "harmonics 8": full(8),
    "harmonics 5, order 0": full(5, 0, axisymmetric=True),
    "harmonics 6, order 2, from degree 3": full(6, 2, 3),
    "harmonics 3, spinning": spinning(3),
}
