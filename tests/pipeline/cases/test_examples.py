"""The shipped cases are valid, and the documentation names every key."""

import os
from pathlib import Path

import pytest

from unmodeled.datasets.bodies import load_body
from unmodeled.pipeline.cases.accepted_values import Surveyed
from unmodeled.pipeline.cases.case_config import (
    ArcConfig,
    ArcsConfig,
    CaseConfig,
    MeasurementConfig,
    SpacecraftConfig,
    StationConfig,
)
from unmodeled.pipeline.cases.known_effects import ALIASES, read_known
from unmodeled.pipeline.cases.load_case import Ground, load_case
from unmodeled.pipeline.cases.scenario_orbits import SCENARIOS
from unmodeled.pipeline.yaml12 import parse_scalar, read_yaml

ROOT = Path(__file__).parents[3]
EXAMPLES = sorted((ROOT / "cases").rglob("*.yaml"))
DATA = Path(os.environ.get("UNMODELED_DATA", ROOT.parent / "shared" / "real"))
PAGE = (ROOT / "docs" / "cases.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", [p for p in EXAMPLES if p.name != "truth.yaml"], ids=str)
def test_every_example_is_a_valid_case(path):
    config = CaseConfig.resolve(read_yaml(path), str(path))
    assert Ground.of(config, path.parent).known.effects


def test_the_simulated_example_runs_from_a_fresh_clone():
    case = load_case(ROOT / "cases" / "bennu-orbiter" / "case.yaml")
    assert [len(a.measurements[0].times) for a in (*case.arcs, *case.held_out)] == [432, 144]
    assert "solar_radiation_pressure" not in {e.name for e in case.dynamics.effects}


def test_the_page_names_every_key_and_scenario():
    for section in (
        CaseConfig,
        MeasurementConfig,
        ArcConfig,
        SpacecraftConfig,
        StationConfig,
    ):
        for key in section.model_fields:
            assert f"`{key}`" in PAGE or f"{key}:" in PAGE, (section.__name__, key)
    for key in set(ArcsConfig.model_fields) - {"each"}:
        assert f"{key}:" in PAGE
    for name in (*SCENARIOS, *ALIASES.values()):
        assert f"`{name}`" in PAGE, name


def test_the_example_of_the_page_is_valid(tmp_path):
    corners = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1"]
    sides = ["f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"]
    (tmp_path / "shape.obj").write_text("\n".join(corners + sides))
    text = PAGE.split("```yaml\n")[1].split("```")[0]
    config = CaseConfig.resolve(parse_scalar(text))
    body = Ground.of(config, Path()).body
    rows = [line.split("`")[1] for line in PAGE.splitlines() if line.startswith("| `{effect:")]
    assert len(rows) >= 8
    for row in rows:
        if "field.gfc" not in row:
            on = "earth" if "drag" in row or "spherical" in row else body.name
            entry = parse_scalar(row)
            extra = {"values": {"srp_CrA_m": "0.01 m2/kg"}} if "srp" in row else {}
            extra |= {"drag_B": "0.02 m2/kg"} if "drag" in row else {}
            read_known([{**entry, **extra}], Surveyed(load_body(on)), tmp_path)


@pytest.mark.slow
@pytest.mark.real
@pytest.mark.skipif(not DATA.exists(), reason=f"no real measurements at {DATA}")
def test_lageos2_fits_to_centimetres():
    """Six one-day arcs with the whole model: laser-ranging orbits are good to a few centimetres."""
    fit = load_case(ROOT / "cases" / "lageos2.yaml", [DATA]).fit()
    rms = fit.rms()["rms"].item()
    print(f"LAGEOS-2: {100 * rms:.1f} cm, Cr A/m {fit.values['srp_CrA_m']:.2e} m2/kg")
    assert rms < 0.05
    # Cr 1.13 times 6.97e-4 m2/kg is accepted; other analyses find 3 % less on this week.
    assert fit.values["srp_CrA_m"] == pytest.approx(7.85e-4, rel=0.05)
