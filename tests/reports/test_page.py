"""The page: self-contained, escaped, complete and reproducible."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from unmodeled.reports import write_report

# One worker: the pages are written once and shared.
pytestmark = pytest.mark.xdist_group("report_page")
CASES = ["result", "failed", "infinite", "measured"]
_NAMES = {
    "error-summary",
    "error-against-radius",
    "acceleration-curves-1",
    "acceleration-curves-2",
    "flight-error",
    "calibration",
    "trajectories",
}


class Page(HTMLParser):
    """Collects what the tests ask about."""

    VOID = frozenset({"meta", "link", "img", "br"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.words = ""
        self._open: list[str] = []
        self.feed(text)
        assert self._open == [], f"not closed: {self._open}"

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.words += data

    def all(self, name):
        return [attrs for tag, attrs in self.tags if tag == name]


@pytest.fixture(scope="module")
def written(result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    return folder, write_report(result, folder)


@pytest.fixture(scope="module", params=CASES)
def case(request, tmp_path_factory):
    """Folder and page of every kind of result."""
    folder = tmp_path_factory.mktemp(request.param)
    path = write_report(request.getfixturevalue(request.param), folder)
    return request.param, folder, Page(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def page(written):
    return Page(written[1].read_text(encoding="utf-8"))


def test_it_asks_for_nothing(page):
    assert page.all("script") == []
    for tag, attrs in page.tags:
        for name in ("src", "href", "srcset", "action", "data"):
            target = attrs.get(name, "")
            assert re.match(r"(data:|#|figures/)|$", target), (tag, target)
    assert "url(" not in page.words
    assert "@import" not in page.words


def test_every_figure_is_in_the_page_and_beside_it(written, page):
    folder, _ = written
    assert {p.stem for p in (folder / "figures").iterdir()} == _NAMES
    for name in _NAMES:
        assert (folder / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert (folder / "figures" / f"{name}.svg").read_text().rstrip().endswith("</svg>")
        assert (folder / "figures" / f"{name}.png").stat().st_size > 10_000
    assert len(page.all("img")) == len(_NAMES)
    for attrs in page.all("a"):
        target = attrs["href"]
        assert target.startswith("#") or (folder / target).exists()


def test_it_is_small(written):
    assert written[1].stat().st_size < 4_000_000


def test_links_within_the_page_lead_somewhere(page):
    ids = [attrs["id"] for _, attrs in page.tags if "id" in attrs]
    assert len(ids) == len(set(ids))
    for attrs in page.all("a"):
        if attrs["href"].startswith("#"):
            assert attrs["href"][1:] in ids


def test_it_is_accessible(page):
    assert page.all("html")[0]["lang"] == "en"
    assert len(page.all("h1")) == 1
    assert all(len(attrs["alt"]) > 20 for attrs in page.all("img"))
    assert all(attrs.get("scope") in ("col", "row", "colgroup") for attrs in page.all("th"))
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1
    assert all(b - a <= 1 for a, b in itertools.pairwise(levels))
    assert len(page.all("caption")) == len(page.all("table"))


def test_labels_are_escaped(written, page, result):
    nasty = result.learners[3].label
    assert nasty in page.words
    assert page.all("b") == []
    assert "<b>" not in written[1].read_text(encoding="utf-8")


def test_results_come_first(page):
    heads = ["What was found", "Head to head", "The data", "Configuration", "Provenance"]
    body = page.words[page.words.index("How far can each") :]
    places = [body.index(f"\n{h}\n") for h in heads if f"\n{h}\n" in body]
    assert places == sorted(places)
    assert body.index("What was found") < body.index("Fractional acceleration errors")


def test_provenance_and_configuration(page, result):
    assert result.config.hash in page.words
    assert result.provenance.host in page.words
    assert "semi_major_axis: 2.0" in page.words


def test_no_placeholder_is_left(case):
    for rubbish in (r"\{\{", r"\{%", r"\bnan\b", r"\bNone\b", r"\binf\b", r"\w\(\w+="):
        assert not re.search(rubbish, case[2].words), rubbish


def test_every_case_is_told(case):
    name, folder, page = case
    calibrated = "Can the predicted uncertainty be believed?" in page.words
    assert calibrated == (name != "failed") == (folder / "figures" / "calibration.svg").exists()
    failed = "the fit failed (Cholesky <broke> down & out)" in page.words
    assert failed == (name == "failed")
    infinite = "predictions are not finite" in page.words
    assert infinite == (name == "infinite")
    measured = "on later revolutions" in page.words
    assert measured == (name == "measured") == ("The true field is unknown" in page.words)
    assert measured == ("Initial osculating elements" not in page.words)


def test_the_same_page_twice(written, result, tmp_path):
    folder, first = written
    second = write_report(result, tmp_path)
    assert first.read_bytes() == second.read_bytes()
    for file in (folder / "figures").iterdir():
        assert file.read_bytes() == (tmp_path / "figures" / file.name).read_bytes(), file.name


def test_a_body_card_that_is_gone(result, tmp_path):
    config = result.config.model_copy(update={"body": "/nowhere/body.yaml"})
    page = write_report(replace(result, config=config), tmp_path)
    assert "/nowhere/body.yaml" in page.read_text(encoding="utf-8")
