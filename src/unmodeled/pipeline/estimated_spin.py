"""Spin rate of a body from the motion about it: the rate that makes its field most likely."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.frames import body_fixed_from_inertial, turned
from unmodeled.core.threads import one_thread
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.trajectory import Trajectory
from unmodeled.models.learned import HarmonicGP, NoiseLevel

__all__ = ["SpinEstimate", "estimate_spin"]

#: Rates that one search may try.
_MOST = 4000
#: Degree of the field with which the bracket is scanned.
_SCAN_DEGREE = 4
#: Gain of log evidence over the typical rate of the bracket below which nothing is claimed, beside
#: the logarithm of the number of rates: the best of many is above the typical one by chance.
_LEAST_GAIN = 10.0
#: Share of the acceleration below which what turns is rounding.
_ROUNDING = 1e-10


@dataclass(frozen=True)
class SpinEstimate:
    """What the data say of the spin rate.

    Parameters
    ----------
    observable : bool
        False where the data do not determine the rate; ``rate`` and ``sigma`` are then nan.
    rate, sigma : float
        Estimate and standard deviation, rad/s.
    reason : str
        Why it is not observable; empty if it is.
    gain : float
        Log evidence of the best rate over the median of the bracket.
    rates, log_evidence : ndarray (n,)
        What was tried, rad/s, and what came out.
    """

    observable: bool
    rate: float
    sigma: float
    reason: str
    gain: float
    rates: Array
    log_evidence: Array

    def __str__(self) -> str:
        if not self.observable:
            return f"spin rate not observable: {self.reason}"
        period = 2.0 * math.pi / abs(self.rate) / 3600.0
        return (
            f"spin rate {self.rate:.9g} +- {self.sigma:.2g} rad/s (period {period:.6g} h), "
            f"log evidence {self.gain:.0f} above the typical rate of the bracket"
        )


def estimate_spin(
    trajectory: Trajectory,
    learner: HarmonicGP | None = None,
    *,
    rate_bracket: tuple[float, float],
    gm: float,
    radius: float,
    pole: Sequence[float] = (0.0, 0.0, 1.0),
    noise: NoiseLevel | None = None,
) -> SpinEstimate:
    """Find the rate at which the samples are most likely those of one field that turns.

    For each rate the samples are turned into the body and a `HarmonicGP` is fitted; its log
    evidence, with the field integrated out, is the log likelihood of the rate. It is scanned with
    a field to degree 4, in steps of a radian of its highest harmonic over the time span; the best
    rate is refined with the learner itself, and the curvature there gives sigma. That sigma holds
    for the model: what is of a higher degree than the learner's counts as noise and is none.

    Only what turns shows the rate. A field that is zonal about ``pole`` does not, and a rate and
    its aliases (one turn between samples) are the same: the bracket decides.

    Parameters
    ----------
    trajectory : Trajectory
        Inertial axes, with accelerations, SI.
    learner : HarmonicGP, optional
        Settings; degree 8, fixed, if not given: a fixed degree makes the evidence smooth.
    rate_bracket : (float, float)
        Rates between which it lies, rad/s; negative for retrograde.
    gm, radius : float
        Of the body, SI: the learner's units.
    pole : sequence of float
        Spin axis in the axes of the trajectory, known.
    noise : NoiseLevel, optional
        Of positions (m) and accelerations (m/s2).

    Raises
    ------
    ConfigError
        If the bracket is no interval, or too wide for the time span; if the pole is no direction.
    DataError
        If the trajectory has no accelerations or is not inertial.
    """
    low, high = (float(rate) for rate in rate_bracket)
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ConfigError(
            f"rate_bracket is {tuple(rate_bracket)}", allowed="(lowest, highest), rad/s"
        )
    search = _Search.of(trajectory, learner, NormalisedUnits.of_body(gm, radius), pole, noise)
    step = 1.0 / (search.scan_degree * search.span)
    count = math.ceil((high - low) / step) + 1
    if count > _MOST:
        raise ConfigError(
            f"rate_bracket of {high - low:.3g} rad/s takes {count} rates on a span of "
            f"{search.span:.3g} s",
            allowed=f"{_MOST} rates",
            do=f"narrow it to {_MOST * step:.3g} rad/s, or give less of the trajectory",
        )
    rates = np.linspace(low, high, max(count, 9))
    with one_thread():
        values = np.array([search.evidence(rate, search.scan_degree) for rate in rates])
        return search.estimate(rates, values)


@dataclass(frozen=True)
class _Search:
    """Samples about the pole, normalised, and how they are scored."""

    learner: HarmonicGP
    times: Array
    positions: Array
    accelerations: Array
    noise: NoiseLevel
    span: float

    @classmethod
    def of(
        cls,
        trajectory: Trajectory,
        learner: HarmonicGP | None,
        units: NormalisedUnits,
        pole: Sequence[float],
        noise: NoiseLevel | None,
    ) -> _Search:
        if trajectory.accelerations is None or trajectory.frame != "inertial":
            raise DataError(
                f"{trajectory.source or 'trajectory'}: frame {trajectory.frame}, accelerations "
                f"{'missing' if trajectory.accelerations is None else 'there'}",
                allowed="inertial axes, with accelerations",
            )
        turn, noise = _equator(pole), noise or NoiseLevel()
        samples = None if noise.samples is None else noise.samples / units.acceleration
        scaled = NoiseLevel(
            noise.position / units.length, noise.acceleration / units.acceleration, samples
        )
        # Rates are counted from the middle of the span: least correlated with the meridian.
        middle = 0.5 * (trajectory.times[0] + trajectory.times[-1])
        return cls(
            HarmonicGP(degree=8, least_degree=8) if learner is None else learner,
            trajectory.times - middle,
            trajectory.positions @ turn.T / units.length,
            trajectory.accelerations @ turn.T / units.acceleration,
            scaled,
            float(trajectory.times[-1] - trajectory.times[0]),
        )

    @property
    def scan_degree(self) -> int:
        highest = self.learner.degree
        return _SCAN_DEGREE if isinstance(highest, str) else min(_SCAN_DEGREE, highest)

    def fit(self, rate: float, degree: int | None = None) -> tuple[HarmonicGP, Array]:
        """Return the field fitted at a rate, and the body-fixed positions."""
        turns = body_fixed_from_inertial(self.times, rate)
        x, y = turned(turns, self.positions), turned(turns, self.accelerations)
        params = self.learner.get_params()
        if degree is not None:
            params |= {"degree": degree, "least_degree": degree}
        return HarmonicGP(**params).fit(x, y, self.noise), x

    def evidence(self, rate: float, degree: int | None = None) -> float:
        return float(self.fit(rate, degree)[0].log_evidence_)

    def estimate(self, rates: Array, values: Array) -> SpinEstimate:
        """Refine the best rate and say how well it is known, or that it is not."""
        best, step = int(np.argmax(values)), float(rates[1] - rates[0])
        gain = float(values[best] - np.median(values))

        def refused(reason: str) -> SpinEstimate:
            return SpinEstimate(False, math.nan, math.nan, reason, gain, rates, values)

        if (
            gain < _LEAST_GAIN + math.log(len(rates))
            or self._turning_share(float(rates[best])) < _ROUNDING
        ):
            return refused(
                "no rate of the bracket is more likely than the others: the field is zonal about "
                "the pole, its tesserals are below the noise, or the bracket is too narrow"
            )
        if best in (0, len(rates) - 1):
            return refused(
                f"the likelihood rises towards {rates[best]:.6g} rad/s, the end of the bracket; "
                "widen it"
            )
        found = minimize_scalar(
            lambda rate: -self.evidence(float(rate)),
            bounds=(rates[best - 1], rates[best + 1]),
            method="bounded",
            options={"xatol": 1e-9 * step, "maxiter": 100},
        )
        rate, top = float(found.x), -float(found.fun)
        sigma = self._sigma(rate, top, step)
        if sigma is None:
            return refused("the evidence has no smooth maximum there")
        # Another rate as likely, off the peak: the data do not choose.
        rival = np.abs(rates - rate) > max(2.0 * step, 5.0 * sigma)
        if np.any(values[rival] > values[best] - _LEAST_GAIN):
            other = rates[rival][int(np.argmax(values[rival]))]
            return refused(f"{rate:.6g} and {other:.6g} rad/s are about equally likely")
        return SpinEstimate(True, rate, sigma, "", gain, rates, values)

    def _sigma(self, rate: float, top: float, step: float) -> float | None:
        """Return the width at which the log evidence falls by about a half, as for a Gaussian."""
        width = 0.25 * step
        for _ in range(40):
            sides = self.evidence(rate - width), self.evidence(rate + width)
            drop = top - 0.5 * (sides[0] + sides[1])
            if 0.2 < drop < 1.0:
                return width / math.sqrt(2.0 * drop)
            # A fall that is not that of a parabola yet is approached in steps.
            scale = math.sqrt(0.5 / drop) if drop > 0.0 else 4.0
            width *= min(max(scale, 0.1), 4.0)
            if width > step or width < 1e-12 * step:
                return None
        return None

    def _turning_share(self, rate: float) -> float:
        """Return the root mean square of what is not zonal over that of the whole acceleration."""
        fitted, x = self.fit(rate)
        whole = fitted.predict(x)
        names = fitted.coefficient_names()
        low = [name.endswith("_0") or name.split("_")[1] == "1" for name in names]
        fitted.coefficients_ = np.where(low, 0.0, fitted.coefficients_)
        return float(np.sqrt(np.mean(fitted.predict(x) ** 2) / np.mean(whole**2)))


def _equator(pole: Sequence[float]) -> Array:
    """Rotation (3, 3) from the axes of the pole's components to axes with z along it."""
    z = as_array(np.array(pole, dtype=np.float64), (3,), "pole")
    size = float(np.linalg.norm(z))
    if size == 0.0:
        raise ConfigError("pole is zero", allowed="a direction")
    z = z / size
    # As it is where the pole is z.
    start = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = start - (start @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])
