import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline import batch_characterize
from unmodeled.pipeline.batch_characterize import (
    characterize_batch,
    characterize_stacks,
    metrics_row,
)
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig

LEARNERS = {
    "gp": {"kind": "exact_gp", "baseline": "none", "optimizer": "newton"},
    "network": {"kind": "spectral_mlp", "layers": 2, "width": 16, "epochs": 40},
    "rbf": {"kind": "rbf_network", "centres": 20},
}


def configuration(seed, learner, **data):
    return CharacterizationConfig.resolve(
        {
            "seed": seed,
            "data": {"train_periods": 3, "extrapolation_periods": 1, "rk4_steps_per_period": 25}
            | data,
            "noise": {"acceleration": 0.1},
            "learners": [learner],
            "flight": {"periods": [0.2], "orbits": 1},
        }
    )


@pytest.mark.parametrize("key", LEARNERS)
def test_rows_are_those_of_the_runs_alone(key):
    configs = [configuration(seed, LEARNERS[key]) for seed in (1, 4, 10)]
    batch = list(characterize_batch(configs, flights=True))
    alone = [characterize(config).learners[0] for config in configs]
    for ours, theirs in zip(batch, alone, strict=True):
        assert metrics_row(ours) == metrics_row(theirs)
        assert not ours.failure
        for a, b in zip(ours.flights, theirs.flights, strict=True):
            assert np.array_equal(a.flight.position_error, b.flight.position_error)
    again = list(characterize_batch(configs[::-1][:2]))
    assert [metrics_row(r) for r in again] == [metrics_row(r) for r in batch[::-1][:2]]
    assert again[0].flights == ()


def test_no_more_data_are_held_than_are_trained_side_by_side(monkeypatch):
    configs = [configuration(seed, LEARNERS["network"]) for seed in (1, 4, 10)]
    whole = [metrics_row(r) for r in characterize_batch(configs)]
    pieces = []
    fit = batch_characterize.fit_batch
    monkeypatch.setattr(
        batch_characterize,
        "fit_batch",
        lambda ls, *a, **k: pieces.append(len(ls)) or fit(ls, *a, **k),
    )
    assert [metrics_row(r) for r in characterize_batch(configs)] == whole
    monkeypatch.setattr(batch_characterize, "stack_members", lambda *_: 2)
    stacks = characterize_stacks(configs)
    assert [metrics_row(r) for r in next(stacks)] == whole[:2]
    assert pieces == [3, 2]  # the third one's data are not made yet
    assert [metrics_row(r) for r in next(stacks)] == whole[2:]
    gps = [configuration(seed, LEARNERS["gp"]) for seed in (1, 4)]
    monkeypatch.undo()
    assert [len(stack) for stack in characterize_stacks(gps)] == [1, 1]


def test_a_run_that_hits_the_body_is_a_row_with_its_reason():
    low = {"semi_major_axis": 1.1, "eccentricity": 0.5, "inclination": 30.0}
    configs = [
        configuration(1, LEARNERS["rbf"], orbit=low),
        configuration(1, LEARNERS["rbf"]),
    ]
    first, second = characterize_batch(configs)
    assert "hits the body" in first.failure
    assert metrics_row(first)["failure"] == first.failure
    assert not second.failure


def test_one_learner_each():
    config = CharacterizationConfig.resolve({"learners": list(LEARNERS.values())})
    with pytest.raises(ConfigError, match=r"a configuration of 3 learners\. Allowed: one learner"):
        next(characterize_batch([config]))
