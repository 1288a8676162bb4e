"""A small network of the potential; the acceleration is its gradient."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import ClassVar, Literal, get_args

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned._potential_field import PotentialField, shell
from unmodeled.models.learned._potential_fit import Samples, fit_field
from unmodeled.models.learned._potential_network import Activation, Network
from unmodeled.models.learned._potential_prior import Prior, Strengths
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress

__all__ = ["PotentialMLP"]

Inputs = Literal["kelvin", "direction"]

#: Points that are evaluated at once.
_CHUNK = 2048
#: Precision of a mass of which nothing is known; error of one that is known to the last digit.
_UNKNOWN, _KNOWN = 1e-6, 1e-6


class PotentialMLP(Learner):
    r"""Acceleration as the gradient of :math:`\frac{GM}{R}(\frac{m R}{r} + \frac{R}{r} N)`.

    N is a small network of the position scaled by the radius, :math:`x R / r^2`: the field is free
    of curl by construction and falls off far away, whatever the weights. With these inputs U is
    harmonic outside the sphere R where N is harmonic inside (Kelvin's transform), so that the
    Laplacian of N, penalised all around the body and not only at the samples, makes the network a
    gravity field as nearly as the samples support: the soft constraint of [Martin2022] and
    [Martin2023]. N has the value 0 at infinity: the mass m is a number of its own.

    A few hundred weights are fitted by Levenberg-Marquardt with closed-form derivatives. The noise,
    the strength of the penalty and those of the weights maximise the evidence [MacKay1992], with
    weak priors of their own; see `unmodeled.models.learned._potential_evidence`. The covariance is
    that of all weights and the mass, linearised about the fit (Laplace's approximation) and
    averaged over the strengths. One layer of many units, rough and evenly drawn, is meant for it:
    linearised about a fit to noisy samples, whose output weights are small, a network can do what
    its units can as they are, and two layers of twelve could hardly do degrees of two and more.

    Noise of the positions counts through the gravity gradient of the fit, repeated, and the field
    is fitted at the positions that it makes most likely, with Student's t for outliers. Where it
    is above a fifth of the median radius no linear step means anything: then the mass alone is
    found, by moments, and the network stays at its prior, which is zero with a wide band.

    Parameters
    ----------
    layers, width : int
        Hidden layers and their size.
    activation : {"sine", "tanh"}
        Of the hidden layers.
    inputs : {"kelvin", "direction"}
        x R / r^2; or x / r and R / r with the factor (R / r)^2, as [Martin2023].
    harmonic : bool
        Whether the Laplacian is penalised; false where the samples lie within the masses.
    mass_error : float, optional
        Standard deviation of ``gm`` as a known mass, as a share; if not given, nothing is known of
        the mass. The prior mass is ``gm``, or zero on top of a point mass (`Residual`).
    lipschitz : float, optional
        Bound on the slope of the network by its inputs: spectral norms of all layers are held at
        equal shares of it, as in `SpectralMLP`.
    steps, passes : int
        Most steps of the first fit, a third in each later one; fits where positions are noisy.
    points : int
        Points where the Laplacian is penalised, from ``radius`` outwards.
    gm, radius : float
        Reference values in the units of the samples; ``radius`` is that of a sphere around all
        masses.
    random_state : int
        Of the first weights.

    Attributes
    ----------
    mass_ : float
        Gravitational parameter found, in the units of the samples.
    lipschitz_bound_ : float
        Product of the spectral norms: no slope of the network by its inputs is larger.
    laplacian_ : float
        Root mean square, over the shell where it is penalised, of r^5 times the Laplacian of the
        potential, in units of GM R^2; for ``kelvin`` inputs the Laplacian of N in the ball.
    """

    name: ClassVar[str] = "potential_mlp"
    has_covariance = True
    stands_alone: ClassVar[bool] = True

    mass_: float
    lipschitz_bound_: float
    laplacian_: float

    def __init__(
        self,
        layers: int = 1,
        width: int = 40,
        activation: Literal["sine", "tanh"] = "sine",
        inputs: Literal["kelvin", "direction"] = "kelvin",
        harmonic: bool = True,
        mass_error: float | None = None,
        lipschitz: float | None = None,
        steps: int = 60,
        passes: int = 4,
        points: int = 300,
        gm: float = NORMALISED_GM,
        radius: float = 1.0,
        random_state: int = 0,
    ) -> None:
        self.layers = layers
        self.width = width
        self.activation = activation
        self.inputs = inputs
        self.harmonic = harmonic
        self.mass_error = mass_error
        self.lipschitz = lipschitz
        self.steps = steps
        self.passes = passes
        self.points = points
        self.gm = gm
        self.radius = radius
        self.random_state = random_state

    # Fit -------------------------------------------------------------------------------------

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        self._check()
        self._off_the_origin(X)
        field = self._make_field()
        unit = self.gm / self.radius**2
        level = replace(
            noise,
            position=noise.position / self.radius,
            acceleration=noise.acceleration / unit,
            samples=None if noise.samples is None else noise.samples / unit,
            gradient=None if noise.gradient is None else noise.gradient * (self.radius / unit),
        )
        start, scale = field.network.draw(self.random_state)
        reference = 1.0 if noise.gradient is None else 0.0
        precision = _UNKNOWN
        if self.mass_error is not None:
            precision = max(self.mass_error, _KNOWN) ** -2.0
        prior = Prior(
            centre=np.concatenate([[reference], start]),
            scale=np.concatenate([[1.0], scale]),
            mass_precision=precision,
            hidden=field.network.hidden,
            points=shell(self.points) if self.harmonic else np.empty((0, 3)),
            project=partial(_project, field.network, self._share()),
        )
        found = fit_field(
            field,
            Samples(X / self.radius, y / unit, level),
            prior,
            known=self.mass_error is not None,
            steps=(self.steps, max(1, self.steps // 3)),
            passes=self.passes,
            progress=progress,
        )
        uneven = field.laplacian(shell(self.points), found.unknowns)
        self.laplacian_ = float(np.sqrt(np.mean(uneven**2)))
        self._adopt(field, found.unknowns, found.root, found.strengths)
        progress(1.0)

    def _check(self) -> None:
        for name in ("layers", "width", "steps", "passes", "points", "gm", "radius"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"{self.name}: {name} is {value}", allowed="a number > 0")
        for name, allowed in (("activation", get_args(Activation)), ("inputs", get_args(Inputs))):
            if getattr(self, name) not in allowed:
                raise ConfigError(
                    f'{self.name}: {name} is "{getattr(self, name)}"', allowed=", ".join(allowed)
                )
        if self.mass_error is not None and not (
            math.isfinite(self.mass_error) and self.mass_error >= 0
        ):
            raise ConfigError(
                f"{self.name}: mass_error is {self.mass_error}",
                allowed="a share >= 0, or nothing if the mass is not known",
            )
        if self.lipschitz is not None and not (
            math.isfinite(self.lipschitz) and self.lipschitz > 0
        ):
            raise ConfigError(f"{self.name}: lipschitz is {self.lipschitz}", allowed="> 0")

    def _make_field(self) -> PotentialField:
        first = 3 if self.inputs == "kelvin" else 4
        network = Network([first] + [self.width] * self.layers, self.activation)
        return PotentialField(network, self.inputs)

    def _share(self) -> float | None:
        return None if self.lipschitz is None else self.lipschitz ** (1.0 / (self.layers + 1))

    def _adopt(
        self, field: PotentialField, unknowns: Array, root: Array, strengths: Strengths
    ) -> None:
        self._field, self._unknowns, self._root = field, unknowns, root
        self._strengths = strengths
        self.mass_ = self.gm * float(unknowns[0])
        self.lipschitz_bound_ = math.prod(field.network.norms(unknowns[1:]))

    # Use -------------------------------------------------------------------------------------

    def _predict(self, X: Array) -> Array:
        x = self._scaled(X)
        return self.gm / self.radius**2 * self._field.acceleration(x, self._unknowns)

    def _jacobian(self, X: Array) -> Array:
        x = self._scaled(X)
        return self.gm / self.radius**3 * self._field.gradient(x, self._unknowns)

    def potential(self, X: Array) -> Array:
        """Return the potential (n,) at positions ``X`` (n, 3); acceleration is its gradient."""
        x = self._scaled(self._checked(X))
        return self.gm / self.radius * self._field.potential(x, self._unknowns)

    def _predict_covariance(self, X: Array) -> Array:
        x, unit, blocks = self._scaled(X), self.gm / self.radius**2, [np.empty((0, 3, 3))]
        for k in range(0, len(x), _CHUNK):
            _, slopes = self._field.slopes(x[k : k + _CHUNK], self._unknowns)
            half = unit * slopes @ self._root
            covariance = half @ half.mT
            blocks.append(0.5 * (covariance + covariance.mT))
        return np.concatenate(blocks)

    def _scaled(self, X: Array) -> Array:
        self._off_the_origin(X)
        return X / self.radius

    def _off_the_origin(self, X: Array) -> None:
        square = (X * X).sum(axis=1)
        if (square == 0.0).any():
            raise DataError(
                f"position {int(np.argmin(square))} is the origin, where {self.name} has no "
                "acceleration",
                allowed="positions away from the origin",
            )

    def facts(self) -> dict[str, float | str]:
        """Return size, mass, bound, what is left of the Laplacian, and the strengths found."""
        self._require_fitted()
        return {
            "weights": float(self._field.network.count),
            "gm": self.mass_,
            "lipschitz_bound": self.lipschitz_bound_,
            "laplacian": self.laplacian_,
            "strength of the samples": self._strengths.data,
            "strength of the Laplacian": self._strengths.laplace,
            "strength of hidden weights": self._strengths.hidden,
            "strength of output weights": self._strengths.output,
        }

    def _arrays(self) -> dict[str, Array]:
        s = self._strengths
        return {
            "unknowns": self._unknowns,
            "root": self._root,
            "strengths": np.array([s.data, s.laplace, s.hidden, s.output]),
            "laplacian": np.array([self.laplacian_]),
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        field, unknowns, root = self._make_field(), arrays["unknowns"], arrays["root"]
        if unknowns.shape != (field.count,) or root.shape != (field.count, field.count):
            raise ValueError(f"weights of shape {unknowns.shape} for {field.count} unknowns")
        self.laplacian_ = float(arrays["laplacian"][0])
        self._adopt(field, unknowns, root, Strengths(*map(float, arrays["strengths"])))


def _project(network: Network, share: float | None, unknowns: Array) -> Array:
    """Bring the spectral norm of every layer down to ``share``, if there is one."""
    if share is None:
        return unknowns
    return np.concatenate([unknowns[:1], network.bounded(unknowns[1:], share)])
