"""Families of forces and instrument errors, each with few free coefficients and a character."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.models.physics import ImpulsiveManoeuvre
from unmodeled.pipeline.cases.instrument_catalogue import instrument_candidates
from unmodeled.pipeline.comparison.orbit_geometry import (
    body_axes,
    orbit_geometry,
    sun_position,
)
from unmodeled.pipeline.comparison.solid_harmonics import (
    outer_gradients,
    surface_harmonics,
    tidal_gradients,
)
from unmodeled.pipeline.linearisation import ArcRows, Linearisation

__all__ = ["KINDS", "Family", "Kind", "families"]

Kind = Literal["gravity", "radiation", "drag", "impulsive", "instrument", "undecided"]
#: The characters that are weighed against each other.
KINDS: tuple[Kind, ...] = (
    "gravity",
    "radiation",
    "drag",
    "impulsive",
    "instrument",
    "undecided",
)
#: Epochs of impulses tried, all arcs together.
_KICKS = 60
_KICK = ("R", "T", "N")
Push = Callable[[ArcRows], Array]


@dataclass(frozen=True)
class Family:
    """Columns that stand for one explanation.

    Parameters
    ----------
    name, title : str
        Short, and in words ("a field fixed in the body").
    kind : str
        Its character.
    depends_on : str
        What the force is a function of, in words.
    columns : ndarray (n, p)
        Whitened, each of a force of 1 m/s2 root mean square along the orbits, or for impulses and
        instruments of root mean square 1 in the rows.
    alternatives : int
        How many families of this name there are, only one of which can be right (epochs).
    """

    name: str
    title: str
    kind: Kind
    depends_on: str
    columns: Array = field(repr=False)
    alternatives: int = 1


def families(lin: Linearisation) -> Iterator[Family]:
    """Yield the families that make sense for a case, the projection not yet done.

    gravity
        Central fields; potentials fixed in the body of degree 2, to 4 and to 8; the tide of a
        body far away; an unknown centre of mass is degree 1.
    radiation
        Away from the Sun in the light; the same with its two normals, changing once a revolution.
    drag
        Against the velocity, with any law of the altitude; against the turning air.
    impulsive
        A velocity change at any of 60 epochs.
    instrument
        What `instrument_candidates` lists.
    undecided
        What has no character: constant in orbital or inertial axes, harmonics of the argument of
        latitude, or any field fixed in the body, with curl.
    """
    r0 = float(np.median([np.median(_radius(a)) for a in lin.arcs]))
    yield from _gravity(lin, r0)
    if _has_sun(lin):
        yield from _radiation(lin)
    yield from _drag(lin)
    yield from _impulses(lin)
    yield from _instruments(lin)
    yield from _any(lin, r0)


def _gravity(lin: Linearisation, r0: float) -> Iterator[Family]:
    def central(a: ArcRows) -> Array:
        r = a.partials.node_states[:, :3]
        x = r0 / np.linalg.norm(r, axis=1)
        unit = r / np.linalg.norm(r, axis=1, keepdims=True)
        pushed: Array = unit[:, :, None] * np.stack([x**2, x**3, x**4], axis=1)[:, None]
        return pushed

    def potential(lowest: int, degree: int) -> Push:
        def push(a: ArcRows) -> Array:
            turn = body_axes(lin.model, a.partials.nodes)
            r = np.einsum("nij,nj->ni", turn, a.partials.node_states[:, :3])
            pushed: Array = np.einsum("nji,njp->nip", turn, outer_gradients(r, degree, r0, lowest))
            return pushed

        return push

    def tide(a: ArcRows) -> Array:
        return tidal_gradients(a.partials.node_states[:, :3], r0)

    where = "body-fixed position"
    yield _force(lin, "central", "a central force", "gravity", "radius", central)
    for lowest, degree in ((1, 1), (2, 2), (2, 4), (2, 8)):
        name = f"potential_{degree}"
        of = f"of degree {degree}" if lowest == degree else f"up to degree {degree}"
        title = f"gravity of the body {of}"
        yield _force(lin, name, title, "gravity", where, potential(lowest, degree))
    yield _force(lin, "tide", "tide of another body", "gravity", "inertial position", tide)


def _radiation(lin: Linearisation) -> Iterator[Family]:
    def plain(a: ArcRows) -> Array:
        return _sun_axes(lin, a)[:, :, :1]

    def phased(a: ArcRows) -> Array:
        axes = _sun_axes(lin, a)
        d = axes[:, :, 0]
        s = a.partials.node_states
        h = np.cross(s[:, :3], s[:, 3:])
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        noon = d - np.sum(d * h, axis=1, keepdims=True) * h
        u = np.arctan2(
            np.sum(np.cross(noon, s[:, :3]) * h, axis=1), np.sum(noon * s[:, :3], axis=1)
        )
        waves = np.stack([np.ones_like(u), np.cos(u), np.sin(u)], axis=1)
        pushed: Array = np.einsum("nia,nw->niaw", axes, waves).reshape(len(s), 3, -1)
        return pushed

    where = "direction of the Sun"
    yield _force(lin, "sun_line", "a push away from the Sun", "radiation", where, plain)
    title = "a push that turns with the Sun"
    yield _force(lin, "sun_axes", title, "radiation", where, phased)


def _drag(lin: Linearisation) -> Iterator[Family]:
    spin = lin.model.values.get("spin_rate", 0.0)
    radii = np.concatenate([_radius(a) for a in lin.arcs])
    middle, width = float(np.mean(radii)), max(float(np.std(radii)), 1e-3 * float(np.mean(radii)))

    def against(turning: bool) -> Push:
        def push(a: ArcRows) -> Array:
            s = a.partials.node_states
            v = s[:, 3:]
            if turning:
                v = v - np.cross(spin * body_axes(lin.model, a.partials.nodes)[:, 2], s[:, :3])
            speed = np.linalg.norm(v, axis=1, keepdims=True)
            x = (_radius(a) - middle) / width
            # Denser below: exponentials of several scale heights stand for any law.
            laws = np.stack([np.exp(-k * np.clip(x, -4, 4)) for k in (0.0, 0.5, 1.5)], axis=1)
            pushed: Array = (-v * speed)[:, :, None] * laws[:, None, :]
            return pushed

        return push

    where = "speed and altitude"
    yield _force(lin, "drag", "a force against the velocity", "drag", where, against(False))
    if spin:
        title = "a force against the air that turns with the body"
        yield _force(lin, "air", title, "drag", where, against(True))


def _impulses(lin: Linearisation) -> Iterator[Family]:
    each = max(_KICKS // len(lin.arcs), 1)
    effect = ImpulsiveManoeuvre()
    for a in lin.arcs:
        t = a.partials.times
        for epoch in t[0] + (t[-1] - t[0]) * (np.arange(each) + 0.5) / each:
            # Only where it happens matters: its columns are those of the velocity change.
            columns = lin.columns(effect, {f"manoeuvre{effect.index}_t0": float(epoch)}, _KICK)
            title = f"a velocity change at {epoch:.0f} s"
            name = f"impulse_{epoch:.0f}"
            yield Family(
                name, title, "impulsive", "one moment", _unit(columns), each * len(lin.arcs)
            )


def _instruments(lin: Linearisation) -> Iterator[Family]:
    for c in instrument_candidates(lin.case.arcs):
        columns = lin.columns(c.effect, c.values, c.estimate)
        where = "the instruments"
        yield Family(c.name, c.title, "instrument", where, _unit(columns))


def _any(lin: Linearisation, r0: float) -> Iterator[Family]:
    def orbital(a: ArcRows) -> Array:
        return np.swapaxes(rtn_from_inertial(a.partials.node_states), 1, 2)

    def inertial(a: ArcRows) -> Array:
        return np.broadcast_to(np.eye(3), (len(a.partials.nodes), 3, 3))

    def phase(a: ArcRows) -> Array:
        shape = orbit_geometry(lin.model, lin.case.body, a.partials.node_states, a.partials.nodes)
        u = shape["argument_of_latitude"].to_numpy()
        waves = [np.ones_like(u)]
        for k in (1, 2):
            waves += [np.cos(k * u), np.sin(k * u)]
        turned = np.einsum("nia,nw->niaw", orbital(a), np.stack(waves, axis=1))
        pushed: Array = turned.reshape(len(u), 3, -1)
        return pushed

    def field(a: ArcRows) -> Array:
        turn = body_axes(lin.model, a.partials.nodes)
        r = np.einsum("nij,nj->ni", turn, a.partials.node_states[:, :3])
        size = np.linalg.norm(r, axis=1, keepdims=True)
        shapes = surface_harmonics(r / size, 3) * (r0 / size) ** 4
        pushed: Array = np.einsum("nji,nq->nijq", turn, shapes).reshape(len(r), 3, -1)
        return pushed

    where = "the orbit's own axes"
    yield _force(lin, "rtn", "a constant push in orbital axes", "undecided", where, orbital)
    where = "inertial axes"
    yield _force(lin, "inertial", "a push that is constant in space", "undecided", where, inertial)
    title = "a force that repeats with the argument of latitude"
    yield _force(lin, "phase", title, "undecided", "argument of latitude", phase)
    title = "a field fixed in the body, with curl"
    yield _force(lin, "field", title, "undecided", "body-fixed position", field)


def _force(lin: Linearisation, name: str, title: str, kind: Kind, where: str, push: Push) -> Family:
    pushes = [push(a) for a in lin.arcs]
    square = sum(np.sum(p**2, axis=(0, 1)) for p in pushes)
    count = sum(len(p) for p in pushes)
    size = np.sqrt(square / count)
    pushes = [p / np.where(size > 0, size, 1.0) for p in pushes]
    return Family(name, title, kind, where, lin.force_columns(pushes))


def _unit(columns: Array) -> Array:
    size = np.sqrt(np.mean(columns**2, axis=0))
    scaled: Array = columns / np.where(size > 0, size, 1.0)
    return scaled


def _radius(a: ArcRows) -> Array:
    radius: Array = np.linalg.norm(a.partials.node_states[:, :3], axis=1)
    return radius


def _has_sun(lin: Linearisation) -> bool:
    return sun_position(lin.model, lin.case.body, lin.arcs[0].partials.nodes[:1]) is not None


def _sun_axes(lin: Linearisation, a: ArcRows) -> Array:
    """Away from the Sun, and two normals, in the light; (k, 3, 3), columns are the axes."""
    s, t = a.partials.node_states, a.partials.nodes
    sun = sun_position(lin.model, lin.case.body, t)
    assert sun is not None
    away = s[:, :3] - sun
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    d = away / distance
    h = np.cross(s[:, :3], s[:, 3:])
    y = np.cross(d, h / np.linalg.norm(h, axis=1, keepdims=True))
    size = np.linalg.norm(y, axis=1, keepdims=True)
    y = y / np.maximum(size, 1e-12)
    lit = orbit_geometry(lin.model, lin.case.body, s, t)["sunlit"].to_numpy()
    lit = np.nan_to_num(lit, nan=1.0)  # about the Sun it is always day
    falls = (np.median(distance) / distance) ** 2
    axes: Array = np.stack([d, y, np.cross(d, y)], axis=2) * (lit[:, None] * falls)[:, :, None]
    return axes
