"""Errors of learned fields where the truth turns with the body: the shape of Eros, hidden masses.

    python benchmarks/turning_fields.py [--shape eros.obj] [--orbits 5] [--volume moderate]

Training orbit and as many other orbits are drawn for each seed; no noise; samples outside the
Brillouin sphere, in body-fixed and (``inertial``) inertial axes. Prints medians over the seeds of
the median fractional error. The shape is scaled to the Brillouin sphere of the card.
"""

from __future__ import annotations

import argparse

import numpy as np

from unmodeled.core.threads import one_thread
from unmodeled.pipeline.characterize import evaluate
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.prepare import prepare

_LEARNERS = [
    {"kind": "harmonic_gp", "degree": 8, "label": "harmonic gp, to degree 8"},
    {"kind": "harmonic_gp", "degree": 16, "label": "harmonic gp, to degree 16"},
    {"kind": "point_mass"},
]


def main() -> None:
    """Print a line for each field, axes and learner."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shape", help="mesh of Eros (.obj); left out: hidden masses only")
    parser.add_argument("--orbits", type=int, default=5)
    parser.add_argument("--volume", choices=("low", "moderate"), default="moderate")
    arguments = parser.parse_args()
    fields: list[dict[str, object]] = [{"kind": "hidden_masses"}]
    if arguments.shape:
        fields.append({"kind": "polyhedron", "file": arguments.shape, "degree": 20})
    for field in fields:
        for frame in ("body_fixed", "inertial"):
            found: dict[str, list[tuple[float, float]]] = {}
            for seed in range(1, arguments.orbits + 1):
                data = {"field": field | {"frame": frame}, "volume": arguments.volume}
                config = CharacterizationConfig.resolve(
                    {"body": "eros", "seed": seed, "data": data, "learners": _LEARNERS}
                )
                with one_thread():
                    made = prepare(config)
                    for spec in config.learners:
                        s = evaluate(spec, made, config, flights=False).summaries
                        pair = s["interpolation"].median, s["extrapolation"].median
                        found.setdefault(spec.label, []).append(pair)
            for label, pairs in found.items():
                inside, outside = np.median(pairs, axis=0)
                worst = np.max(pairs, axis=0)[1]
                print(
                    f"{field['kind']:14} {frame:11} {label:26} interpolation {inside:.1e}  "
                    f"extrapolation {outside:.1e} (worst seed {worst:.1e})",
                    flush=True,
                )


if __name__ == "__main__":
    main()
