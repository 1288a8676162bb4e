"""All effects of the catalogue together: names do not clash, the sum is the sum."""

from itertools import combinations

import numpy as np
from tests.contracts.effect_cases import EFFECT_CASES, MOVING

from unmodeled.models.physics import Dynamics

#: One case of each class, such that no term comes twice.
KEYS = (
    "albedo",
    "point mass",
    "zonal 2",
    "constant inertial",
    "constant RTN",
    "drag",
    "Lense-Thirring",
    "linear radial",
    "manoeuvre",
    "mascon",
    "non-gravitational",
    "once per revolution",
    "power law",
    "published tesserals 3-6, order 2",
    "Schwarzschild",
    "solid tide",
    "Sun-line push",
    "sunlight with shadow",
    "third body",
    "thrust",
    "aerodynamic lift",
    "empirical sunlight",
    "friction",
    "Poynting-Robertson",
    "thermal recoil",
    "tidal lag",
)


def test_the_sum_is_the_sum_of_the_parts():
    cases = [EFFECT_CASES[k] for k in KEYS]
    values = {}
    for case in cases:
        values |= case.values
    together = Dynamics([c.effect for c in cases], values, tracks=MOVING)
    states = np.random.default_rng(2).normal(size=(20, 6)) + 1.0
    # inside the sphere that throws the shadow there is no light to speak of
    states[:, :3] *= np.maximum(1.1 / np.linalg.norm(states[:, :3], axis=1), 1.0)[:, None]
    a = together.acceleration(states, 0.8)
    parts = [
        Dynamics(
            [c.effect],
            {p.name: values[p.name] for p in c.effect.parameters if p.name in values},
            tracks=MOVING,
        ).acceleration(states, 0.8)
        for c in cases
    ]
    bound = 100 * np.finfo(float).eps * np.abs(parts).max()
    np.testing.assert_allclose(a, np.sum(parts, axis=0), rtol=0, atol=bound)
    assert together.system.potential is None
    names = [p.name for p in together.parameters]
    orbit = together.propagate_variational([2.0, 0.3, 0.4, 0.1, 0.6, 0.3], [0.0, 0.5], names)
    assert np.isfinite(orbit.sensitivity).all()


def test_only_what_is_the_same_thing_is_shared():
    shared = set()
    for one, other in combinations((EFFECT_CASES[k].effect for k in KEYS), 2):
        shared |= {p.name for p in one.parameters} & {p.name for p in other.parameters}
    # one atmosphere, one solid body
    air = {"drag_rho0", "drag_r0", "drag_H", "drag_omega"}
    light = {"srp_CrA_m", "srp_pressure", "au", "shadow_radius"}
    assert shared == {"GM", "c", "R_ref", "GM_moon"} | light | air | {"tide_k2"}
