"""The rows of the protocol: what is trained, and how large."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from pinn.linear import LinearField, harmonic_design, mascon_design
from pinn.network import PinnGM
from pinn.truth import GM, RADIUS, Truth
from unmodeled.core.arrays import Array
from unmodeled.core.seeds import Streams
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import (
    Learner,
    MasconGP,
    NoiseLevel,
    PointMassOnly,
    Residual,
    learner_class,
    learner_names,
)
from unmodeled.models.physics.interior_lattice import mesh_lattice

__all__ = ["ROWS", "Row", "Samples", "row_names", "units"]

#: Lengths in R, accelerations such that GM is 4 pi^2: what the learners of the package expect.
UNIT_A = GM / RADIUS**2 / NORMALISED_GM
#: Least stated noise, as a share of each acceleration: the weights of clean samples.
_LEAST = 1e-4
#: Learners of the package that take part where they are registered.
_JOINING = ("mlp", "harmonic_kernel_gp")
#: More samples than this are not given to them: their cost is not known here.
_MOST_JOINING = 2000


class Fitted(Protocol):
    """Anything that predicts accelerations (n, 3) at positions (n, 3), normalised."""

    def predict(self, X: Array) -> Array: ...


@dataclass(frozen=True)
class Samples:
    """Training data in the units of the learners.

    Parameters
    ----------
    x, a : ndarray (n, 3)
        Positions, observed accelerations.
    noise : float
        Share of each acceleration, 0 for none.
    truth : Truth
        For what a row may know: the shape.
    """

    x: Array
    a: Array
    noise: float
    truth: Truth

    @property
    def size(self) -> Array:
        """Length of the acceleration of the point mass at each sample (n,): what errors count by.

        Not of the observed one: noise that makes it shorter would count more, and bias the mass by
        two thirds of the variance, 0.7 % at 10 % noise.
        """
        found: Array = NORMALISED_GM / np.sum(self.x**2, axis=1)
        return found

    @property
    def level(self) -> NoiseLevel:
        """Noise of each component of each sample."""
        size = max(self.noise, _LEAST) * self.size / np.sqrt(3.0)
        return NoiseLevel(samples=np.repeat(size[:, None], 3, axis=1))

    def beyond(self, radius: float) -> Samples:
        """Return the samples farther than a radius."""
        kept = np.linalg.norm(self.x, axis=1) > radius
        return Samples(self.x[kept], self.a[kept], self.noise, self.truth)


@dataclass(frozen=True)
class Row:
    """One row.

    Parameters
    ----------
    name : str
    fit : callable
        Samples to something fitted and its number of parameters (0: grows with the samples).
    settings : str
        Words: what it was given; part of the row's identity.
    most : int
        Most samples, 0 for any.
    """

    name: str
    fit: Callable[[Samples], tuple[Fitted, int]]
    settings: str
    most: int = 0


def units(x: Array, a: Array) -> tuple[Array, Array]:
    """Return positions (m) and accelerations (m/s2) in the units of the learners."""
    return x / RADIUS, a / UNIT_A


def _point_mass(samples: Samples) -> tuple[Fitted, int]:
    return PointMassOnly().fit(samples.x, samples.a), 1


def _harmonics(degree: int) -> Row:
    def fit(samples: Samples) -> tuple[Fitted, int]:
        field = LinearField(harmonic_design(degree))
        field.fit(samples.x, samples.a, 1.0 / samples.size)
        return field, field.parameters

    return Row(
        f"spherical harmonics to degree {degree}, least squares", fit, "weights by the point mass"
    )


def _mascons(count: int) -> Row:
    def fit(samples: Samples) -> tuple[Fitted, int]:
        places = inside_points(samples.truth, count) / RADIUS
        field = LinearField(mascon_design(places), regularised=True)
        field.fit(samples.x, samples.a, 1.0 / samples.size)
        return field, field.parameters

    return Row(
        f"{count} mascons inside the shape",
        fit,
        "weights by the point mass; drawn uniformly; ridge by cross-validation",
    )


def inside_points(truth: Truth, count: int) -> Array:
    """Return points uniform in the volume of the body, m."""
    generator = Streams(7).generator("pinn.mascons")
    low, high = truth.mesh.vertices.min(axis=0), truth.mesh.vertices.max(axis=0)
    kept = np.empty((0, 3))
    while len(kept) < count:
        drawn = generator.uniform(low, high, (2 * count, 3))
        kept = np.concatenate([kept, drawn[truth.inside(drawn)]])
    return kept[:count]


def _learner(make: Callable[[], Learner], samples: Samples) -> tuple[Fitted, int]:
    fitted = make().fit(samples.x, samples.a, samples.level)
    return fitted, sum(a.size for a in fitted._arrays().values())


def _package(name: str, kind: str, *, beyond: bool = False, most: int = 0, **params: Any) -> Row:
    def make() -> Learner:
        cls = learner_class(kind)
        learner = cls(**params)
        return learner if cls.stands_alone else Residual(learner)

    def fit(samples: Samples) -> tuple[Fitted, int]:
        brillouin = samples.truth.mesh.brillouin_radius / RADIUS
        return _learner(make, samples.beyond(brillouin) if beyond else samples)

    settings = f"{kind} {sorted(params.items())} beyond {beyond}; weights by the point mass"
    return Row(name, fit, settings, most)


def _mascon_gp(count: int) -> Row:
    def fit(samples: Samples) -> tuple[Fitted, int]:
        places = mesh_lattice(samples.truth.mesh, count) / RADIUS
        given = tuple((float(x), float(y), float(z)) for x, y, z in places)
        return _learner(lambda: MasconGP(places=given), samples)

    return Row(f"mascon gp, {count} places inside the shape", fit, "weights by the point mass")


def _network(units_: int, layers: int, steps: int) -> Row:
    settings = {"units": units_, "layers": layers, "most_steps": steps}

    def fit(samples: Samples) -> tuple[Fitted, int]:
        epochs = max(1, steps * 2**11 // max(len(samples.x), 2**11))
        network = PinnGM(NORMALISED_GM, 1.0, patience=max(5, epochs // 10), **settings)
        network.fit(samples.x, samples.a)
        return network, network.parameters

    return Row(f"PINN-GM-III, {layers} layers of {units_}", fit, f"{steps} steps")


ROWS: tuple[Row, ...] = (
    Row("point mass", _point_mass, ""),
    _harmonics(4),
    _harmonics(8),
    _harmonics(15),
    _mascons(55),
    _mascons(400),
    _package("harmonic gp, to degree 16", "harmonic_gp", degree=16),
    _package(
        "harmonic gp, to degree 16, samples beyond the Brillouin sphere",
        "harmonic_gp",
        degree=16,
        beyond=True,
    ),
    _mascon_gp(1000),
    _package("elm on point mass", "elm", nodes=400),
    _package("potential mlp", "potential_mlp"),
    _package("potential mlp, 2 x 12", "potential_mlp", layers=2, width=12),
    _package(
        "potential mlp, directions, no Laplacian",
        "potential_mlp",
        inputs="direction",
        layers=2,
        width=24,
        harmonic=False,
    ),
    *(
        _package(f"{kind.replace('_', ' ')}", kind, most=_MOST_JOINING)
        for kind in _JOINING
        if kind in learner_names()
    ),
    _network(8, 4, 6000),
    _network(64, 8, 3000),
)


def row_names() -> list[str]:
    """Return the names of all rows."""
    return [row.name for row in ROWS]
