"""Contestants that learn while they fly."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.core.frames import rotation_about_z
from unmodeled.models.physics.motion import CentralBody
from unmodeled.pipeline.filters.adaptive import ForgettingNoise
from unmodeled.pipeline.filters.basis import Basis, HarmonicBasis, RBFBasis, RBFFeatures
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.flight_form import FlightForm
from unmodeled.pipeline.filters.interfaces import LearnedAcceleration
from unmodeled.pipeline.filters.learning_filter import LearningFilter
from unmodeled.pipeline.filters.learning_rules import GradientRule, LyapunovRule, PhysicsRule
from unmodeled.pipeline.filters.process_noise import WhiteAcceleration
from unmodeled.pipeline.filters.run import FilterRun
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.state import FilterState, Predicted, Updated
from unmodeled.pipeline.filters.with_residual import WithResidual
from unmodeled.pipeline.filters.with_weights import WithWeights, WithWeightsNoise
from unmodeled.pipeline.learned_field import LearnedField
from unmodeled.pipeline.navigation.contestants import (
    Contestant,
    Entry,
    begin,
    more_states,
    register,
    white_noise_filter,
)
from unmodeled.pipeline.navigation.flight import Flight

__all__ = ["Recorded", "TurningBasis", "TurningField", "features_of", "fixed_field"]

_NAN = float("nan")


@dataclass(frozen=True)
class Recorded:
    """A learning filter that notes what its network says after each update.

    Parameters
    ----------
    inner : LearningFilter
    said : list of ndarray (b, 3)
        Filled by the run.
    """

    inner: LearningFilter
    said: list[Array] = field(default_factory=list)

    def start(self, state: FilterState) -> FilterState:
        """Forget what was said, and start the filter."""
        self.said.clear()
        return self.inner.start(state)

    def predict(self, state: FilterState, dt: float) -> Predicted:
        """Carry a state over ``dt`` > 0 seconds."""
        return self.inner.predict(state, dt)

    def update(self, predicted: Predicted, z: Array, used: npt.ArrayLike | None = None) -> Updated:
        """Use the measurements of one epoch, and note what the network says."""
        after = self.inner.update(predicted, z, used)
        self.said.append(self.inner.acceleration(after.state))
        return after

    def read(self, run: FilterRun) -> Array:
        """Return what was said, (k, b, 3)."""
        return np.stack(self.said)


def features_of(flight: Flight, neurons: int, eta: float, seed: int = 11) -> RBFFeatures:
    """Random centres over twice the region that the first orbit is expected to fill.

    The region is a rough guess, as a mission would have: four times the first guess's distance
    and speed; it is not taken from the true flight.
    """
    size = np.abs(flight.truth[0, :3]).max()
    speed = np.abs(flight.truth[0, 3:]).max()
    scale = 1.0 / np.repeat([2.0 * size, 8.0 * speed], 3)
    centres = np.random.default_rng(seed).uniform(-1.0, 1.0, size=(neurons, 6))
    return RBFFeatures(centres, eta, scale)


def _rbf(kind: str) -> Callable[[Flight, Array, Mapping[str, float]], Contestant]:
    def make(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
        features = features_of(flight, int(n["neurons"]), n["eta"])
        rule: LyapunovRule | GradientRule | PhysicsRule
        if kind == "pinn":
            if flight.nonlinear is None:
                raise ConfigError(f"{flight.title} has no physics for a PINN", do="use rbf")
            rule = PhysicsRule(
                features,
                flight.nonlinear,
                flight.base,
                n["rate"],
                n["data_weight"],
                n["relaxation"],
            )
        elif kind == "gradient":
            rule = GradientRule(features, n["rate"], n["relaxation"])
        else:
            rule = LyapunovRule(features, n["rate"], n["relaxation"], raw=n.get("raw", 0.0) > 0)
        axes = np.array([n["radial"], 1.0, 1.0])
        white = WhiteAcceleration((n["noise"] * axes) ** 2)
        noise: WhiteAcceleration | ForgettingNoise = white
        start = begin(flight, starts)
        if "alpha" in n:
            dt = float(flight.times[1] - flight.times[0])
            noise = ForgettingNoise(white.covariance(start, dt), n["alpha"])
        inner = LearningFilter(
            RungeKutta(flight.base, flight.longest), flight.measurement, noise, rule=rule
        )
        recorded = Recorded(inner)
        return Contestant(recorded, start, recorded.read)

    return make


def _weights(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    features = features_of(flight, int(n["neurons"]), n["eta"])
    return _with_weights(flight, starts, RBFBasis(features, n["sigma"]), 1.0, n)


def _harmonic(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    if "gm" not in flight.facts:
        raise ConfigError(f"harmonics in {flight.title}", allowed="about one small body")
    basis = HarmonicBasis(int(n["degree"]), flight.facts["gm"], flight.facts["radius"])
    sigma = basis.prior_sigma(n["amplitude"], n["attenuation"])
    rate = flight.facts.get("spin_rate", 0.0)
    return _with_weights(flight, starts, TurningBasis(basis, rate) if rate else basis, sigma, n)


def _with_weights(
    flight: Flight, starts: Array, basis: Basis, sigma: npt.ArrayLike, n: Mapping[str, float]
) -> Contestant:
    model = WithWeights(flight.base, basis)
    noise = WithWeightsNoise(
        WhiteAcceleration(n["noise"] ** 2), basis.size, n.get("drift", 0.0) ** 2
    )
    steps = flight.flown(RungeKutta(model, flight.longest))

    def believed(run: FilterRun) -> Array:
        return np.stack(
            [
                (basis.evaluate(x[:, :6], float(t)) @ x[:, 6:, None])[..., 0]
                for x, t in zip(run.mean, run.times, strict=True)
            ]
        )

    measured = more_states(flight.measurement, 6 + basis.size)
    return Contestant(
        ExtendedKalmanFilter(steps, measured, noise),
        model.start(begin(flight, starts), sigma),
        believed,
    )


@dataclass(frozen=True)
class TurningBasis:
    """A basis fixed in a body that turns about z, seen from inertial axes.

    Parameters
    ----------
    inner : Basis
        Of positions in body axes.
    rate : float
        rad/s.
    """

    inner: Basis
    rate: float

    @property
    def size(self) -> int:
        """Number of weights."""
        return self.inner.size

    def evaluate(self, x: Array, t: float) -> Array:
        """Return B (b, 3, p), inertial components."""
        turn = rotation_about_z(self.rate * t)
        seen: Array = turn.T @ self.inner.evaluate(x[:, :3] @ turn.T, t)
        return seen

    def slope(self, x: Array, t: float, weights: Array) -> Array:
        """Return d(B w)/dx (b, 3, n)."""
        turn = rotation_about_z(self.rate * t)
        out = np.zeros((len(x), 3, x.shape[1]))
        out[:, :, :3] = turn.T @ self.inner.slope(x[:, :3] @ turn.T, t, weights)[:, :, :3] @ turn
        return out


@dataclass(frozen=True)
class TurningField:
    """An acceleration learned in the axes of a body that turns about z, seen from inertial axes.

    Parameters
    ----------
    inner : LearnedAcceleration
        Of positions in body axes, which are the inertial ones at time 0.
    rate : float
        rad/s.
    """

    inner: LearnedAcceleration
    rate: float

    def evaluate(self, x: Array, t: float) -> tuple[Array, Array, Array | None]:
        """Return acceleration (b, 3), Jacobian (b, 3, n), covariance (b, 3, 3) or None."""
        turn = rotation_about_z(self.rate * t)
        a, slope, C = self.inner.evaluate(x[:, :3] @ turn.T, t)
        J = np.zeros((*a.shape, x.shape[1]))
        J[:, :, :3] = turn.T @ slope @ turn
        return a @ turn, J, None if C is None else turn.T @ C @ turn


def fixed_field(flight: Flight, starts: Array, learned: LearnedField, noise: float) -> Contestant:
    """Return the filter that flies a field learned elsewhere as the residual to a point mass.

    Its units say the mass it was learned beside; what the field adds to that mass is the
    residual. A field learned in body-fixed axes turns with the body of the flight.
    """
    form: LearnedAcceleration = FlightForm.of(learned)
    if learned.frame == "body_fixed":
        form = TurningField(form, flight.facts.get("spin_rate", 0.0))
    model = WithResidual(CentralBody(1e-12), form)
    steps = flight.flown(RungeKutta(model, flight.longest))

    def believed(run: FilterRun) -> Array:
        return np.stack(
            [
                form.evaluate(x, float(t))[0] - flight.base.rates(x, float(t))[0][:, 3:]
                for x, t in zip(run.mean[:, :, :6], run.times, strict=True)
            ]
        )

    return white_noise_filter(flight, starts, steps, noise, believed)


def _needs_file(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    raise ConfigError('filter "learned" without a learned field', do="give --learner FILE")


def _needs_training(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    raise ConfigError(
        'filter "network" is trained on what DMC estimates', do="fly it with unmodeled navigate"
    )


# radial: noise of the first axis, times that of the others
_NETWORK = {
    "noise": _NAN,
    "rate": _NAN,
    "neurons": 30.0,
    "eta": 1.0,
    "relaxation": 1.0,
    "radial": 1.0,
}
register(
    Entry("rbf", "RBF network, Lyapunov rule", _NETWORK | {"raw": 0.0}, _rbf("lyapunov"), "learned")
)
register(
    Entry(
        "rbf_adaptive",
        "RBF network, Lyapunov rule, adapted Q as printed",
        _NETWORK | {"raw": 1.0, "alpha": 0.99},
        _rbf("lyapunov"),
        "learned",
    )
)
register(Entry("gradient", "RBF network, gradient rule", _NETWORK, _rbf("gradient"), "learned"))
register(
    Entry(
        "pinn",
        "RBF network, physics penalty",
        _NETWORK | {"data_weight": 0.5},
        _rbf("pinn"),
        "learned",
    )
)
register(
    Entry(
        "weights",
        "RBF network, Kalman weights",
        {"noise": _NAN, "sigma": _NAN, "neurons": 8.0, "eta": 1.0, "drift": 0.0},
        _weights,
        "learned",
    )
)
register(
    Entry(
        "harmonic",
        "gravity harmonics, Kalman weights",
        {"noise": _NAN, "degree": 5.0, "amplitude": 0.05, "attenuation": 0.7},
        _harmonic,
        "learned",
    )
)
register(Entry("learned", "learned field of a file", {"noise": 1e-8}, _needs_file, "learned"))
register(
    Entry(
        "network",
        "network trained on DMC estimates, with DMC",
        {"sigma": _NAN, "time_constant": _NAN},
        _needs_training,
        "learned",
    )
)
