"""The test of the physics-informed gravity networks (PINN-GM-III) with our rows and a network.

    UNMODELED_DATA=.../real python benchmarks/pinn_protocol.py [--small]

Eros with two hidden masses of +-0.1 GM at +-R/2, R = 16 km; 500 and 50,000 samples between the
surface and 10 R; without noise and with 10 %. Errors in percent on planes of +-3 R, within 1 R, 1
to 10 R, 10 to 100 R, on the facets; 24 h of flight; seconds. Finished rows are kept in
``runs/pinn``; the table goes to ``benchmarks/results/pinn_protocol.csv`` and ``.md``. What is
smaller than published is printed, and stands in docs/skill.md.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pinn.metrics import evaluation_times, fly_spinning, percent_error, trajectory_error
from pinn.rows import ROWS, UNIT_A, Row, Samples, units
from pinn.truth import RADIUS, SPIN_RATE, Truth, eros_mesh, observations, test_points

from unmodeled.core.arrays import Array
from unmodeled.core.errors import UnmodeledError
from unmodeled.core.threads import one_thread
from unmodeled.reports.numbers import number, seconds_text

ROOT = Path(__file__).parents[1]
#: Part of every row's identity: raise it when the same row starts to be measured in another way.
FORMAT = 1
REGIONS = ("planes", "interior", "exterior", "extrapolation", "surface")
#: Start of the flight, m and m/s, and its nodes.
START = np.array([28_800.0, 0.0, 0.0]), np.array([0.0, 0.0, 4.146])
NODES = np.linspace(0.0, 86_400.0, 1000)


def main() -> None:
    """Run what is not finished, then write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true", help="500 samples, coarse planes, no nets")
    parser.add_argument("--planes", type=int, default=60, help="points on an axis (published: 200)")
    parser.add_argument("--rows", nargs="+", default=[], help="only rows whose name holds a word")
    parser.add_argument("--runs", type=Path, default=ROOT / "runs" / "pinn")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results")
    arguments = parser.parse_args()
    planes = 20 if arguments.small else arguments.planes
    mesh, source = eros_mesh()
    truth = Truth(mesh)
    arguments.runs.mkdir(parents=True, exist_ok=True)
    print(f"{source}, {len(mesh.faces)} facets (published: 200,700)", flush=True)
    with one_thread():
        test = prepared(truth, planes, 1000, arguments.runs, source)
        store = arguments.runs / "rows.jsonl"
        finished = read(store)
        table = []
        for count in (500,) if arguments.small else (500, 50_000):
            for noise in (0.0, 0.1):
                samples: Samples | None = None
                for row in ROWS:
                    small = not arguments.small or "PINN" not in row.name
                    if not small or (
                        arguments.rows and not any(w in row.name for w in arguments.rows)
                    ):
                        continue
                    key = identity(row, count, noise, planes, source, len(mesh.faces))
                    if key not in finished:
                        samples = samples or drawn(truth, count, noise, arguments.runs, source)
                        found = {"key": key} | run(row, samples, test)
                        with store.open("a") as file:
                            file.write(json.dumps(found) + "\n")
                            file.flush()
                            os.fsync(file.fileno())
                        finished[key] = found
                        print(f"{count} {noise:g} {row.name}: {line(found)}", flush=True)
                    head = {"samples": count, "noise": noise, "row": row.name}
                    table.append(head | finished[key])
    frame = pd.DataFrame(table).drop(columns="key")
    arguments.out.mkdir(parents=True, exist_ok=True)
    name = "pinn_protocol_small" if arguments.small else "pinn_protocol"
    frame.to_csv(arguments.out / f"{name}.csv", index=False, float_format="%.5g")
    text = markdown(frame, source, len(mesh.faces), planes)
    (arguments.out / f"{name}.md").write_text(text, encoding="utf-8")
    print(text)


def identity(row: Row, count: int, noise: float, planes: int, source: str, faces: int) -> str:
    """Return what tells one result from another."""
    what = [FORMAT, row.name, row.settings, row.most, count, noise, planes, source, faces]
    return hashlib.sha256(json.dumps(what).encode()).hexdigest()[:24]


def read(store: Path) -> dict[str, dict[str, Any]]:
    """Return finished rows by key; a last line that was cut off does not count."""
    finished = {}
    for text in store.read_text().splitlines() if store.exists() else ():
        try:
            found = json.loads(text)
        except json.JSONDecodeError:
            continue
        finished[found["key"]] = found
    return finished


