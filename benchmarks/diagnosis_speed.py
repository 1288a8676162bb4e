"""Time of a diagnosis: a three-day Bennu case, and a case with 10,000 measured positions.

    python benchmarks/diagnosis_speed.py

The first call compiles; the second shows what a diagnosis costs after that.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

from unmodeled.datasets.measurements import Measurements  # noqa: E402
from unmodeled.pipeline.cases.case import Case  # noqa: E402
from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate  # noqa: E402
from unmodeled.pipeline.diagnosis.diagnose import diagnose  # noqa: E402


def dense(case: Case, count: int) -> Case:
    """Return the case with many more positions along the same orbit, new noise."""
    fit = case.fit()
    final = diagnose(case).final_case
    (arc,) = final.arcs
    m = arc.measurements[0]
    times = np.linspace(m.times[0], m.times[-1], count)
    states = final.dynamics.propagate(arc.state, np.concatenate([[arc.epoch], times]))[1:]
    noise = m.sigmas[0, 0] * np.random.default_rng(0).standard_normal((count, 3))
    more = Measurements("position", times, states[:, :3] + noise, m.sigmas[0, 0], m.label)
    return replace(case, arcs=(replace(arc, state=fit.states[0], measurements=(more,)),))


def timed(name: str, case: Case) -> None:
    """Print the time of a first and a second diagnosis."""
    seconds = []
    for _ in range(2):
        begin = time.perf_counter()
        answer = diagnose(case)
        seconds.append(time.perf_counter() - begin)
    count = sum(m.values.size for arc in case.arcs for m in arc.measurements)
    print(
        f"{name}: {count} measured components, {len(case.candidates)} candidates, "
        f"first {seconds[0]:.1f} s, again {seconds[1]:.1f} s: {answer.sentence}"
    )


def main() -> None:
    """Run both."""
    case = simulate("bennu", 4, [HiddenEffect("srp", noncentrality=1000.0)]).case
    timed("Bennu, 3 days", case)
    timed("10,000 positions", dense(case, 10_000))


if __name__ == "__main__":
    main()
