"""Real measurements, one known force kept from the model: `diagnose` must name it.

Nothing here is simulated: the orbit of LAGEOS-2 is as laser ranging found it, and the accepted
values are those of other people's measurements.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from unmodeled.pipeline.cases.load_case import case_from_mapping
from unmodeled.pipeline.diagnosis.diagnose import diagnose
from unmodeled.pipeline.yaml12 import read_yaml

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("UNMODELED_DATA", ROOT.parent / "shared" / "real"))

pytestmark = [
    pytest.mark.slow,
    pytest.mark.real,
    pytest.mark.skipif(
        not (DATA / "sp3-lageos2").is_dir(), reason=f"no real measurements at {DATA}"
    ),
]


def diagnosed(name, left_out=(), order=None):
    """Diagnose a case file less some lines of its known model."""
    content = read_yaml(ROOT / "cases" / name)
    known = []
    for entry in content["known"]:
        words = (entry["effect"], entry.get("body"))
        if words[0] in left_out or words[1] in left_out:
            continue
        field = order is not None and entry["effect"] == "spherical_harmonics"
        known.append(entry | {"order": order} if field else entry)
    return diagnose(case_from_mapping({**content, "known": known}, ROOT / "cases", [DATA]))


def rms(fit):
    """Distance between the orbit and the measured positions, m."""
    return float(np.sqrt(3.0 * np.mean(fit.residuals["residual"] ** 2)))


def estimate_of(diagnosis, effect):
    """Estimate of the first parameter of an effect that must be among the findings."""
    found = {f.name: f for f in diagnosis.findings}
    print(f"found {list(found)}, {rms(diagnosis.fit):.3f} -> {rms(diagnosis.final_fit):.3f} m")
    assert effect in found
    return found[effect].estimates[0].value


def test_with_all_forces_in_the_orbit_is_five_centimetres_off():
    d = diagnosed("lageos2-three-days.yaml")
    assert rms(d.fit) < 0.05
    assert not {"srp", "solid_tide", "third_body_moon"} & {f.name for f in d.findings}


@pytest.mark.parametrize(
    ("left_out", "order", "effect", "accepted", "within"),
    [
        # Who does not know the Moon does not know that it raises a tide: both are to be found.
        (("moon", "solid_tide"), None, "third_body_moon", 4.902800e12, 0.01),
        (("sun", "solid_tide"), None, "third_body_sun", 1.327124e20, 0.01),
        (("solid_tide",), None, "solid_tide", 0.30, 0.10),
        (("srp",), None, "srp", 1.13 * 6.95e-4, 0.05),
        ((), 0, "egm2008_tesserals_2_16", 1.0, 0.01),
    ],
)
def test_a_force_that_is_left_out_is_found(left_out, order, effect, accepted, within):
    d = diagnosed("lageos2-three-days.yaml", left_out, order)
    assert d.candidates["name"].iloc[0] == effect
    assert estimate_of(d, effect) == pytest.approx(accepted, rel=within, abs=0)
    assert d.steps[-1].held_out_rms < 0.5 * d.steps[0].held_out_rms


def test_two_days_cannot_tell_whether_there_is_relativity():
    d = diagnosed("lageos2-three-days.yaml", ("relativity",))
    assert "relativity" not in {name for f in d.findings for name in f.class_names}
    table = d.candidates.set_index("name")
    # Even as large as it is, these data would not have shown it.
    assert table.loc["relativity", "smallest_detectable"] > 1.0
