"""How the degree of the harmonic GP is best chosen: rules side by side over pairs of orbits.

Fixed degrees; the best evidence; the highest degree whose evidence is within 10 of the best (the
rule of the package); `degree: auto`; five-fold cross-validation over blocks of the orbit. The
data of `harmonic_pairs.py` about Bennu, whose truth ends at degree 5, and the same orbits about a
body whose field does not end: 50 random masses within 0.8 of the radius, fitted about its centre.

    python benchmarks/harmonic_degrees.py --first 1 --last 10
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
import pandas as pd

from unmodeled.core.threads import one_thread
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import HarmonicGP, NoiseLevel, _harmonic_evidence
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import calibrate, fractional_error
from unmodeled.pipeline.prepare import prepare

NOISE = 0.1
DEGREES = (2, 4, 6, 8, 12)


def main() -> None:
    """Print a row a body, level of noise and rule."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--last", type=int, default=10)
    arguments = parser.parse_args()
    rows = []
    with one_thread():
        for seed in range(arguments.first, arguments.last + 1):
            rows += pair(seed)
    table = pd.DataFrame(rows)
    own = table.groupby(["body", "noise", "rule"], sort=False)
    print(f"{arguments.last - arguments.first + 1} pairs")
    for (body, noise, rule), part in own:
        print(
            f"{body:8} sigma_a {noise:g} {rule:16} error {part['error'].median():.2e}, "
            f"95 % band holds {part['inside'].mean():.1%}, degree {part['degree'].median():g}"
        )


def pair(seed: int) -> list[dict[str, object]]:
    """Return one row a body, level and rule."""
    config = CharacterizationConfig.resolve(
        {
            "name": "degrees",
            "seed": seed,
            "body": "bennu",
            "data": {"volume": "low", "extrapolation_orbits": 1},
            "learners": [{"kind": "harmonic_gp"}],
        }
    )
    data = prepare(config)
    x, other = data.train.observed_positions, data.extrapolation.positions
    rng = np.random.default_rng(seed)
    places = rng.normal(size=(50, 3))
    places *= (0.8 * rng.uniform(size=50) ** (1 / 3) / np.linalg.norm(places, axis=1))[:, None]
    shares = rng.uniform(0.5, 1.5, 50)
    shares /= shares.sum()
    places -= shares @ places

    def masses(x: np.ndarray) -> np.ndarray:
        d = x[:, None] - places
        return -NORMALISED_GM * (shares[:, None] * d / (d**2).sum(axis=2)[..., None] ** 1.5).sum(1)

    rows = []
    bennu = data.train.observed_accelerations, data.extrapolation.accelerations
    for body, (y, truth) in {"bennu": bennu, "masses": (masses(x), masses(other))}.items():
        for noise in (0.0, NOISE):
            noisy = y + noise * rng.normal(size=y.shape)
            for rule, make in rules(x, noisy, NoiseLevel(acceleration=noise)).items():
                learner = make()
                predicted = learner.predict(other)
                band = calibrate(truth, predicted, learner.predict_covariance(other))
                rows.append(
                    {
                        "body": body,
                        "noise": noise,
                        "rule": rule,
                        "error": float(np.median(fractional_error(truth, predicted))),
                        "inside": band.coverage_95,
                        "degree": learner.degree_,
                    }
                )
    return rows


def rules(x: np.ndarray, y: np.ndarray, noise: NoiseLevel) -> dict[str, Callable[[], HarmonicGP]]:
    """Return a fit by each rule."""

    def best() -> HarmonicGP:
        kept, _harmonic_evidence._DEGREE_MARGIN = _harmonic_evidence._DEGREE_MARGIN, 0.0
        try:
            return HarmonicGP(degree=12).fit(x, y, noise)
        finally:
            _harmonic_evidence._DEGREE_MARGIN = kept

    def crossed() -> HarmonicGP:
        fold = np.arange(len(x)) * 5 // len(x)
        misses = [
            sum(
                float(((HarmonicGP(d, d).fit(x[f], y[f], noise).predict(x[~f]) - y[~f]) ** 2).sum())
                for f in (fold != k for k in range(5))
            )
            for d in DEGREES
        ]
        degree = DEGREES[int(np.argmin(misses))]
        return HarmonicGP(degree, degree).fit(x, y, noise)

    def fixed(d: int) -> Callable[[], HarmonicGP]:
        return lambda: HarmonicGP(d, d).fit(x, y, noise)

    return {f"fixed {d}": fixed(d) for d in DEGREES} | {
        "best evidence": best,
        "within 10, to 8": lambda: HarmonicGP().fit(x, y, noise),
        "within 10, to 12": lambda: HarmonicGP(degree=12).fit(x, y, noise),
        "auto": lambda: HarmonicGP(degree="auto").fit(x, y, noise),
        "cross-validation": crossed,
    }


if __name__ == "__main__":
    main()
