"""Held-out errors against refits without the part, and the character of hidden effects."""

from __future__ import annotations

import numpy as np
import pytest

from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate
from unmodeled.pipeline.comparison.force_kind import explain
from unmodeled.pipeline.comparison.left_out import left_out_errors
from unmodeled.pipeline.linearisation import Linearisation


def test_left_out_errors_are_those_of_refits():
    rng = np.random.default_rng(0)
    known, _ = np.linalg.qr(rng.normal(size=(50, 4)))
    columns, r = rng.normal(size=(50, 3)), rng.normal(size=50)
    parts = [np.arange(0, 20), np.arange(20, 35), np.arange(35, 50)]
    error = 0.0
    for part in parts:
        rest = np.setdiff1d(np.arange(50), part)
        A = np.concatenate([known, columns], axis=1)
        # Ridge on the columns, nothing on the known ones.
        normal = A[rest].T @ A[rest] + np.diag([0.0] * 4 + [1.0] * 3)
        x = np.linalg.solve(normal, A[rest].T @ r[rest])
        error += np.sum((r[part] - A[part] @ x) ** 2)
    left = columns - known @ (known.T @ columns)
    root = np.linalg.cholesky(np.linalg.inv(left.T @ left + np.eye(3)))
    residual = r - known @ (known.T @ r)
    errors = left_out_errors(known, left @ root, residual, parts)
    assert errors.sum() == pytest.approx(error)


def test_a_manoeuvre_is_impulsive():
    case = simulate("bennu", 1, [HiddenEffect("manoeuvre", noncentrality=2000.0)]).case
    found = explain(Linearisation(case, case.fit()))
    assert found.kind == "impulsive"
    assert found.table["skill"].iloc[0] == pytest.approx(found.possible_skill, abs=0.03)
    assert found.curl_free is None
