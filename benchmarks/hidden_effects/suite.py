"""Run the hidden-effect suite: simulated cases with known missing effects, diagnosed blind.

    python benchmarks/hidden_effects/suite.py --workers 2          # all cases, resumable
    python benchmarks/hidden_effects/suite.py --limit 40           # a quick look
    python benchmarks/hidden_effects/summary.py                    # tables from the results

Each finished case is one line of results.jsonl; a second start continues where the first stopped.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

HERE = Path(__file__).parent
RESULTS = HERE / "results.jsonl"
SCENARIOS = ("bennu", "eros", "meo", "geo", "lunar", "cislunar", "heliocentric", "leo")
#: Cheap scenarios carry more cases; range and range-rate tracking carries the station effects.
WEIGHTS = {"bennu": 5, "eros": 4, "meo": 3, "geo": 2, "lunar": 2, "cislunar": 2,
           "heliocentric": 3, "leo": 1}  # fmt: skip
#: Where a force that the catalogue lacks can be told from all that it has.
FAR = ("bennu", "heliocentric", "cislunar")
STRENGTHS = (10.0, 30.0, 100.0, 1000.0)
#: A hidden parameter may be this many times its expected size: beyond, the label is unphysical.
PLAUSIBLE = 3.0
#: Pairs of effects that would need this many times the strength to stand out beside each other.
INSEPARABLE = 30.0
HIDDEN_WELL = 1e6


@dataclass(frozen=True)
class Task:
    """One case: scenario, seed, how many effects of which strength, and what is special."""

    kind: str
    scenario: str
    seed: int
    strengths: tuple[float, ...]
    noise_factor: float = 1.0

    @property
    def key(self) -> str:
        """Name of the case."""
        strengths = "+".join(f"{s:g}" for s in self.strengths) or "0"
        return f"{self.kind}/{self.scenario}/{self.seed}/{strengths}/{self.noise_factor:g}"


def tasks() -> list[Task]:
    """Return all cases."""
    cycle = [s for s in SCENARIOS for _ in range(WEIGHTS[s])]
    seeds = iter(range(1000, 100000))

    def spread(count: int) -> Iterator[tuple[str, int]]:
        for k in range(count):
            yield cycle[(7 * k) % len(cycle)], next(seeds)

    found = [Task("none", s, n, ()) for s, n in spread(200)]
    for strength in STRENGTHS:
        found += [Task("one", s, n, (strength,)) for s, n in spread(45)]
    found += [
        Task("two", s, n, (100.0, 1000.0 if k % 2 else 100.0))
        for k, (s, n) in enumerate(spread(30))
    ]
    found += [Task("three", s, n, (100.0, 300.0, 1000.0)) for s, n in spread(16)]
    found += [Task("one", s, n, (400.0,), 2.0) for s, n in spread(10)]
    found += [Task("one", s, n, (25.0,), 0.5) for s, n in spread(10)]
    found += [Task("none", s, n, (), 2.0) for s, n in spread(10)]
    found += [Task("outside", s, next(seeds), (300.0,)) for s in FAR for _ in range(7)]
    found += [Task("instrument", "leo_tracking", next(seeds), (s,)) for s in (100.0, 1000.0) * 4]
    found += [
        Task("instrument", s, next(seeds), (300.0,)) for s in ("leo", "meo") for _ in range(4)
    ]
    # Power where it is neither 0 nor 1 takes more cases to measure.
    found += [Task("one", s, n, (10.0,)) for s, n in spread(45)]
    return found


def run(task: Task) -> dict[str, object]:
    """Simulate and diagnose one case; the diagnosis gets the case only."""
    from unmodeled.pipeline.cases.simulate_case import simulate
    from unmodeled.pipeline.diagnosis.diagnose import diagnose

    begin = time.perf_counter()
    simulated = draw(task, simulate)
    middle = time.perf_counter()
    d = diagnose(simulated.case)
    end = time.perf_counter()
    by_name = {c.name: c for c in simulated.case.candidates}
    return {
        "key": task.key,
        **asdict(task),
        "truth": {n: {k: float(v) for k, v in values.items()}
                  for n, values in simulated.truth.items()},
        "sizes": {n: len(by_name[n].estimate) for n in simulated.truth if n in by_name},
        "verdict": d.verdict,
        "found": [
            {
                "name": f.name,
                "class": list(f.class_names),
                "drop": f.drop,
                "threshold": f.threshold,
                "confidence": f.confidence,
                "estimates": {e.name: [e.value, e.sigma] for e in f.estimates},
            }
            for f in d.findings
        ],
        "alternatives": [list(a.effects) for a in d.alternatives],
        "dismissed": [x.name for x in d.dismissed],
        "ideal": ideal(task, simulated),
        "held_out": [d.steps[0].held_out_rms, d.steps[-1].held_out_rms],
        "forecast": [d.forecast.before, d.forecast.after, d.forecast.log10_p]
        if d.forecast else None,
        "log_p_limit": d.log_p_limit,
        "noise": d.noise,
        "remainder_log10_p": d.remainder_log10_p,
        "rms": [s.rms for s in d.steps],
        "simulate_s": middle - begin,
        "diagnose_s": end - middle,
    }  # fmt: skip


def draw(task: Task, simulate):
    """Return a simulated case whose hidden effects are seen by the data and plausible in size."""
    from unmodeled.pipeline.cases.simulate_case import HiddenEffect

    if not task.strengths:
        return simulate(task.scenario, task.seed, noise_factor=task.noise_factor)
    # Three effects that stand out beside each other may not exist on an orbit: then on another.
    for attempt in range(4):
        made = drawn(replace(task, seed=task.seed + 100_000 * attempt), simulate, HiddenEffect)
        if made is not None:
            return made
    raise RuntimeError(f"no plausible effect for {task.key}")


def drawn(task: Task, simulate, hidden_effect):
    """Return a simulated case of a seed; None if no draw of effects is seen and plausible."""
    from unmodeled.core.errors import UnmodeledError

    case = simulate(task.scenario, task.seed).case
    rng = np.random.default_rng(task.seed)
    if task.kind == "outside":
        from unmodeled.pipeline.cases.outside_effects import outside_effects

        names = [c.name for c in outside_effects(case)]
    elif task.kind == "instrument":
        names = [c.name for c in case.candidates if c.family == "instrument"]
    else:
        names = [c.name for c in case.candidates if c.family != "instrument"]
    by_name = {c.name: c for c in case.candidates}
    for _ in range(20):
        chosen = [str(n) for n in rng.permutation(names)[: len(task.strengths)]]
        try:
            made = simulate_at(task, chosen, np.array(task.strengths), simulate, hidden_effect)
            ratio = np.array(task.strengths) / beside(task, made)
            if np.any(ratio > (HIDDEN_WELL if task.kind == "outside" else INSEPARABLE)):
                continue
            if np.any(np.abs(ratio - 1.0) > 0.01):
                strengths = np.array(task.strengths) * ratio
                made = simulate_at(task, chosen, strengths, simulate, hidden_effect)
        except UnmodeledError:
            continue
        if all(plausible(by_name[n], v) for n, v in made.truth.items() if n in by_name):
            return made
    return None


def simulate_at(task: Task, names, strengths, simulate, hidden_effect):
    """Simulate with each effect at its own non-centrality."""
    hidden = [hidden_effect(n, noncentrality=float(s))
              for n, s in zip(names, strengths, strict=True)]  # fmt: skip
    # A weak effect's held-out arc shows nothing, and costs as much.
    held_out = task.kind in ("one", "two", "three") and min(task.strengths) >= 100.0
    return simulate(
        task.scenario, task.seed, hidden, noise_factor=task.noise_factor, held_out=held_out
    )


def beside(task: Task, simulated) -> np.ndarray:
    """Return each effect's non-centrality beside the others that are hidden.

    Of an effect outside the catalogue: beside the three effects of the catalogue that together
    are most like it. What nearly coincides with another effect is strong only in what is left
    beside that one.
    """
    from unmodeled.pipeline.cases.outside_effects import outside_effects
    from unmodeled.pipeline.diagnosis.pool import Pool
    from unmodeled.pipeline.linearisation import Linearisation

    case = simulated.case
    lin = Linearisation(case, case.fit(settled=1e-3))
    known = {c.name: c for c in (*case.candidates, *outside_effects(case))}
    spans, signals = [], []
    for name, values in simulated.truth.items():
        c = known[name]
        at = {**c.values, **values}
        # Linear in the estimated parameters: their derivative where the effect is absent.
        null = {**at, **{n: c.values[n] for n in c.estimate}}
        columns = lin.project(lin.columns(c.effect, null, c.estimate))
        change = np.array([values[n] - c.values[n] for n in c.estimate])
        spans.append(columns)
        signals.append(columns @ change)
    if task.kind == "outside":
        return np.array([max(unexplained(Pool(lin, case.candidates), signals[0]), 1e-3)])
    out = []
    for k, signal in enumerate(signals):
        rest = [s for j, s in enumerate(spans) if j != k]
        left = signal
        if rest:
            other = np.concatenate(rest, axis=1)
            other = other / np.maximum(np.linalg.norm(other, axis=0), 1e-300)
            left = signal - other @ np.linalg.lstsq(other, signal, rcond=1e-10)[0]
        out.append(float(left @ left))
    return np.maximum(np.array(out), 1e-3)


def ideal(task: Task, simulated) -> float | None:
    """Return the chance that the true set is the best-fitting one of its size, at most.

    Of two signals a fit prefers the right one with Phi(sqrt(lambda (1 - rho^2)) / 2), lambda the
    strength beside the other hidden effects and rho the correlation beside them: the smallest such
    chance over all exchanges of one hidden effect for one of the catalogue that has no more
    parameters. No method that looks at these data alone names the set more often.
    """
    import scipy.stats

    from unmodeled.pipeline.diagnosis.pool import Pool
    from unmodeled.pipeline.linearisation import Linearisation

    case = simulated.case
    by_name = {c.name: c for c in case.candidates}
    if not simulated.truth or not set(simulated.truth) <= set(by_name):
        return None
    model = {**case.dynamics.values, **case.instrument_values}
    # Candidates at the places where the hidden ones act; the others' places count as one each.
    placed = [
        replace(c, places=(), values={**c.values, **simulated.truth[c.name]} | {
            n: c.values[n] for n in c.estimate})
        if c.name in simulated.truth else c
        for c in case.candidates
    ]  # fmt: skip
    pool = Pool(Linearisation(case, case.fit(settled=1e-3)), placed)
    first = {}
    for k, m in enumerate(pool.members):
        first.setdefault(m.candidate.name, k)
    chosen = [first[n] for n in simulated.truth]
    theta = []
    for n in simulated.truth:
        c = by_name[n]
        null = np.array([c.values.get(p, model.get(p, 0.0)) for p in c.estimate])
        change = np.array([simulated.truth[n][p] for p in c.estimate]) - null
        theta += list(change / np.array(c.priors))
    index = pool.index(chosen)
    pool.product = pool.gram[:, index] @ np.array(theta)  # data without noise
    whole = pool.score(chosen).drop
    chance = 1.0
    for out in chosen:
        rest = [k for k in chosen if k != out]
        base = pool.score(rest).drop if rest else 0.0
        G, c = pool.beside(rest)
        gaps = np.maximum(whole - base - pool.drops(G, c), 0.0)
        for k, m in enumerate(pool.members):
            if m.candidate.name in simulated.truth or m.size > pool.members[out].size:
                continue
            chance = min(chance, float(scipy.stats.norm.cdf(
                0.5 * np.sqrt(gaps[k]) / task.noise_factor)))  # fmt: skip
    return chance


def unexplained(pool, signal: np.ndarray, most: int = 3) -> float:
    """Return what the best three effects of the catalogue, chosen greedily, leave of a signal."""
    G, c = pool.gram, pool.columns.T @ signal
    left, chosen = float(signal @ signal), []
    for _ in range(most):
        drops = pool.drops(G, c)
        best = int(np.argmax(drops))
        left -= drops[best]
        chosen.append(best)
        index = pool.index(chosen)
        inverse = np.linalg.pinv(pool.gram[np.ix_(index, index)], rcond=1e-10, hermitian=True)
        cross = pool.gram[:, index] @ inverse
        G = pool.gram - cross @ pool.gram[index]
        c = pool.columns.T @ signal - cross @ (pool.columns[:, index].T @ signal)
    return left


def plausible(candidate, values) -> bool:
    """Whether the hidden parameters are of the expected size."""
    return all(
        abs(values[n] - candidate.values[n]) <= PLAUSIBLE * prior
        for n, prior in zip(candidate.estimate, candidate.priors, strict=True)
    )


def _safely(task: Task) -> dict[str, object]:
    try:
        return run(task)
    except Exception as exc:  # noqa: BLE001 - a failure is a result: it counts against the tool
        return {"key": task.key, **asdict(task), "failure": f"{type(exc).__name__}: {exc}",
                "traceback": traceback.format_exc()}  # fmt: skip


def main() -> None:
    """Parse, run, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--limit", type=int)
    parser.add_argument("--only", help="kinds, comma separated")
    parser.add_argument("--stride", type=int, default=1, help="every n-th case")
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--again", help="kinds, comma separated, whose results are dropped first")
    args = parser.parse_args()
    if args.again and args.out.exists():
        lines = [line for line in args.out.read_text().splitlines() if line]
        kept = [x for x in lines if json.loads(x)["kind"] not in args.again.split(",")]
        args.out.write_text("".join(x + "\n" for x in kept))
    todo = [t for t in tasks() if not args.only or t.kind in args.only.split(",")][:: args.stride]
    done = set()
    if args.out.exists():
        done = {json.loads(line)["key"] for line in args.out.read_text().splitlines() if line}
    todo = [t for t in todo if t.key not in done][: args.limit]
    # One scenario after the other: its compilations are shared within a worker.
    # The long ones last.
    todo.sort(key=lambda t: (t.scenario.startswith("leo"), t.kind == "outside", t.scenario, t.kind))
    print(f"{len(todo)} cases to run, {len(done)} done")
    begin = time.perf_counter()
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(_safely, t): t for t in todo}
        for k, future in enumerate(as_completed(futures), 1):
            with args.out.open("a") as out:
                out.write(json.dumps(future.result()) + "\n")
            if k % 10 == 0:
                print(f"{k} of {len(todo)}, {time.perf_counter() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main()
