"""How often the 95 % band of an ensemble of plain networks holds the truth.

    python benchmarks/ensemble_coverage.py --first 101 --seeds 20

For each noise: median fractional error and share of acceleration components inside 1.96 standard
deviations, between the samples and on the other orbit, of `MLP` with 5 members on a point mass.
"""

from __future__ import annotations

import argparse

import numpy as np

from unmodeled.core.threads import one_thread
from unmodeled.models.learned import MLP, NoiseLevel, Residual
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.prepare import prepare

NOISES = ((0.0, 0.0), (0.0, 0.1), (0.05, 0.0))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=101)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--epochs", type=int, default=2000)
    given = parser.parse_args()
    for state, acceleration in NOISES:
        errors, inside = [], []
        for k in range(given.seeds):
            content = {
                "seed": given.first + k,
                "noise": {"state": state, "acceleration": acceleration},
                "learners": [{"kind": "point_mass"}],
            }
            data = prepare(CharacterizationConfig.resolve(content))
            model = Residual(MLP(members=5, epochs=given.epochs)).fit(
                data.train.observed_positions,
                data.train.observed_accelerations,
                NoiseLevel(state, acceleration),
            )
            pair = []
            for s in (data.interpolation, data.extrapolation):
                found = model.predict(s.positions)
                covariance = model.predict_covariance(s.positions)
                sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
                pair.append(float(np.mean(np.abs(found - s.accelerations) < 1.96 * sigma)))
                errors.append(float(np.median(fractional_error(s.accelerations, found))))
            inside.append(pair)
        between, other = np.median(np.reshape(errors, (-1, 2)), axis=0)
        held = np.mean(inside, axis=0)
        print(
            f"sigma_s {state:g} sigma_a {acceleration:g}: error {between:.2e} / {other:.2e}, "
            f"inside {held[0]:.3f} / {held[1]:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    with one_thread():
        main()
