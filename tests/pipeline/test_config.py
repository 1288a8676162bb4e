import json
import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from unmodeled.core.errors import ConfigError, InputError
from unmodeled.core.units import NormalisedUnits
from unmodeled.models.learned import ExactGP, PointMassOnly, Residual, learner_names
from unmodeled.pipeline.config import VOLUMES, CharacterizationConfig, load_config
from unmodeled.pipeline.yaml12 import write_yaml

MASS = {"kind": "point_mass"}
MINIMAL = {"learners": [MASS]}


def resolve(**changes):
    return CharacterizationConfig.resolve(MINIMAL | changes, "a.yaml")


def text_of(kind=ConfigError, **changes):
    with pytest.raises(kind) as caught:
        resolve(**changes)
    assert isinstance(caught.value, InputError)
    return str(caught.value)


def test_defaults():
    c = resolve()
    assert (c.name, c.seed, c.body) == ("characterization", 1, "bennu")
    assert c.data.simulated
    assert c.data.periods() == VOLUMES["low"] == (10.0, 3.0)
    assert c.data.interpolation_share == 0.05
    assert (c.noise.state, c.noise.acceleration, c.noise.draws) == (0.0, 0.0, "independent")
    assert c.learners[0].label == "point mass"


def test_periods():
    assert resolve(data={"volume": "moderate"}).data.periods() == (100.0, 10.0)
    assert resolve(data={"train_periods": 4}).data.periods() == (4.0, 3.0)
    # a file is as long as it is, unless told otherwise
    assert resolve(data={"trajectory": "a.csv"}).data.periods() == (None, None)
    c = resolve(data={"trajectory": "a.csv", "volume": "low", "extrapolation_periods": 2})
    assert c.data.periods() == (10.0, 2.0)


def test_noise_units():
    units = NormalisedUnits.of_body(4.89, 290.0)
    noise = resolve(noise={"state": 29.0, "acceleration": 1e-6, "unit": "si"}).noise.resolve(units)
    assert noise.state == pytest.approx(0.1)
    assert noise.acceleration == pytest.approx(1e-6 / units.acceleration)
    noise = resolve(noise={"state": 0.1, "draws": "consistent"}).noise.resolve(units)
    assert (noise.state, noise.acceleration, noise.draws) == (0.1, 0.0, "consistent")


def test_learners_are_built():
    c = resolve(
        learners=[
            {"kind": "exact_gp", "epochs": 7},
            {"kind": "exact_gp", "baseline": "none"},
            MASS,
            {"kind": "harmonic_least_squares", "degree": 3, "label": "SH 3"},
        ]
    )
    built = [learner.build() for learner in c.learners]
    assert [type(b) for b in built[:3]] == [Residual, ExactGP, PointMassOnly]
    assert built[0].learner.get_params()["epochs"] == 7
    assert [learner.label for learner in c.learners] == [
        "exact gp on point mass",
        "exact gp",
        "point mass",
        "SH 3",
    ]
    assert built[3].get_params()["degree"] == 3


