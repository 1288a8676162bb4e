"""Candidates whose columns are given: pools without an orbit."""

from dataclasses import dataclass

import numpy as np

from unmodeled.models.physics import ConstantInertial
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.diagnosis.pool import Pool

N = 600


@dataclass
class Lin:
    """Stands in for a `Linearisation`: columns are given, nothing is projected out."""

    table: dict
    residuals: np.ndarray
    freedom: int = N
    measured: int = N

    def columns(self, effect, values, names):
        return self.table[effect.label]

    def project(self, columns):
        return columns


@dataclass(frozen=True)
class Named(ConstantInertial):
    label: str = ""

    @property
    def terms(self):
        return frozenset({self.label})


def candidate(name, size=1, prior=1.0):
    names = tuple(f"inertial_a_{k}" for k in "xyz"[:size])
    return Candidate(
        name, name, Named(name), names, dict.fromkeys(names, 0.0), (prior,) * size, "test"
    )


def pool_of(table, residuals, prior=1.0):
    found = [candidate(n, c.shape[1], prior) for n, c in table.items()]
    return Pool(Lin(table, residuals), found)
