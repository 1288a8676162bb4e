"""A training orbit and one other about Bennu, low volume, seen with several levels of noise."""

from __future__ import annotations

from collections.abc import Iterable

from unmodeled.datasets.learning_data import LearningData
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.prepare import Simulated, prepare, simulate

__all__ = ["bennu_pair"]


def bennu_pair(seed: int, levels: Iterable[tuple[float, float]]) -> list[LearningData]:
    """Return the learning data at each level (sigma_s, sigma_a); the orbits are simulated once."""
    kept: list[Simulated] = []

    def once(config: CharacterizationConfig, body: object = None) -> Simulated:
        if not kept:
            kept.append(simulate(config, compare_integrators=False))
        return kept[0]

    found = []
    for state, acceleration in levels:
        config = CharacterizationConfig.resolve(
            {
                "name": "pair",
                "seed": seed,
                "body": "bennu",
                "data": {"volume": "low", "extrapolation_orbits": 1},
                "noise": {"state": state, "acceleration": acceleration},
                "learners": [{"kind": "point_mass"}],
            }
        )
        found.append(prepare(config, simulated=once))
    return found
