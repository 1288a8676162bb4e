"""The page in a real browser, offline: it renders, complains of nothing and fits the screen."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

from made_up_sweep import GP, NETWORK, made_up_store

import unmodeled as um
from unmodeled.reports import write_report
from unmodeled.reports.sweep_page import write_sweep_report

BROWSER = next(
    (p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None
)
pytestmark = [
    pytest.mark.xdist_group("report_page"),
    pytest.mark.skipif(
        BROWSER is None, reason="no chromium, chromium-browser or google-chrome on the PATH"
    ),
]
_OPTIONS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--enable-logging=stderr",
    "--hide-scrollbars",
]
# The page itself runs no script; this one is added by the test to a copy, to measure it.
_MEASURE = """<script>addEventListener("load", () => {
  const broken = [...document.images].filter(i => !i.complete || !i.naturalWidth).length;
  const root = document.documentElement;
  const wide = [...document.querySelectorAll("body *")].filter(e => !e.closest(".wide > *")
    && e.getBoundingClientRect().right > root.clientWidth + 0.5).length;
  root.dataset.measured = [innerWidth, root.clientWidth, root.scrollWidth, broken, wide].join(" ");
});</script>"""


TITLES = {
    "run": "report-test: how far can each learned model be trusted?",
    "sweep": "made-up: which learner can be trusted, where, at what cost?",
    "reproduction": "neamati-fig12: the paper's figure beside ours",
}
IMAGES = {"run": 7, "sweep": 7, "reproduction": 1}


@pytest.fixture(scope="module", params=list(TITLES))
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def report(kind, result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    if kind == "run":
        return write_report(result, folder)
    rbf = {"kind": "rbf_network", "label": "rbf <b>&\"'</b>"}
    levels = {"noise.state": [0, 0.2, 1]}
    store = made_up_store(folder / "store", learners=(GP, NETWORK, rbf), fail=1, **levels)
    if kind == "sweep":
        return write_sweep_report(store)
    um.reproduce("neamati-fig12", store=store, out=folder)
    return folder / "report.html"


def browse(page, folder, *options):
    command = [BROWSER, *_OPTIONS, f"--user-data-dir={folder / 'profile'}", *options]
    return subprocess.run(
        [*command, page.as_uri()], capture_output=True, text=True, timeout=120, check=True
    )


def frame(report, folder, width):
    """Put a measuring copy in a frame of exactly this width: windows have a least width."""
    text = report.read_text(encoding="utf-8")
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", text)
    copy = folder / "copy.html"
    copy.write_text(text.replace("</head>", f"{_MEASURE}</head>"), encoding="utf-8")
    outer = folder / "frame.html"
    outer.write_text(
        f'<!DOCTYPE html><title>wait</title><iframe src="copy.html" width="{width}" height="800" '
        'style="border:0"></iframe><script>addEventListener("load", () => {'
        'const r = document.querySelector("iframe").contentDocument.documentElement;'
        "document.documentElement.dataset.measured = r.dataset.measured;});</script>",
        encoding="utf-8",
    )
    return outer


def test_it_renders_without_complaint(report, tmp_path):
    picture = tmp_path / "page.png"
    done = browse(report, tmp_path, "--window-size=1280,4000", f"--screenshot={picture}")
    assert "CONSOLE" not in done.stderr, done.stderr
    assert picture.stat().st_size > 100_000


def test_the_document_is_as_written(report, kind, tmp_path):
    dom = browse(report, tmp_path, "--dump-dom").stdout
    assert f"<title>{TITLES[kind]}</title>" in dom
    assert dom.count("<img ") == report.read_text(encoding="utf-8").count("<img ") == IMAGES[kind]
    if kind != "reproduction":
        assert "&lt;b&gt;&amp;" in dom


@pytest.mark.parametrize("width", [1280, 390])
def test_it_fits_the_screen(report, tmp_path, width):
    outer = frame(report, tmp_path, width)
    done = browse(
        outer, tmp_path, "--window-size=1400,900", "--allow-file-access-from-files", "--dump-dom"
    )
    measured = re.search(r'data-measured="([\d ]+)"', done.stdout)
    assert measured, done.stdout[:500]
    inner, client, scroll, broken, wide = map(int, measured[1].split())
    assert inner == width
    assert scroll <= client, "the page scrolls sideways"
    assert broken == 0, "images that did not load"
    assert wide == 0, "elements that stick out"