@pytest.mark.parametrize("kind", [n for n in learner_names() if n != "residual"])
def test_every_learner_can_be_configured_by_its_name(kind):
    c = resolve(learners=[{"kind": kind}])
    learner = c.learners[0].build()
    inner = learner.learner if isinstance(learner, Residual) else learner
    assert inner.name == kind
    assert inner.get_params() == type(inner)().get_params()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"sede": 1}, 'a.yaml: unknown key "sede", did you mean "seed"?'),
        (
            {"quux": 1},
            'a.yaml: unknown key "quux", known: body, data, flight, learners, name, noise, seed, '
            "training, training_check.",
        ),
        ({"data": {"volum": "low"}}, 'a.yaml: unknown key "data.volum", did you mean "volume"?'),
        ({"noise": {"States": 1}}, 'a.yaml: unknown key "noise.States", did you mean "state"?'),
        (
            {
                "data": {
                    "orbit": {
                        "semi_major_axis": 2,
                        "eccentricity": 0,
                        "inclination": 0,
                        "nod": 1,
                    }
                }
            },
            'a.yaml: unknown key "data.orbit.nod", did you mean "node"?',
        ),
        (
            {"learners": [{"kind": "exact_gp", "epoch": 3}]},
            'a.yaml: learner exact_gp: unknown key "epoch", did you mean "epochs"?',
        ),
        (
            {"learners": [{"kind": "exact_gp", "baselin": "none"}]},
            'a.yaml: learner exact_gp: unknown key "baselin", did you mean "baseline"?',
        ),
        (
            {"data": {"orbit": {"semi_major_axis": 2, "eccentricity": 1, "inclination": 0}}},
            "a.yaml: data.orbit.eccentricity is 1: input should be less than 1.",
        ),
        (
            {"data": {"orbit": {"eccentricity": 0.1, "inclination": 0}}},
            'a.yaml: missing key "data.orbit.semi_major_axis".',
        ),
        (
            {"noise": {"state": -1}},
            "a.yaml: noise.state is -1: input should be greater than or equal to 0.",
        ),
        (
            {"noise": {"acceleration": math.nan}},
            "a.yaml: noise.acceleration is nan: input should be a finite number.",
        ),
        (
            {"noise": {"draws": "both"}},
            "a.yaml: noise.draws is 'both': input should be 'independent' or 'consistent'.",
        ),
        (
            {"data": {"ranges": {"eccentricty": [0, 0.5]}}},
            'a.yaml: unknown orbital element "eccentricty". Did you mean "eccentricity"?',
        ),
        (
            {"data": {"ranges": {"node": [0, math.inf]}}},
            "a.yaml: data.ranges.node.1 is inf: input should be a finite number.",
        ),
        (
            {"data": {"extrapolation_trajectory": "b.csv"}},
            "a.yaml: data.extrapolation_trajectory is b.csv and data.trajectory is simulated. "
            "Give the file of the training orbit as data.trajectory too.",
        ),
        (
            {"learners": []},
            "a.yaml: learners is []: tuple should have at least 1 item after validation, not 0.",
        ),
        (
            {"flight": {"periods": []}},
            "a.yaml: flight.periods is []: "
            "tuple should have at least 1 item after validation, not 0.",
        ),
        (
            {"learners": ["exact_gp"]},
            "a.yaml: a learner is given as 'exact_gp'. Allowed: a mapping, e.g. {kind: exact_gp}.",
        ),
        ({"learners": [{}]}, "a.yaml: a learner without kind. Add e.g. kind: exact_gp."),
        (
            {"learners": [{"kind": "exct_gp"}]},
            'a.yaml: unknown learner "exct_gp". Did you mean "exact_gp"?',
        ),
        (
            {"learners": [{"kind": "residual"}]},
            'a.yaml: learner "residual" is chosen by its baseline. '
            "Write the kind of what learns the residual, with baseline: point_mass.",
        ),
        (
            {"learners": [{"kind": "exact_gp", "params": 3}]},
            "a.yaml: params of a learner is 3. Allowed: a mapping, e.g. {epochs: 200}.",
        ),
        (
            {"learners": [MASS | {"baseline": "point_mass"}]},
            'a.yaml: learner "point_mass" with baseline "point_mass". '
            "Allowed: none; it contains the mass itself.",
        ),
        (
            {"learners": [{"kind": "exact_gp", "baseline": "mass"}]},
            "a.yaml: learners.0.baseline is 'mass': input should be 'point_mass' or 'none'.",
        ),
        (
            {"learners": [{"kind": "harmonic_least_squares", "ridge": math.inf}]},
            "a.yaml: learner harmonic_least_squares: ridge is inf: "
            "input should be a finite number.",
        ),
        (
            {"learners": [MASS, MASS]},
            'a.yaml: two learners are called "point mass". Give each its own label.',
        ),
        (
            {"name": "a/b"},
            "a.yaml: name is 'a/b': string should match pattern '^[A-Za-z0-9._-]+$'.",
        ),
        (
            {"seed": -1, "body": 5},
            "a.yaml: seed is -1: input should be greater than or equal to 0; "
            "body is 5: input should be a valid string.",
        ),
    ],
)
def test_refusals(changes, text):
    assert text_of(**changes) == text


def test_long_values_are_cut_in_messages():
    text = text_of(seed="x" * 500)
    assert len(text) < 200
    assert "..." in text


def test_no_learners():
    with pytest.raises(ConfigError) as caught:
        CharacterizationConfig.resolve({}, "a.yaml")
    assert str(caught.value) == 'a.yaml: missing key "learners".'


