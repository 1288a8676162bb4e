"""A small case file with its positions, along ICRF axes."""

import numpy as np
import pytest

from unmodeled.datasets.measurement_csv import write_measurements
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics, PointMass, Zonal

EPOCH = "2019-01-01T00:00:00 TDB"
STATE = np.array([620.0, 0.0, 350.0, 0.01, 0.07, 0.045])


@pytest.fixture
def mapping():
    """About Bennu in its equatorial axes: point mass and J2, positions every 10 minutes."""
    return {
        "name": "small",
        "body": "bennu",
        "epoch": EPOCH,
        "frame": "body_equator",
        "known": [
            {"effect": "point_mass"},
            {"effect": "zonal", "degrees": [2]},
        ],
        "measurements": [
            {
                "file": "positions.csv",
                "kind": "position",
                "sigma": "0.5 m",
                "frame": "body_equator",
            }
        ],
        "candidates": [],
    }


def _positions(times, sigma=0.5, noise=True, seed=1):
    """Positions of the true orbit along the body's equatorial axes."""
    dynamics = Dynamics([PointMass(), Zonal((2,))], {"GM": 4.89, "R_ref": 290.0, "J2": 0.0193})
    grid = np.concatenate([[0.0], times])
    values = dynamics.propagate(STATE, grid)[1:, :3]
    if noise:
        values = values + sigma * np.random.default_rng(seed).normal(size=values.shape)
    return Measurements("position", times, values, sigma, "positions.csv", epoch=EPOCH)


@pytest.fixture
def positions():
    """The function that measures positions of the true orbit at times, s."""
    return _positions


@pytest.fixture
def folder(tmp_path):
    """A folder with positions.csv: three days, without columns of sigma."""
    m = _positions(600.0 * np.arange(1, 433))
    write_measurements([m], tmp_path / "with-sigma.csv")
    rows = ["# epoch: " + EPOCH, "t_s,x_m,y_m,z_m"]
    rows += [",".join(map(repr, row)) for row in np.column_stack([m.times, m.values]).tolist()]
    (tmp_path / "positions.csv").write_text("\n".join(rows) + "\n")
    return tmp_path
