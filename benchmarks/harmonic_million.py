"""Time and peak memory of the harmonic GP of degree 20 on a stream of a million samples.

    python benchmarks/harmonic_million.py [--samples 1000000] [--degree 20]

Positions are uniform in direction with radii of 1.1 to 3 reference radii; the field is a point
mass with random coefficients of 0.01 / n^2; noise is 1e-3 on accelerations of about 4 to 30. They
are made in chunks and not kept. Set OMP_NUM_THREADS=1 for the time of one thread.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterator

import numpy as np

from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import HarmonicGP, NoiseLevel
from unmodeled.models.physics.exterior_harmonics import (
    column_degrees,
    derivative,
    exterior_harmonics,
)

NOISE = 1e-3
#: Samples that are made at once.
CHUNK = 4096


def main() -> None:
    """Make the data, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--degree", type=int, default=20)
    arguments = parser.parse_args()
    n = np.maximum(column_degrees(arguments.degree), 1)
    rng = np.random.default_rng(1)
    coefficients = 0.01 / n**2 * rng.normal(size=len(n))
    coefficients[0] = 1.0
    making = 0.0

    def chunks() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        nonlocal making
        for k in range(0, arguments.samples, CHUNK):
            start = time.process_time()
            x = rng.normal(size=(min(CHUNK, arguments.samples - k), 3))
            x *= (rng.uniform(1.1, 3.0, len(x)) / np.linalg.norm(x, axis=1))[:, None]
            table = exterior_harmonics(x, arguments.degree + 1)
            y = np.stack([coefficients @ derivative(table, i) for i in range(3)], axis=1)
            y = NORMALISED_GM * y + NOISE * rng.normal(size=y.shape)
            making += time.process_time() - start
            yield x, y

    learner = HarmonicGP(degree=arguments.degree, least_degree=arguments.degree)
    wall, cpu = time.perf_counter(), time.process_time()
    learner.fit_stream(chunks(), NoiseLevel(acceleration=NOISE))
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    deviation = np.linalg.norm(learner.covariance_root_, axis=1)
    z = (learner.coefficients_ - coefficients) / deviation
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(
        f"{arguments.samples} samples, degree {arguments.degree}: {wall:.0f} s ({cpu:.0f} s of "
        f"processor, {making:.0f} s of them to make the samples), peak {peak:.2f} GB; errors of the coefficients over their standard "
        f"deviations: root mean square {np.sqrt((z**2).mean()):.2f}, largest {np.abs(z).max():.1f}"
    )


if __name__ == "__main__":
    main()
