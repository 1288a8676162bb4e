"""Least squares of spherical-harmonic coefficients: the baselines that know the family."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.point_mass import PointMassOnly
from unmodeled.models.physics import Dynamics, SphericalHarmonics, coefficient_names

__all__ = ["FittedPointMass", "HarmonicLeastSquares", "ZonalOracle"]

# Generalised cross-validation looks for the ridge on this grid of data-to-prior variance ratios.
_RIDGES = np.logspace(-16, 4, 81)


class HarmonicLeastSquares(Learner):
    r"""Regularised spherical-harmonic field of a fixed degree.

    Minimises :math:`\|y - H c\|^2 + \rho \sum_n n^4 \|c_n\|^2` over the normalised coefficients
    :math:`c`, with the penalty of Kaula's rule (coefficients of degree n of size
    :math:`1/n^2`, [Kaula1966] Eq. 5.52) on degrees 2 and higher; mass and centre of mass
    (degrees 0 and 1) are free. The ridge :math:`\rho` minimises generalised cross-validation
    ([Golub1979] Eq. 1.4) unless given. The design matrix comes from the physics package.

    Where the noise of the positions is known, each sample is weighted by the inverse of
    :math:`\sigma_a^2 I + \sigma_s^2 G G^T`, G the gravity gradient of the reference point mass at
    the observed position: near the body a position error spoils the acceleration most. Known noise
    of single samples is added to it. Without either all samples count the same.

    Parameters
    ----------
    degree : int
        Highest degree.
    order : int, optional
        Highest order; 0 fits a zonal field.
    ridge : float, optional
        Fixed ridge; 0 for plain least squares; found by cross-validation if not given.
    gm, radius : float
        Reference values in the units of the samples; they scale the coefficients.
    """

    name: ClassVar[str] = "harmonic_least_squares"
    stands_alone: ClassVar[bool] = True

    coefficients_: Array
    ridge_: float

    def __init__(
        self,
        degree: int = 8,
        order: int | None = None,
        ridge: float | None = None,
        gm: float = NORMALISED_GM,
        radius: float = 1.0,
    ) -> None:
        self.degree = degree
        self.order = order
        self.ridge = ridge
        self.gm = gm
        self.radius = radius

    @property
    def _degrees(self) -> tuple[int, ...]:
        """Degrees whose coefficients are estimated."""
        return tuple(range(self.degree + 1))

    def coefficient_names(self) -> list[str]:
        """Return the names of the estimated coefficients, in the order of ``coefficients_``."""
        return [
            name
            for name in coefficient_names(self.degree, self.order)
            if int(name.split("_")[1]) in self._degrees
        ]

    def _field(self, values: dict[str, float]) -> Dynamics:
        effect = SphericalHarmonics(self.degree, self.order, min_degree=0)
        return Dynamics([effect], {"GM": self.gm, "R_ref": self.radius, "C_0_0": 0.0} | values)

    def _design(self, X: Array) -> Array:
        """Accelerations of each coefficient alone, (3n, p): the field is linear in them."""
        columns = [self._field({name: 1.0}).acceleration(X) for name in self.coefficient_names()]
        return np.stack([c.ravel() for c in columns], axis=1)

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        if self.ridge is not None and not (math.isfinite(self.ridge) and self.ridge >= 0):
            raise ConfigError(f"ridge is {self.ridge}", allowed="a number >= 0")
        H, target = self._whiten(X, noise, self._design(X), y.ravel())
        progress(0.5)
        degree = np.array([int(name.split("_")[1]) for name in self.coefficient_names()])
        size = np.where(degree < 2, np.inf, 1.0 / np.maximum(degree, 1) ** 2)
        self.ridge_, self.coefficients_ = _ridge_fit(H, target, size, self.ridge)
        self._fitted_field = self._field(self._values())
        progress(1.0)

    def _whiten(self, X: Array, noise: NoiseLevel, H: Array, target: Array) -> tuple[Array, Array]:
        """Scale the equations of each sample so that their noise is equal and uncorrelated."""
        if noise.position == 0 and noise.samples is None:
            return H, target
        G = PointMassOnly(self.gm)._jacobian(X)
        covariance = noise.acceleration**2 * np.eye(3) + noise.position**2 * G @ G.mT
        if noise.samples is not None:
            size = noise.samples**2
            # a component without noise counts as the best of the others, not infinitely
            least = size[size > 0].min(initial=np.inf)
            least = least if np.isfinite(least) else 1.0
            covariance += np.maximum(size, least)[:, :, None] * np.eye(3)
        root = np.linalg.cholesky(covariance)
        equations = np.concatenate([H, target[:, None]], axis=1).reshape(len(X), 3, -1)
        white = np.linalg.solve(root, equations).reshape(3 * len(X), -1)
        return np.ascontiguousarray(white[:, :-1]), white[:, -1]

    def _values(self) -> dict[str, float]:
        return dict(
            zip(self.coefficient_names(), (float(c) for c in self.coefficients_), strict=True)
        )

    def _predict(self, X: Array) -> Array:
        return self._fitted_field.acceleration(X)

    def _jacobian(self, X: Array) -> Array:
        return np.ascontiguousarray(self._fitted_field.state_partials(X)[:, :, :3])

    def _arrays(self) -> dict[str, Array]:
        return {"coefficients": self.coefficients_, "ridge": np.array([self.ridge_])}

    def _restore(self, arrays: dict[str, Array]) -> None:
        self.coefficients_ = arrays["coefficients"]
        self.ridge_ = float(arrays["ridge"][0])
        self._fitted_field = self._field(self._values())

    def facts(self) -> dict[str, float | str]:
        """Return the number of coefficients, the ridge and the fitted mass."""
        facts: dict[str, float | str] = {
            "coefficients": float(len(self.coefficients_)),
            "ridge": self.ridge_,
        }
        if "C_0_0" in self.coefficient_names():
            facts["fitted GM / reference GM"] = self._values()["C_0_0"]
        return facts


class FittedPointMass(HarmonicLeastSquares):
    """A point mass whose GM is fitted: one coefficient.

    Parameters
    ----------
    gm : float
        Reference value.
    """

    name: ClassVar[str] = "fitted_point_mass"

    def __init__(self, gm: float = NORMALISED_GM) -> None:
        super().__init__(degree=0, order=0, ridge=0.0, gm=gm)


class ZonalOracle(HarmonicLeastSquares):
    """Fitted mass and J2..J5: the oracle that knows the family of the simulated truth.

    No learner that does not know the family can be expected to beat it on such data.

    Parameters
    ----------
    degree : int
        Highest zonal degree.
    gm : float
        Reference value.
    """

    name: ClassVar[str] = "zonal_oracle"

    def __init__(self, degree: int = 5, gm: float = NORMALISED_GM) -> None:
        super().__init__(degree=degree, order=0, ridge=0.0, gm=gm)

    @property
    def _degrees(self) -> tuple[int, ...]:
        return (0, *range(2, self.degree + 1))


def _ridge_fit(H: Array, y: Array, size: Array, ridge: float | None) -> tuple[float, Array]:
    """Solve the penalised problem; ``size`` is infinite for free coefficients."""
    free = np.isinf(size)
    # Free columns first: project them out, so that cross-validation sees the penalised part.
    q, _ = scipy.linalg.qr(H[:, free], mode="economic") if free.any() else (H[:, :0], None)
    scaled = H[:, ~free] * size[~free]
    projected = scaled - q @ (q.T @ scaled)
    remainder = y - q @ (q.T @ y)
    u, s, vt = scipy.linalg.svd(projected, full_matrices=False)
    along = u.T @ remainder
    n = len(y) - int(free.sum())
    top = float(s[0]) if len(s) else 1.0
    # A direction that the orbit does not show at all has a singular value of pure rounding.
    usable = s > top * np.finfo(float).eps * len(y)
    if ridge is None:
        leftover = float(remainder @ remainder - along @ along)
        scores = []
        for candidate in _RIDGES * top**2:
            shrink = candidate / (s**2 + candidate)
            residual = max(leftover, 0.0) + float(np.sum((shrink * along) ** 2))
            freedom = n - np.sum(1 - shrink)
            scores.append(n * residual / freedom**2)
        ridge = float(_RIDGES[int(np.argmin(scores))] * top**2) if len(s) else 0.0
    gain = np.where(usable, s / (s**2 + ridge), 0.0) if len(s) else s
    coefficients = np.zeros(H.shape[1])
    coefficients[~free] = size[~free] * (vt.T @ (gain * along))
    if free.any():
        rest = y - H[:, ~free] @ coefficients[~free]
        coefficients[free] = scipy.linalg.lstsq(H[:, free], rest)[0]
    return ridge, coefficients
