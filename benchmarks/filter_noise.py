"""What a wrong process noise costs, and what the adaptive ones make of it.

    python benchmarks/filter_noise.py

100 runs of relative motion, positions to 0.1 m every 10 s, an acceleration noise ten times as large
as the filter is told; errors and consistency over the last half of 2,000 epochs. About 20 s.
"""

import numpy as np

from unmodeled.pipeline.filters.adaptive import ForgettingNoise, MatchedNoise
from unmodeled.pipeline.filters.consistency import consistency
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.linear import LinearMeasurement, LinearModel
from unmodeled.pipeline.filters.process_noise import WhiteAcceleration
from unmodeled.pipeline.filters.run import run_filter
from unmodeled.pipeline.filters.state import FilterState


def main() -> None:
    """Print one line for each noise."""
    rng = np.random.default_rng(0)
    n = 8.6e-4  # Clohessy-Wiltshire: x radial, y along the track
    A = np.zeros((6, 6))
    A[:3, 3:] = np.eye(3)
    A[3, 0], A[3, 4], A[4, 3], A[5, 2] = 3 * n * n, 2 * n, -2 * n, -n * n
    model = LinearModel(A)
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [0.1] * 3, 6)
    start = FilterState.of(np.zeros(6), np.diag([1.0] * 3 + [1e-4] * 3), 0.0, runs=100)

    x = rng.normal(size=(100, 6)) * start.sigma
    F = model.propagate(x, 0.0, 10.0)[1][0]
    Q = WhiteAcceleration(1e-8).covariance(start, 10.0)  # what the truth has
    truth = np.empty((2000, 100, 6))
    for k in range(2000):
        x = x @ F.T + rng.multivariate_normal(np.zeros(6), Q, 100)
        truth[k] = x
    z = truth[:, :, :3] + 0.1 * rng.normal(size=(2000, 100, 3))

    wrong = WhiteAcceleration(1e-10)
    for name, noise in {
        "right": WhiteAcceleration(1e-8),
        "wrong": wrong,
        "matched": MatchedNoise(wrong),
        "paper mode": ForgettingNoise(wrong.covariance(start, 10.0), 0.99),
    }.items():
        run = run_filter(
            ExtendedKalmanFilter(model, measurement, noise),
            start,
            10.0 * np.arange(1, 2001),
            z,
            truth=truth,
        )
        late = run.mean[1000:] - truth[1000:]
        print(
            f"{name:10s} {1e3 * np.sqrt(np.mean(late[:, :, :3] ** 2)):.1f} mm;",
            consistency(run, start=1000).verdict,
        )


if __name__ == "__main__":
    main()