FULL = {
    "name": "full",
    "seed": 9,
    "body": "eros",
    "data": {
        "train_periods": 4,
        "orbit": {"semi_major_axis": 2, "eccentricity": 0.1, "inclination": 30},
        "ranges": {"eccentricity": [0.1, 0.2]},
        "integrator": "rk4",
    },
    "noise": {"state": 0.1, "unit": "si", "draws": "consistent"},
    "learners": [
        {"kind": "exact_gp", "epochs": 3},
        {"kind": "harmonic_least_squares", "ridge": None, "order": 2},
        {"kind": "spectral_mlp", "baseline": "none", "label": "net"},
    ],
    "flight": {"periods": [1, 2.5], "orbits": 2},
}


@pytest.mark.parametrize("content", [MINIMAL, FULL])
def test_resolved_again_it_is_the_same(content, tmp_path):
    c = CharacterizationConfig.resolve(content)
    again = CharacterizationConfig.resolve(c.as_dict())
    assert again == c
    assert again.hash == c.hash
    assert again.as_dict() == c.as_dict()
    assert json.loads(json.dumps(c.as_dict())) == c.as_dict()
    write_yaml(c.as_dict(), tmp_path / "a.yaml")
    assert load_config(tmp_path / "a.yaml") == c


def reverse(content):
    if isinstance(content, dict):
        return {k: reverse(v) for k, v in reversed(content.items())}
    return [reverse(v) for v in content] if isinstance(content, list) else content


def test_hash_is_that_of_the_meaning():
    c = CharacterizationConfig.resolve(FULL)
    assert CharacterizationConfig.resolve(reverse(FULL)).hash == c.hash
    explicit = resolve(
        seed=1,
        data={"trajectory": "simulated", "volume": None},
        noise={"state": 0},
        learners=[MASS | {"baseline": "none", "label": "point mass", "gm": 4 * math.pi**2}],
    )
    assert explicit.hash == resolve().hash
    assert resolve(noise={"state": 1}).hash == resolve(noise={"state": 1.0}).hash


def test_hash_sees_every_change():
    changes = [
        {},
        {"seed": 2},
        {"name": "b"},
        {"noise": {"state": 1e-300}},
        {"noise": {"state": 0.1}},
        {"noise": {"state": 0.1 + 1e-16}},
        {"noise": {"state": 0.1, "draws": "consistent"}},
        {"learners": [MASS | {"gm": 1.0}]},
        {"learners": [MASS, {"kind": "exact_gp"}]},
        {"learners": [{"kind": "exact_gp"}, MASS]},
        {"flight": {"periods": [1.0]}},
    ]
    hashes = [resolve(**c).hash for c in changes]
    assert len(set(hashes)) == len(hashes) - (0.1 == 0.1 + 1e-16)
    assert all(len(h) == 64 for h in hashes)


def test_changes_replace_top_level_keys(tmp_path):
    path = tmp_path / "a.yaml"
    write_yaml(MINIMAL | {"seed": 3}, path)
    assert load_config(path).seed == 3
    assert load_config(path, seed=4).seed == 4
    with pytest.raises(ConfigError) as caught:
        load_config(path, sede=4)
    assert str(caught.value) == f'{path}: unknown key "sede", did you mean "seed"?'


def test_it_cannot_be_changed():
    with pytest.raises(Exception, match="frozen"):
        resolve().seed = 4


SECTIONS = ["name", "seed", "body", "data", "noise", "learners", "flight", "kind", "params"]
OTHERS = ["baseline", "label", "orbit", "ranges", "periods", "eccentricity", "state", "epochs"]
KEYS = st.sampled_from([*SECTIONS, *OTHERS, "volume", "x", 3])
PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-5, 2**70)
    | st.floats()
    | st.sampled_from(["", "exact_gp", "point_mass", "none", "low", "simulated", "a.csv"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.dictionaries(KEYS, PLAIN, max_size=4), PLAIN)
def test_anything_is_resolved_or_refused_with_a_sentence(content, learner):
    """Never a traceback from below, and what is accepted survives a round trip."""
    for given_ in (content, MINIMAL | content, content | {"learners": [learner, MASS]}):
        try:
            c = CharacterizationConfig.resolve(given_)
        except InputError:
            continue
        assert CharacterizationConfig.resolve(c.as_dict()).hash == c.hash
