"""Comparisons of simulated Bennu orbits, each made once."""

from __future__ import annotations

import pytest

from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate
from unmodeled.pipeline.comparison.compare import compare
from unmodeled.pipeline.linearisation import Linearisation


def linear(simulated):
    return Linearisation(simulated.case, simulated.case.fit())


@pytest.fixture(scope="session")
def noise_lin():
    """Nothing is missing."""
    return linear(simulate("bennu", 3))


@pytest.fixture(scope="session")
def noise():
    return compare(simulate("bennu", 3).case)


@pytest.fixture(scope="session")
def radiation():
    """Radiation pressure is missing."""
    return compare(simulate("bennu", 3, [HiddenEffect("srp", noncentrality=3000.0)]).case)


@pytest.fixture(scope="session")
def gravity():
    """C22 and S22 are missing."""
    return compare(simulate("bennu", 3, [HiddenEffect("tesseral_2_2", noncentrality=1000.0)]).case)
