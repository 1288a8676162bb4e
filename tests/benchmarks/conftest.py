"""Benchmarks are scripts beside the package: their folder is put on the path, and taken off."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from unmodeled.models.learned import learner

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))


@pytest.fixture(autouse=True)
def _same_registry() -> Iterator[None]:
    """The oracle of the table is not one of the package's learners."""
    before = dict(learner._REGISTRY)
    yield
    learner._REGISTRY.clear()
    learner._REGISTRY.update(before)
