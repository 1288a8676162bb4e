"""Where the time of story B goes: loading, compiling, fitting, linearising, scoring a few cases.

    python benchmarks/case_speed.py                                  # simulated cases
    UNMODELED_DATA=../shared/real python benchmarks/case_speed.py    # LAGEOS-2 and SPOT-5 too
    python benchmarks/case_speed.py --only leo --cold                # as on a machine's first day

heyoka keeps compiled code on disk, so that a system is compiled once on a machine; ``--cold``
leaves that aside. Seconds are of the processor (one thread): a busy machine hardly changes them.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import heyoka as hy  # noqa: E402
import pandas as pd  # noqa: E402

from unmodeled.pipeline.cases.case import Case  # noqa: E402
from unmodeled.pipeline.cases.load_case import load_case  # noqa: E402
from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate  # noqa: E402
from unmodeled.pipeline.diagnosis.diagnose import diagnose  # noqa: E402
from unmodeled.pipeline.diagnosis.pool import Pool  # noqa: E402
from unmodeled.pipeline.diagnosis.search import best_set  # noqa: E402
from unmodeled.pipeline.linearisation import Linearisation  # noqa: E402

ROOT = Path(__file__).parents[1]
DATA = os.environ.get("UNMODELED_DATA")
COMPILERS = ("cfunc", "taylor_adaptive", "taylor_adaptive_batch")


def simulated(scenario: str, effect: str) -> Callable[[], Case]:
    """Return a maker of a simulated case with a hidden effect."""
    return lambda: simulate(scenario, 1, [HiddenEffect(effect, noncentrality=1000.0)]).case


def real(file: str) -> Callable[[], Case]:
    """Return a maker of a case of real data."""
    return lambda: load_case(ROOT / "cases" / file, [Path(DATA or ".")])


CASES = {"bennu": simulated("bennu", "srp"), "leo": simulated("leo", "drag")}
if DATA:
    CASES |= {
        "lageos2": real("lageos2-three-days.yaml"),
        "spot5": real("spot5-one-day.yaml"),
    }


class Compilations:
    """Counts what heyoka compiles or takes from its caches, and the seconds that takes."""

    def __init__(self) -> None:
        self.count, self.seconds = 0, 0.0
        for name in COMPILERS:
            setattr(hy, name, self._counted(getattr(hy, name)))

    def _counted(self, make: Callable[..., Any]) -> Callable[..., Any]:
        def counted(*args: Any, **options: Any) -> Any:
            begin = time.process_time()
            made = make(*args, **options)
            self.count += 1
            self.seconds += time.process_time() - begin
            return made

        return counted


class Clock:
    """Seconds by stage, those of the compilations apart."""

    def __init__(self, compilations: Compilations) -> None:
        self.compilations, self.seconds = compilations, dict[str, float]()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a block."""
        begin, before = time.process_time(), self.compilations.seconds
        yield
        inside = self.compilations.seconds - before
        self.seconds[name] = time.process_time() - begin - inside


def measured(name: str, compilations: Compilations) -> dict[str, Any]:
    """Return one line of the table."""
    count, seconds = compilations.count, compilations.seconds
    clock = Clock(compilations)
    with clock.stage("load"):
        case = CASES[name]()
    with clock.stage("fit"):
        fit = case.fit(settled=1e-3)
    with clock.stage("linearise"):
        lin = Linearisation(case.at(fit), fit)
    with clock.stage("columns"):
        pool = Pool(lin, case.candidates)
    with clock.stage("search"):
        best_set(pool, (), -12.0, 2)
    first = {
        "case": name,
        "candidates": len(case.candidates),
        "iterations": fit.iterations,
        **clock.seconds,
        "compilations": compilations.count - count,
        "compiling": compilations.seconds - seconds,
    }
    count, seconds = compilations.count, compilations.seconds
    with clock.stage("diagnose"):
        diagnose(case)
    return {
        **first,
        "diagnose": clock.seconds["diagnose"],
        "more compilations": compilations.count - count,
        "more compiling": compilations.seconds - seconds,
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--cold", action="store_true", help="compile everything anew")
    chosen = parser.parse_args()
    if chosen.cold:
        hy.llvm_state.set_diskcache_enabled(False)
    compilations = Compilations()
    lines = [measured(name, compilations) for name in chosen.only]
    print("seconds of the processor; compiling is not in the other columns")
    print(pd.DataFrame(lines).set_index("case").T.to_string(float_format="%.2f"))


if __name__ == "__main__":
    main()
