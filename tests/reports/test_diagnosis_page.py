"""The page and the lines of a diagnosis: complete, escaped, self-contained, legible."""

from __future__ import annotations

import html
import re
import shutil
import subprocess
from dataclasses import replace

import pandas as pd
import pytest

from unmodeled.pipeline.cases.simulate_case import HiddenEffect, scenario_case
from unmodeled.pipeline.diagnosis.add_effect import add
from unmodeled.pipeline.diagnosis.diagnose import diagnose
from unmodeled.pipeline.diagnosis.result import Alternative, Dismissed, Forecast, Rival, Step
from unmodeled.pipeline.diagnosis.schema import DiagnosisJson, as_text
from unmodeled.reports.diagnosis_page import write_addition_report, write_diagnosis_report
from unmodeled.reports.diagnosis_text import addition_lines, diagnosis_lines
from unmodeled.reports.diagnosis_words import detectable

pytestmark = pytest.mark.xdist_group("diagnosis_page")
BROWSER = next((p for p in map(shutil.which, ("chromium", "google-chrome")) if p), None)
NASTY = "push <b>&\"'</b> on $p_{m}$"


@pytest.fixture(scope="module")
def case():
    hidden = [HiddenEffect("srp", noncentrality=1000.0)]
    return replace(scenario_case("bennu", 1, hidden), candidates=_few(1, hidden))


def _few(seed, hidden):
    names = ("zonal_2", "zonal_5", "srp", "constant_radial", "constant_transverse", "time_tag")
    return tuple(c for c in scenario_case("bennu", seed, hidden).candidates if c.name in names)


@pytest.fixture(scope="module")
def found(case):
    return diagnose(case)


@pytest.fixture(scope="module")
def ambiguous(found):
    """With a rival of a nasty name, further data and three steps that fall far."""
    rival = Rival("push", NASTY, 0.99994, 1.7, 0.61)
    finding = replace(found.findings[0], rivals=(rival,), confidence=0.61, consistency_p=0.4)
    steps = (Step("", 131.0, 40.0), Step("push", 12.0, 4.0), Step("srp for push", 1.0, 1.1))
    further = pd.DataFrame(
        [
            {
                "finding": "srp",
                "rival": "push",
                "data": "i + 30 deg",
                "correlation": 0.4,
                "probability": 0.99,
            }
        ]
    )
    return replace(
        found,
        verdict="ambiguous",
        findings=(finding,),
        alternatives=(Alternative(("drag", "push"), ("drag", NASTY), 2.5, 17000.0),),
        dismissed=(Dismissed("manoeuvre", "impulsive manoeuvre", 230.0, 2.1),),
        forecast=Forecast(39.0, 1.05, -4.0),
        steps=steps,
        further=further,
    )


@pytest.fixture(scope="module")
def nothing(found):
    return replace(
        found,
        verdict="nothing missing",
        findings=(),
        steps=found.steps[:1],
        final_fit=found.fit,
        final_case=found.case,
    )


@pytest.fixture(params=["found", "ambiguous", "nothing"])
def diagnosis(request):
    return request.getfixturevalue(request.param)


def test_the_page_has_its_parts_and_asks_for_nothing(diagnosis, tmp_path):
    text = write_diagnosis_report(diagnosis, tmp_path).read_text(encoding="utf-8")
    assert diagnosis.sentence in html.unescape(text)
    for name in ("waterfall", "residuals", "candidate-scores"):
        assert f'id="{name}"' in text
        assert (tmp_path / "figures" / f"{name}.png").stat().st_size > 10_000
        assert (tmp_path / "figures" / f"{name}.svg").exists()
    assert "<script" not in text
    assert "http" not in text.replace("http-equiv", "")
    assert "<b>&" not in text
    assert not re.search(r"\b(nan|None)\b", re.sub(r"base64,[^\"]*", "", text))
    assert "SHA-256" in text
    heads = re.findall(r"<h2 id=\"([a-z-]+)\"", text)
    assert ("further" in heads) == bool(len(diagnosis.further))
    assert ("findings" in heads) == bool(diagnosis.findings)
    assert "detectable" in heads
    assert ("Other sets that fit as well" in text) == bool(diagnosis.alternatives)
    assert ("Not believed" in text) == bool(diagnosis.dismissed)


def test_same_result_same_page(found, tmp_path):
    pages = [write_diagnosis_report(found, tmp_path / n) for n in "ab"]
    bodies = [p.read_text(encoding="utf-8").partition("<footer>")[0] for p in pages]
    assert bodies[0] == bodies[1]


def test_the_answer_validates_against_the_schema(diagnosis):
    content = diagnosis.as_json()
    assert DiagnosisJson.model_validate(content).verdict == diagnosis.verdict
    assert '"class"' in as_text("diagnose", content) or not diagnosis.findings


def test_lines_of_what_was_found(found):
    text = "\n".join(diagnosis_lines(found))
    assert text.startswith("Missing: solar radiation pressure")
    (finding,) = found.findings
    assert re.search(r"srp +srp_CrA_m = \(\S+ ± \S+\)e-\d m2 kg-1", text)
    assert re.search(r"model as given +█+ +1\.\d+", text)
    assert re.search(r"\n\+ srp +█+ +(0\.9|1\.0)\d+", text)  # names, not titles: the bars stay near
    assert "smallest detectable" not in text
    assert finding.drop > finding.threshold


def test_lines_of_an_ambiguous_answer(ambiguous):
    lines = diagnosis_lines(ambiguous)
    assert "these data cannot tell it from" in lines[0]
    assert "In place of all of this would fit as well: drag + push" in lines[0]
    text = "\n".join(lines)
    assert re.search(r"drag \+ push +2\.5", text)
    assert re.search(r"manoeuvre +230 +2\.1 sigma", text)
    bars = [line.count("█") for line in lines if "█" in line]
    assert len(bars) == 3
    assert bars[0] > bars[1] > bars[2] > 0  # logarithmic: the last is still seen


def test_lines_when_nothing_is_missing(nothing):
    lines = diagnosis_lines(nothing)
    assert lines[0] == "Nothing is missing at this noise."
    assert any(line.startswith("These data would have shown") for line in lines)
    table = detectable(nothing)
    assert list(table["share"]) == sorted(table["share"])
    assert {"srp", "zonal_5"} <= set(table["name"])


def test_the_page_and_lines_of_an_added_effect(case, tmp_path):
    addition = add(case, "srp")
    text = write_addition_report(addition, tmp_path).read_text(encoding="utf-8")
    assert "solar radiation pressure" in text
    assert "noise as stated" in text
    assert (tmp_path / "figures" / "waterfall.png").exists()
    lines = addition_lines(addition)
    assert lines[0] == "solar radiation pressure added"
    assert any(re.match(r"positions +m +0\.\d+ +0\.\d+", line) for line in lines)


@pytest.mark.skipif(BROWSER is None, reason="no chromium or google-chrome on the PATH")
def test_the_page_renders_without_complaint(ambiguous, tmp_path):
    page = write_diagnosis_report(ambiguous, tmp_path)
    picture = tmp_path / "page.png"
    command = [
        str(BROWSER),
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--host-resolver-rules=MAP * ~NOTFOUND",
        "--enable-logging=stderr",
        f"--user-data-dir={tmp_path / 'profile'}",
        "--window-size=1100,4000",
        f"--screenshot={picture}",
        page.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert "CONSOLE" not in done.stderr, done.stderr
    assert picture.stat().st_size > 100_000
