"""Time to test initial conditions about Bennu for collision within 50 Kepler periods.

python benchmarks/collision_screening.py --count 10000
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from unmodeled.core.seeds import Streams
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.elements import kepler_period
from unmodeled.datasets.initial_conditions import SCREENING_PERIODS, sample_elements, states_of
from unmodeled.datasets.simulation import gravity_of


def main() -> None:
    """Draw, test, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000)
    count = parser.parse_args().count
    body = load_body("bennu")
    dynamics = gravity_of(body)
    radius = body.brillouin_radius
    elements = sample_elements(count, Streams(1).generator("initial_conditions"))
    states = states_of(elements, body.gm, radius)
    periods = kepler_period(elements["semi_major_axis"].to_numpy() * radius, body.gm)
    start = time.perf_counter()
    entry = dynamics.first_collision(states, SCREENING_PERIODS * periods, radius)
    seconds = time.perf_counter() - start
    free = np.isnan(entry)
    first = np.mean(entry[~free] < periods[~free])
    print(f"{count} initial conditions tested in {seconds:.1f} s, one thread, with compilation")
    print(f"collision-free: {100 * free.mean():.1f} %")
    print(f"of the others, in the first period: {100 * first:.0f} %")


if __name__ == "__main__":
    main()
