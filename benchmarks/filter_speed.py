"""Speed of the batched extended Kalman filter, beside filterpy's with the same physics.

    python benchmarks/filter_speed.py            # 100 runs x 21,900 steps, and side by side
    python benchmarks/filter_speed.py --steps 500  # a quick look

Six states about the Earth, positions measured, one Runge-Kutta step of state and transition for
each filter step. filterpy (MIT; the extra ``truth``) gets the same integrator for one run, called
as its users do. Three orbits of [Pesce2020] at 1 Hz are 21,900 steps.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass
from functools import lru_cache

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

from unmodeled.core.arrays import Array  # noqa: E402
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter  # noqa: E402
from unmodeled.pipeline.filters.linear import LinearMeasurement, LinearModel  # noqa: E402
from unmodeled.pipeline.filters.process_noise import WhiteAcceleration  # noqa: E402
from unmodeled.pipeline.filters.run import FilterRun, run_filter  # noqa: E402
from unmodeled.pipeline.filters.runge_kutta import RungeKutta  # noqa: E402
from unmodeled.pipeline.filters.square_root import SquareRootFilter  # noqa: E402
from unmodeled.pipeline.filters.state import FilterState  # noqa: E402

GM = 3.986004418e14
RADIUS = 8.1431e6
SIGMA = 10.0
DENSITY = 1e-8


@dataclass(frozen=True)
class TwoBody:
    """Point mass: rates and their Jacobian."""

    size: int = 6

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """See `RateModel`."""
        r = np.ascontiguousarray(x[:, :3].T)  # (3, b): long rows are faster than short ones
        square = (r * r).sum(axis=0)
        k = GM / (square * np.sqrt(square))
        rate = np.empty_like(x)
        rate[:, :3] = x[:, 3:]
        rate[:, 3:] = (-k * r).T
        gradient = (3.0 * k / square * r)[:, None] * r
        for i in range(3):
            gradient[i, i] -= k
        A = _of_velocity(len(x)).copy()
        A[:, 3:, :3] = gradient.transpose(2, 0, 1)
        return rate, A


@lru_cache
def _of_velocity(runs: int) -> Array:
    """Jacobians with the unit matrix of dr/dt = v, zero elsewhere."""
    return np.repeat(np.eye(6, k=3)[None], runs, axis=0)


_ONE = np.eye(3)


def data(runs: int, steps: int) -> tuple[FilterState, Array, Array, Array]:
    """Return the start, times, truth (k, b, 6) and measured positions (k, b, 3)."""
    rng = np.random.default_rng(0)
    x = np.array([[RADIUS, 0, 0, 0, np.sqrt(GM / RADIUS), 0]])
    truth = np.empty((steps, 1, 6))
    model = RungeKutta(TwoBody())
    for k in range(steps):
        x, _ = model.propagate(x, float(k), 1.0)
        truth[k] = x
    start = FilterState.of(
        [RADIUS, 0, 0, 0, np.sqrt(GM / RADIUS), 0], np.diag([1e4] * 3 + [1.0] * 3), 0.0, runs
    )
    z = truth[:, :, :3] + SIGMA * rng.normal(size=(steps, runs, 3))
    return start, np.arange(1.0, steps + 1.0), truth, z


def ours(kind: type[ExtendedKalmanFilter], start: FilterState, times: Array, z: Array) -> FilterRun:
    """Filter all runs at once."""
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [SIGMA] * 3, 6)
    filter_ = kind(RungeKutta(TwoBody()), measurement, WhiteAcceleration(DENSITY))
    return run_filter(filter_, start, times, z)


def filterpys(start: FilterState, times: Array, z: Array) -> tuple[float, Array, Array]:
    """Filter one run after another with filterpy; return seconds, last means and sigmas."""
    from filterpy.kalman import ExtendedKalmanFilter as Other

    H = np.eye(3, 6)
    Q = WhiteAcceleration(DENSITY).covariance(start, 1.0)

    def rates(x: Array) -> tuple[Array, Array]:
        r = x[:3]
        square = r @ r
        k = GM / (square * np.sqrt(square))
        A = np.zeros((6, 6))
        A[:3, 3:] = _ONE
        A[3:, :3] = (3.0 * k / square) * np.outer(r, r) - k * _ONE
        return np.concatenate([x[3:], -k * r]), A

    def step(x: Array, h: float) -> tuple[Array, Array]:
        F = np.eye(6)
        k1, A = rates(x)
        d1 = A @ F
        k2, A = rates(x + 0.5 * h * k1)
        d2 = A @ (F + 0.5 * h * d1)
        k3, A = rates(x + 0.5 * h * k2)
        d3 = A @ (F + 0.5 * h * d2)
        k4, A = rates(x + h * k3)
        d4 = A @ (F + h * d3)
        F = F + h / 6.0 * (d1 + 2.0 * d2 + 2.0 * d3 + d4)
        return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), F

    class TwoBodyFilter(Other):  # type: ignore[misc]
        def predict_x(self, u: float = 0) -> None:
            self.x, self.F = step(self.x, 1.0)

    means, sigmas = [], []
    began = time.process_time()
    for run in range(z.shape[1]):
        other = TwoBodyFilter(6, 3)
        other.x, other.P = start.mean[run].copy(), start.covariance[0].copy()
        other.Q, other.R = Q, SIGMA**2 * np.eye(3)
        for k in range(len(times)):
            other.predict()
            other.update(z[k, run], lambda x: H, lambda x: H @ x)
        means.append(other.x)
        sigmas.append(np.sqrt(np.diag(other.P)))
    return time.process_time() - began, np.array(means), np.array(sigmas)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--steps", type=int, default=21_900)
    parser.add_argument("--beside", type=int, default=1000, help="steps of the comparison")
    options = parser.parse_args()
    start, times, truth, z = data(options.runs, options.steps)
    rows = []
    for kind in (ExtendedKalmanFilter, SquareRootFilter):
        steps = options.steps if kind is ExtendedKalmanFilter else min(2000, options.steps)
        run = ours(kind, start, times[:steps], z[:steps])
        rows.append((kind.__name__, options.runs, steps, run.seconds, run.seconds_per_step))
        late = run.mean[steps // 2 :] - truth[steps // 2 : steps]
        rows[-1] += (float(np.sqrt(np.mean(late[:, :, :3] ** 2))),)
    relative = np.zeros((6, 6))
    relative[:3, 3:] = _ONE
    relative[[3, 3, 4, 5], [0, 4, 3, 2]] = [3e-6, 2e-3, -2e-3, -1e-6]
    linear = ExtendedKalmanFilter(
        LinearModel(relative),
        LinearMeasurement.of_sigma([0, 1, 2], [SIGMA] * 3, 6),
        WhiteAcceleration(DENSITY),
    )
    run = run_filter(linear, start, times[:2000], z[:2000] - truth[:2000, :, :3])
    rows.append(("linear model", options.runs, len(run.times), run.seconds, run.seconds_per_step))
    print("filter                runs  steps   seconds  us a filter step  RMSE, m")
    for name, runs, steps, seconds, each, *error in rows:
        tail = f"{error[0]:10.3f}" if error else ""
        print(f"{name:20s} {runs:5d} {steps:6d} {seconds:9.2f} {1e6 * each:12.2f}     {tail}")
    # side by side: processor seconds, in turns, the least of five
    few, beside = slice(0, 2), min(options.beside, options.steps)
    cut = FilterState(start.mean[few], start.covariance, start.time)
    single = FilterState(start.mean[:1], start.covariance, start.time)
    each = {"filterpy": [], "one": [], "batch": []}  # type: dict[str, list[float]]
    for _ in range(5):
        seconds, means, sigmas = filterpys(cut, times[:beside], z[:beside, few])
        each["filterpy"].append(seconds / (2 * beside))
        for name, begin in (("one", single), ("batch", start)):
            b = len(begin.mean)
            clock = time.process_time()
            ours(ExtendedKalmanFilter, begin, times[:beside], z[:beside, :b])
            each[name].append((time.process_time() - clock) / (b * beside))
    theirs, one, batch = (min(values) for values in each.values())
    same = ours(ExtendedKalmanFilter, cut, times[:beside], z[:beside, few])
    apart = np.abs(same.mean[-1] - means) / sigmas
    print(f"\nside by side, {beside} steps:")
    print(f"filterpy, one run after another   {1e6 * theirs:8.1f} us a filter step")
    print(f"ours, one run                     {1e6 * one:8.1f}")
    print(f"ours, {options.runs} runs at once {1e6 * batch:19.1f}")
    print(f"ratio                             {theirs / batch:8.1f}")
    print(f"largest difference of the estimates {apart.max():.1e} sigma")


if __name__ == "__main__":
    main()
