"""Estimated spin rates against the true one, and the fields learned with them.

    python benchmarks/spin.py [--seeds 101 102 ...] [--noise 0.0 0.1]

Bodies with mass and spin of Eros, one orbit of ten periods (low volume); the bracket is +-10 % of
the true rate. Prints for each truth, seed and noise the offset in sigmas and the median fractional
error on another orbit of a `harmonic_gp` with the true and with the estimated rate.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from unmodeled.core.frames import body_fixed_from_inertial, turned
from unmodeled.core.threads import one_thread
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.bodies import load_body
from unmodeled.models.learned import HarmonicGP, NoiseLevel
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.estimated_spin import estimate_spin
from unmodeled.pipeline.prepare import simulate

_FIELDS = {
    "hidden masses": {"kind": "hidden_masses"},
    "eros_like": {"kind": "polyhedron", "shape": "eros_like"},
    "card's zonals (no rate to be had)": None,
}


def main() -> None:
    """Print a line for each truth, noise and seed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[101, 102, 103, 104])
    parser.add_argument("--noise", type=float, nargs="+", default=[0.0, 0.1])
    arguments = parser.parse_args()
    body = load_body("eros")
    units = NormalisedUnits.of_body(body.gm, body.brillouin_radius)
    for name, field in _FIELDS.items():
        for seed in arguments.seeds:
            data = {"volume": "low"} | ({} if field is None else {"field": field})
            config = CharacterizationConfig.resolve(
                {"body": "eros", "seed": seed, "data": data, "learners": [{"kind": "point_mass"}]}
            )
            with one_thread():
                _, orbits, _ = simulate(config, compare_integrators=False)
            orbit, other = orbits.orbits[:2]
            for sigma in arguments.noise:
                draw = np.random.default_rng(seed).normal(size=(len(orbit), 3))
                assert orbit.accelerations is not None
                seen = orbit.accelerations + sigma * units.acceleration * draw
                found = estimate_spin(
                    replace(orbit, accelerations=seen),
                    rate_bracket=(0.9 * body.spin_rate, 1.1 * body.spin_rate),
                    gm=body.gm,
                    radius=body.brillouin_radius,
                    noise=NoiseLevel(acceleration=sigma * units.acceleration),
                )
                line = f"{name:34} seed {seed} noise {sigma:<5g}"
                if not found.observable:
                    print(f"{line} {found}", flush=True)
                    continue
                off = found.rate - body.spin_rate
                errors = []
                for rate in (body.spin_rate, found.rate):
                    x, y = (
                        turned(body_fixed_from_inertial(orbit.times, rate), v / unit)
                        for v, unit in ((orbit.positions, units.length), (seen, units.acceleration))
                    )
                    learner = HarmonicGP().fit(x, y, NoiseLevel(acceleration=sigma))
                    turns = body_fixed_from_inertial(other.times, rate)
                    at = turned(turns, other.positions / units.length)
                    assert other.accelerations is not None
                    a = turned(turns, other.accelerations / units.acceleration)
                    gap = np.linalg.norm(learner.predict(at) - a, axis=1)
                    errors.append(float(np.median(gap / np.linalg.norm(a, axis=1))))
                print(
                    f"{line} sigma {found.sigma / body.spin_rate:.1e} of the rate, off by "
                    f"{off / found.sigma:+.1f} sigma; error {errors[0]:.1e} known, "
                    f"{errors[1]:.1e} estimated",
                    flush=True,
                )


if __name__ == "__main__":
    main()
