"""A small real characterisation, and ways to bend it into the cases that reports must bear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import summarize
from unmodeled.pipeline.results import LearnerResult

NASTY = "rbf <b>&\"'</b> on $p_{m}$"

CONFIG = {
    "name": "report-test",
    "data": {
        "orbit": {"semi_major_axis": 2.0, "eccentricity": 0.2, "inclination": 50.0},
        "train_periods": 3,
        "extrapolation_periods": 2,
        "extrapolation_orbits": 2,
    },
    "learners": [
        {"kind": "exact_gp", "epochs": 3},
        {"kind": "nearest_neighbour", "baseline": "none"},
        {"kind": "nearest_neighbour", "baseline": "point_mass"},
        {"kind": "rbf_network", "centres": 12, "label": NASTY},
        {"kind": "harmonic_least_squares", "degree": 3},
        {"kind": "point_mass"},
    ],
    "flight": {"periods": [1, 2], "orbits": 1},
}


@pytest.fixture(scope="session")
def result():
    return characterize(CharacterizationConfig.resolve(CONFIG))


@pytest.fixture(scope="session")
def failed(result):
    """One learner's fit has failed."""
    first = result.learners[0]
    broken = LearnerResult(
        first.label, first.kind, first.baseline, failure="Cholesky <broke> down & out."
    )
    return replace(result, learners=(broken, *result.learners[1:]))


@pytest.fixture(scope="session")
def infinite(result):
    """One learner's predictions are not finite on a third of the extrapolation set."""
    bad = result.learners[3]
    errors = dict(bad.errors)
    errors["extrapolation"] = errors["extrapolation"].copy()
    errors["extrapolation"][::3] = np.inf
    summaries = {name: summarize(e) for name, e in errors.items()}
    worse = replace(bad, errors=errors, summaries=summaries)
    return replace(result, learners=(*result.learners[:3], worse, *result.learners[4:]))


@pytest.fixture(scope="session")
def measured(result):
    """As if read from a file: later revolutions, no true field."""
    content = result.config.as_dict()
    content["data"]["trajectory"] = "orbit.csv"
    data = result.data
    first = data.extrapolation.orbit == 1
    samples = replace(
        data.extrapolation,
        **{
            name: getattr(data.extrapolation, name)[first]
            for name in (
                "orbit",
                "times",
                "positions",
                "accelerations",
                "observed_positions",
                "observed_accelerations",
            )
        },
    )
    learners = []
    for r in result.learners:
        errors = r.errors | {"extrapolation": r.errors["extrapolation"][first]}
        predictions = r.predictions | {"extrapolation": r.predictions["extrapolation"][first]}
        learners.append(
            replace(
                r,
                errors=errors,
                predictions=predictions,
                summaries={name: summarize(e) for name, e in errors.items()},
            )
        )
    return replace(
        result,
        config=CharacterizationConfig.resolve(content),
        learners=tuple(learners),
        data=replace(
            data,
            extrapolation=samples,
            orbits=data.orbits[:2],
            periods=data.periods[:2],
            facts={"file": "orbit.csv", "extrapolation": "later revolutions of the same orbit"},
        ),
        flight_floor=float("nan"),
    )
