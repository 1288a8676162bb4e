import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # for `light`, which new processes import too

from unmodeled.pipeline.sweep.sweep_config import SweepConfig

CONTENT = {
    "name": "small",
    "base": {"data": {"train_periods": 3, "extrapolation_periods": 2}},
    "axes": {
        "learner": [{"kind": "rbf_network", "centres": 10}, {"kind": "point_mass"}],
        "noise.state": [0, 0.1],
    },
    "initial_conditions": {"count": 3},
}


@pytest.fixture
def content():
    return CONTENT


@pytest.fixture
def config():
    return SweepConfig.resolve(CONTENT)
