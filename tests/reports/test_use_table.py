"""The two comparisons with the bare point mass, as a table and in words."""

from dataclasses import replace

from unmodeled.pipeline.training_check import TrainingCheck
from unmodeled.pipeline.use_check import UseCheck
from unmodeled.reports import write_report
from unmodeled.reports.use_table import training_check_sentence, use_table


def bent(result):
    """All learners pass but the first, which fails both checks by stated numbers."""
    good = UseCheck(0.001, 0.002), TrainingCheck(0.001, 0.002, "each of 3 orbits", 90)
    bad = UseCheck(0.5, 0.002), TrainingCheck(0.03, 0.004, "each of 3 orbits", 90)
    learners = [
        replace(r, use=use, training_check=check)
        for r, (use, check) in zip(result.learners, [bad, *[good] * 10], strict=False)
    ]
    return replace(result, learners=tuple(learners))


def test_table_and_sentence(result):
    told = bent(result)
    label = told.learners[0].label
    rows = [row[1:] for row in use_table(told).rows if row[0] == label]
    assert rows == [
        ("other orbits", "0.50", "0.0020", "250", "do not use"),
        ("each of 3 orbits", "0.030", "0.0040", "7.5", "do not use"),
    ]
    assert sum("do not use" in row for row in use_table(told).rows) == 2
    text = training_check_sentence(told)
    assert text.endswith(f"bare point mass: {label} (0.030 against 0.0040); do not use.")


def test_nothing_is_said_where_all_pass(result):
    learners = tuple(replace(r, training_check=None) for r in result.learners)
    assert training_check_sentence(replace(result, learners=learners)) == ""


def test_the_page_says_it(result, tmp_path):
    page = write_report(bent(result), tmp_path).read_text()
    assert "do not use</td>" in page
    assert "Known at training already" in page
