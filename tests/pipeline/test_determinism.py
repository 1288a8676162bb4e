"""The numbers depend on the configuration only, not on the machine's threads."""

import os
import subprocess
import sys

import pytest

CODE = """
import numpy  # loads its thread pool with the number of threads that the environment asks for
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig

config = CharacterizationConfig.resolve({
    "data": {"train_periods": 6, "extrapolation_periods": 2},
    "noise": {"acceleration": 0.01},
    "learners": [
        {"kind": "exact_gp", "baseline": "none", "epochs": 30},
        {"kind": "spectral_mlp", "epochs": 60},
        {"kind": "harmonic_least_squares"},
    ],
    "flight": {"periods": [1], "orbits": 1},
})
print(characterize(config).summary().to_csv(float_format="%.17g"))
"""


@pytest.fixture(scope="module")
def one():
    return run(1)


def run(threads):
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | dict.fromkeys(names, str(threads)),
    )
    return done.stdout


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_threads_of_the_environment_change_no_digit(one, threads):
    assert one.count("\n") > 9
    assert run(threads) == one