def prepared(
    truth: Truth, planes: int, count: int, folder: Path, source: str
) -> dict[str, tuple[Array, Array]]:
    """Return points (m) and true accelerations (m/s2) of each region, and the true flight."""
    path = folder / f"truth-{len(truth.mesh.faces)}-{source.split()[0]}-{planes}-{count}.npz"
    if not path.exists():
        points = test_points(truth, planes, count)
        pairs = {k: np.stack([x, truth.acceleration(x)]) for k, x in points.items()}
        flown = fly_spinning(truth.acceleration, *START, NODES, SPIN_RATE)
        np.savez(path, flight=np.stack([flown, flown]), **pairs)
    with np.load(path) as held:
        return {k: (held[k][0], held[k][1]) for k in held.files}


def drawn(truth: Truth, count: int, noise: float, folder: Path, source: str) -> Samples:
    """Return training samples; positions and accelerations are kept on the disk."""
    path = folder / f"train-{len(truth.mesh.faces)}-{source.split()[0]}-{count}-{noise:g}.npz"
    if not path.exists():
        x, a = observations(truth, count, noise)
        np.savez(path, x=x, a=a)
    with np.load(path) as held:
        return Samples(*units(held["x"], held["a"]), noise, truth)


def run(row: Row, samples: Samples, test: dict[str, tuple[Array, Array]]) -> dict[str, Any]:
    """Train one row and measure it; what is refused or breaks down is a row with its reason."""
    if row.most and len(samples.x) > row.most:
        return {"failure": f"not run: {len(samples.x)} samples, at most {row.most} here"}
    start, cpu = time.perf_counter(), time.process_time()
    try:
        fitted, parameters = row.fit(samples)
    except (UnmodeledError, MemoryError) as error:
        return {"failure": f"{type(error).__name__}: {error}"}
    result: dict[str, Any] = {
        "failure": "",
        "fit_s": time.perf_counter() - start,
        "fit_cpu_s": time.process_time() - cpu,
        "parameters": parameters,
    }

    def si(points: Array) -> Array:
        return fitted.predict(points / RADIUS) * UNIT_A

    for name in REGIONS:
        points, true = test[name]
        try:
            predicted = si(points)
        except UnmodeledError:  # some refuse points where their series does not hold
            predicted = np.full_like(true, np.inf)
        found = percent_error(true=true, predicted=predicted)
        result |= {f"{name}_mean": found.mean, f"{name}_median": found.median}
        result[f"{name}_worst"] = found.worst
    flight = trajectory_error(
        true=test["flight"][0], predicted=fly_spinning(si, *START, NODES, SPIN_RATE)
    )
    result |= {
        "flight_cumulative_m": flight.cumulative,
        "flight_rms_m": flight.rms,
        "flight_last_m": flight.last,
    }
    single, whole = evaluation_times(si, test["exterior"][0])
    return result | {"single_s": single, "thousand_s": whole}


def line(found: dict[str, Any]) -> str:
    """Return a result in a line."""
    if found["failure"]:
        return str(found["failure"])
    errors = ", ".join(f"{k} {number(found[f'{k}_mean'])} %" for k in REGIONS)
    return (
        f"{errors}, flight {number(found['flight_rms_m'])} m rms, "
        f"fit {seconds_text(found['fit_s'])}"
    )


def markdown(frame: pd.DataFrame, source: str, faces: int, planes: int) -> str:
    """Return the tables."""
    parts = [
        f"{source}, {faces} facets; planes of {planes} x {planes} points; percent errors, "
        "mean / median.",
    ]
    head = [
        "row",
        *REGIONS,
        "24 h of flight, sum of 1000 distances, km",
        "RMS, m",
        "fit",
        "1000 points",
        "numbers",
    ]
    for (count, noise), own in frame.groupby(["samples", "noise"], sort=True):
        parts += ["", f"{count:,} samples, {100 * noise:g} % noise", ""]
        parts += ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
        for _, r in own.iterrows():
            if r["failure"]:
                parts.append(f"| {r['row']} | {r['failure']} |" + " |" * (len(head) - 2))
                continue
            cells = [
                *(f"{number(r[f'{k}_mean'])} / {number(r[f'{k}_median'])}" for k in REGIONS),
                number(r["flight_cumulative_m"] / 1e3),
                number(r["flight_rms_m"]),
                seconds_text(r["fit_s"]),
                seconds_text(r["thousand_s"]),
                f"{int(r['parameters'])}",
            ]
            parts.append("| " + " | ".join([r["row"], *cells]) + " |")
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    main()
