"""Errors of learned fields below the Brillouin sphere of a two-lobed body, by altitude.

    python benchmarks/shapes.py [--seeds 101 102 ...] [--truth even|uneven] [--noise 0.0]

Truth: the closed form of the polyhedron `comet_like`; ``uneven`` adds +-0.08 GM inside the lobes,
so that the density is not the one that a known shape suggests. Training: one orbit of ten periods
outside the Brillouin sphere for each seed and, as a second setting, twelve straight passes above
the surface, 0.05 to 0.3 radii at their lowest. Prints the median over seeds of the median
fractional error in each band of altitude, and the share of components within the 95 % band.
"""

from __future__ import annotations

import argparse

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.threads import one_thread
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import (
    HarmonicGP,
    HarmonicLeastSquares,
    Learner,
    MasconGP,
    NoiseLevel,
    PointMassOnly,
)
from unmodeled.models.physics import Mesh, built_in_shape, polyhedron_gravity
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.prepare import prepare

#: Shares of GM and places inside the lobes.
_EXTRA = ((0.08, (0.45, 0.05, 0.03)), (-0.08, (-0.5, -0.1, 0.0)))
_POINTS = 200


def main() -> None:
    """Print a table for each setting."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[101, 102, 103, 104, 105])
    parser.add_argument("--truth", choices=("even", "uneven"), default="uneven")
    parser.add_argument("--noise", type=float, default=0.0, help="sigma_a; |a| is some 5 to 60")
    arguments = parser.parse_args()
    mesh, extra = built_in_shape("comet_like"), arguments.truth == "uneven"
    bands = {k: (x, field(mesh, x, extra)) for k, x in test_points(mesh).items()}
    for setting in ("orbit outside", "orbit and low passes"):
        errors: dict[str, list[list[float]]] = {}
        covers: dict[str, list[list[float]]] = {}
        for seed in arguments.seeds:
            x = orbit(seed)
            if setting != "orbit outside":
                x = np.concatenate([x, low_passes(mesh, seed)])
            noise = arguments.noise * np.random.default_rng(seed).normal(size=x.shape)
            y = field(mesh, x, extra) + noise
            for label, learner in learners().items():
                with one_thread():
                    learner.fit(x, y, NoiseLevel(acceleration=arguments.noise))
                    scores = [score(learner, *band) for band in bands.values()]
                errors.setdefault(label, []).append([s[0] for s in scores])
                covers.setdefault(label, []).append([s[1] for s in scores])
        print(f"\n{setting}; truth {arguments.truth}, noise {arguments.noise:g}, ", end="")
        print(f"{len(arguments.seeds)} seeds, {len(x)} samples of the last")
        print(f"{'':34}" + "".join(f"{name:>18}" for name in bands))
        for label in errors:
            pairs = zip(np.median(errors[label], axis=0), np.median(covers[label], 0), strict=True)
            cells = [f"{e:.1e}" + ("" if np.isnan(c) else f" ({c:.0%})") for e, c in pairs]
            print(f"{label:34}" + "".join(f"{cell:>18}" for cell in cells), flush=True)


def learners() -> dict[str, Learner]:
    """Return the unfitted learners by label."""
    return {
        "point mass": PointMassOnly(),
        "harmonics, least squares, 8": HarmonicLeastSquares(degree=8),
        "harmonic gp, 12, R": HarmonicGP(degree=12),
        "harmonic gp, 12, 0.5 R": HarmonicGP(degree=12, radius=0.5),
        "mascon gp, ellipsoid, 400": MasconGP(axes=(0.95, 0.45, 0.33)),
        "mascon gp, shape, 400": MasconGP(shape="comet_like"),
        "mascon gp, shape, 1000": MasconGP(shape="comet_like", count=1000),
    }


def score(learner: Learner, x: Array, truth: Array) -> tuple[float, float]:
    """Return median fractional error, and share of components within 1.96 sigma or nan."""
    off = learner.predict(x) - truth
    error = float(np.median(np.linalg.norm(off, axis=1) / np.linalg.norm(truth, axis=1)))
    if not learner.has_covariance:
        return error, float("nan")
    sigma = np.sqrt(np.diagonal(learner.predict_covariance(x), axis1=1, axis2=2))
    return error, float(np.mean(np.abs(off) <= 1.96 * sigma))


def field(mesh: Mesh, x: Array, extra: bool) -> Array:
    """Return the true acceleration (n, 3), normalised units."""
    a = polyhedron_gravity(mesh, x, NORMALISED_GM).acceleration
    for share, place in _EXTRA if extra else ():
        d = x - np.array(place)
        a = a - share * NORMALISED_GM * d / np.linalg.norm(d, axis=1)[:, None] ** 3
    return a


def orbit(seed: int) -> Array:
    """Return body-fixed positions (n, 3) of the training orbit of a seed."""
    config = CharacterizationConfig.resolve(
        {
            "body": "eros",
            "seed": seed,
            "data": {"field": {"kind": "polyhedron", "shape": "comet_like"}, "volume": "low"},
            "learners": [{"kind": "point_mass"}],
        }
    )
    with one_thread():
        return prepare(config).train.positions


def low_passes(mesh: Mesh, seed: int) -> Array:
    """Return positions (n, 3) outside the body on straight lines along its surface."""
    rng = np.random.default_rng(1000 + seed)
    middle, normal = faces(mesh)
    lines = []
    for k in rng.choice(len(middle), 12, replace=False):
        along = np.cross(normal[k], rng.normal(size=3))
        along /= np.linalg.norm(along)
        lowest = middle[k] + rng.uniform(0.05, 0.3) * normal[k]
        lines.append(lowest + np.linspace(-0.8, 0.8, 21)[:, None] * along)
    x = np.concatenate(lines)
    return np.ascontiguousarray(x[~polyhedron_gravity(mesh, x, 1.0).inside])


def test_points(mesh: Mesh) -> dict[str, Array]:
    """Return points by band: above the surface, by distance to it, by distance to the centre."""
    rng = np.random.default_rng(7)
    middle, normal = faces(mesh)
    pick = rng.choice(len(middle), _POINTS, replace=False)
    bands = {"surface": middle[pick] + 1e-3 * normal[pick]}
    x = rng.uniform(-1.0, 1.0, size=(6000, 3))
    x = x[np.linalg.norm(x, axis=1) < 1.0]
    x = x[~polyhedron_gravity(mesh, x, 1.0).inside]
    # To the nearest face centre or vertex of a finer mesh: too large by 0.01 at most near it.
    fine = built_in_shape("comet_like", 1.0, 32)
    places = np.concatenate([fine.vertices, fine.corners.mean(axis=1)])
    height = np.array([np.sqrt(((p - places) ** 2).sum(axis=1).min()) for p in x])
    for low, high in ((0.0, 0.1), (0.1, 0.5)):
        bands[f"{low:g}-{high:g} R"] = x[(height > low) & (height <= high)][:_POINTS]
    u = rng.normal(size=(2 * _POINTS, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    r = np.concatenate([rng.uniform(1.0, 1.5, _POINTS), rng.uniform(1.5, 3.0, _POINTS)])
    bands["r 1-1.5 R"], bands["r 1.5-3 R"] = np.split(r[:, None] * u, 2)
    return bands


def faces(mesh: Mesh) -> tuple[Array, Array]:
    """Return centres and outward unit normals (m, 3) of the faces."""
    c = mesh.corners
    normal = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    return c.mean(axis=1), normal / np.linalg.norm(normal, axis=1)[:, None]


if __name__ == "__main__":
    main()
