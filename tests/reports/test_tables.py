"""Tables: the right numbers under headers that name their units."""

from __future__ import annotations

import pytest

from unmodeled.reports import tables
from unmodeled.reports.data_table import data_table, element_table
from unmodeled.reports.numbers import number

ALL = [getattr(tables, n) for n in tables.__all__ if n.endswith("_table")]
CASES = ["result", "failed", "infinite", "measured"]


@pytest.mark.parametrize("make", [*ALL, data_table, element_table])
@pytest.mark.parametrize("case", CASES)
def test_rows_fit_their_headers(make, case, request):
    table = make(request.getfixturevalue(case))
    assert all(len(row) == len(table.columns) for row in table.rows)
    assert all(isinstance(cell, str) for row in table.rows for cell in row)
    if table.groups:
        assert sum(span for _, span in table.groups) == len(table.columns) - 1


@pytest.mark.parametrize("make", ALL)
def test_every_number_column_has_a_unit(make, result):
    table = make(result)
    for k, column in enumerate(table.columns[1:], start=1):
        assert column.endswith("]") or k in table.text_columns, column


def test_errors_are_sorted_and_right(result):
    table = tables.error_table(result)
    assert table.rows[0][0] == "harmonic least squares"
    summary = result["harmonic least squares"].summaries["extrapolation"]
    assert table.rows[0][4] == number(summary.median)
    assert table.rows[0][7] == number(summary.worst)
    reference = next(row for row in table.rows if row[0] == "point mass")
    assert reference[5] == "1.0"


def test_a_failed_learner_has_a_row(failed):
    rows = {row[0]: row for row in tables.error_table(failed).rows}
    assert rows["exact gp on point mass"][1:3] == ("failed", "–")


def test_infinite_errors_are_shown(infinite):
    table = tables.error_table(infinite)
    bad = infinite.learners[3].label
    row = next(row for row in table.rows if row[0] == bad)
    assert row[7] == "∞"
    assert f"{bad} 34" in table.note


def test_flights(result, measured):
    table = tables.flight_table(result)
    assert table.groups == (("training orbit", 2), ("orbit 1", 2))
    assert table.columns[1:3] == ("1 period [m]", "2 periods [m]")
    assert "Flying the true field" in table.note
    assert "The true field is unknown" in tables.flight_table(measured).note


def test_many_orbits_are_summarised(result, monkeypatch):
    monkeypatch.setattr(tables, "_MOST_ORBITS", 1)
    table = tables.orbit_table(result)
    assert table.columns[1] == "best orbit [–]"
    assert "2 orbits" in table.note


def test_elements_only_for_simulated_orbits(result, measured):
    assert len(element_table(result).rows) == 3
    assert element_table(measured).rows == ()
