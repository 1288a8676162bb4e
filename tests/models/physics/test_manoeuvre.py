"""The smooth impulse: velocity change, position, never passed over."""

import math

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics import Dynamics, ImpulsiveManoeuvre, PointMass

DV = np.array([0.3, -0.2, 0.5])
INERTIAL = dict(zip(("manoeuvre1_dv_x", "manoeuvre1_dv_y", "manoeuvre1_dv_z"), DV, strict=True))


def test_velocity_change_without_gravity():
    w, t0, end = 0.5, 100.0, 300.0
    model = Dynamics(
        [ImpulsiveManoeuvre(frame="inertial")],
        INERTIAL | {"manoeuvre1_t0": t0, "manoeuvre1_width": w},
    )
    orbit = model.propagate([1.0, 2, 3, 0.1, 0.2, 0.3], [0.0, end])
    gained = orbit[1, 3:] - orbit[0, 3:]
    before, after = w**2 / (4 * t0**2), w**2 / (4 * (end - t0) ** 2)  # tails, to 4th order in w/T
    np.testing.assert_allclose(gained, DV * (1 - before - after), rtol=1e-9)
    moved = orbit[1, :3] - orbit[0, :3] - orbit[0, 3:] * end
    # the first moment of the tails: w^2 / (4 T) each at most, two of them and their cross terms
    np.testing.assert_allclose(moved, DV * (end - t0), rtol=0, atol=2 * w**2 / t0)


def test_impulse_in_orbit():
    """Against Kepler's orbit, kicked at t0; the error falls with the square of the width."""
    free = Dynamics([PointMass()])
    start, t0, end = np.array([1.0, 0, 0, 0, 0.9, 0.5]), 4.0, 9.0
    at = free.propagate(start, [0.0, t0])[1]
    e_r = at[:3] / np.linalg.norm(at[:3])
    e_n = np.cross(at[:3], at[3:])
    e_n /= np.linalg.norm(e_n)
    dv = 1e-6 * np.array([1.0, -2.0, 1.5])
    kick = dv @ np.stack([e_r, np.cross(e_n, e_r), e_n])
    expected = free.propagate(at + np.concatenate([np.zeros(3), kick]), [t0, end])[1]
    values = dict(zip(("manoeuvre1_dv_R", "manoeuvre1_dv_T", "manoeuvre1_dv_N"), dv, strict=True))
    model = Dynamics([PointMass(), ImpulsiveManoeuvre()], values | {"manoeuvre1_t0": t0})
    errors = [
        np.abs(
            model.with_values({"manoeuvre1_width": w}).propagate(start, [0.0, end])[1] - expected
        ).max()
        for w in (1e-2, 1e-3, 1e-4)
    ]
    # w^2 n^2 |dv| times a logarithm, and |dv|^2 / v because the axes turn with the velocity that
    # is gained; both times the growth of the orbit's partials (3 n T at most)
    size, growth = np.linalg.norm(dv), 3 * (end - t0)
    for w, error in zip((1e-2, 1e-3, 1e-4), errors, strict=True):
        assert error < (w**2 * math.log(1 / w) + size) * size * growth
    assert errors[0] > 50 * errors[1]


@pytest.mark.parametrize("share", [1e-3, 1e-8])
def test_no_epoch_is_passed_over(share):
    """The card's limit: w = 1e-5 of the period, velocity change down to 1e-8 of the velocity."""
    gm, a = 3.986004418e14, 6.878e6
    period, v = 2 * math.pi * math.sqrt(a**3 / gm), math.sqrt(gm / a)
    values = {"GM": gm, "manoeuvre1_dv_T": share * v, "manoeuvre1_width": 1e-5 * period}
    model = Dynamics([PointMass(), ImpulsiveManoeuvre()], values)
    for t0 in np.linspace(0.5, 2.5, 37) * period:
        end = model.with_values({"manoeuvre1_t0": t0}).propagate(
            [a, 0, 0, 0, v, 0], [0, 3 * period]
        )[-1]
        energy = 0.5 * end[3:] @ end[3:] - gm / np.linalg.norm(end[:3]) + 0.5 * v * v
        gained = energy / (v * v * (share + share**2 / 2))
        # rounding: 60 steps of a few eps in energy, relative to its change
        assert abs(gained - 1) < 1e-9 + 60 * 20 * np.finfo(float).eps / share


def test_sensitivity_to_the_epoch():
    model = Dynamics(
        [PointMass(), ImpulsiveManoeuvre()],
        {"manoeuvre1_dv_T": 0.05, "manoeuvre1_t0": 2.0, "manoeuvre1_width": 0.01},
    )
    start, times, h = [1.0, 0, 0, 0, 1, 0.2], [0.0, 5.0], 1e-4
    partial = model.propagate_variational(start, times, ["manoeuvre1_t0"]).sensitivity[-1, :, 0]
    ends = [
        model.with_values({"manoeuvre1_t0": 2.0 + s}).propagate(start, times)[-1] for s in (h, -h)
    ]
    # difference quotient: h^2 (0.05 of order one derivatives) and rounding 1e-14 / h
    np.testing.assert_allclose(partial, (ends[0] - ends[1]) / (2 * h), rtol=0, atol=1e-8)
    assert np.abs(partial).max() > 1e-2


def test_structures_that_make_no_sense():
    with pytest.raises(ConfigError, match=r"^manoeuvre index is 0\. Allowed: 1 or more\.$"):
        ImpulsiveManoeuvre(0)
    with pytest.raises(
        ConfigError, match=r'^manoeuvre frame is "body"\. Allowed: "rtn" or "inertial"'
    ):
        ImpulsiveManoeuvre(frame="body")
    with pytest.raises(ConfigError, match='contains "manoeuvre 1" twice'):
        Dynamics([ImpulsiveManoeuvre(), ImpulsiveManoeuvre(frame="inertial")])
