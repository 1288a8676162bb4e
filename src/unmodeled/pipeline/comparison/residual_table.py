"""Every residual with where the spacecraft was, in measured and in orbital components."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.pipeline.comparison.orbit_geometry import orbit_geometry
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["Direction", "Index", "Series", "directions", "residual_table", "rtn_table", "series_of"]

Index: TypeAlias = npt.NDArray[np.intp]
_POSITIONS = ("position", "position_velocity")


class Series(NamedTuple):
    """Rows (n,) of one component of one data set on one arc."""

    arc: str
    label: str
    component: str
    rows: Index


def series_of(rows: pd.DataFrame) -> list[Series]:
    """Return the series among the rows of `Linearisation.rows`, in their order."""
    found: dict[tuple[str, str, str], list[int]] = {}
    names = zip(rows["arc"], rows["label"], rows["component"], strict=True)
    for k, name in enumerate(names):
        found.setdefault(name, []).append(k)
    return [Series(*name, np.array(index)) for name, index in found.items()]


def residual_table(lin: Linearisation) -> pd.DataFrame:
    """Return a row a measured component, edited ones included.

    Columns: arc, label, component, t_s, residual (SI, measured minus predicted), sigma,
    normalised, used, then those of `orbit_geometry`.
    """
    parts = []
    for a in lin.arcs:
        for m, index, _ in a.sets:
            shape = orbit_geometry(lin.model, lin.case.body, a.partials.states[index], m.times)
            parts.append(shape.loc[shape.index.repeat(len(m.components))])
    table = lin.fit.residuals.reset_index(drop=True)
    table.insert(6, "normalised", table["residual"] / table["sigma"])
    return pd.concat([table, pd.concat(parts, ignore_index=True)], axis=1)


def rtn_table(lin: Linearisation) -> pd.DataFrame:
    """Return residuals of positions turned to radial, transverse, normal, a row an epoch.

    Columns: arc, label, t_s, R, T, N (m), sigma_R, sigma_T, sigma_N (m), used (all components
    are), then those of `orbit_geometry`. Empty where no positions were measured.
    """
    parts, first = [], 0
    residuals = lin.fit.residuals
    for a in lin.arcs:
        for m, index, mask in a.sets:
            k = len(m.components)
            rows = slice(first, first + m.values.size)
            first += m.values.size
            if m.kind not in _POSITIONS:
                continue
            states = a.partials.states[index]
            # The measured axes may be those of the Earth: the partials know.
            axes = m.partials(states)[:, :3, :3] @ np.swapaxes(rtn_from_inertial(states), 1, 2)
            r = residuals["residual"].to_numpy()[rows].reshape(-1, k)[:, :3]
            s = residuals["sigma"].to_numpy()[rows].reshape(-1, k)[:, :3]
            turned = np.einsum("nji,nj->ni", axes, r)
            sigma = np.sqrt(np.einsum("nji,nj->ni", axes**2, s**2))
            frame = pd.DataFrame({"arc": a.arc.name, "label": m.label, "t_s": m.times})
            for j, name in enumerate("RTN"):
                frame[name], frame[f"sigma_{name}"] = turned[:, j], sigma[:, j]
            frame["used"] = np.all(mask.reshape(-1, k)[:, :3], axis=1)
            shape = orbit_geometry(lin.model, lin.case.body, states, m.times)
            parts.append(pd.concat([frame, shape], axis=1))
    if not parts:
        names = ["arc", "label", "t_s", *"RTN", "sigma_R", "sigma_T", "sigma_N", "used"]
        return pd.DataFrame(columns=names)
    return pd.concat(parts, ignore_index=True)


@dataclass(frozen=True)
class Direction:
    """One signed component of the whitened residuals.

    Parameters
    ----------
    name : str
        "R", "T", "N", "vR" ..., or the measured component.
    weights : ndarray (n,)
        The component at an epoch is the sum over its rows of weight times residual.
    """

    name: str
    weights: Array


def directions(lin: Linearisation) -> list[Direction]:
    """Return the components in which residuals are looked at: R, T, N wherever there are axes.

    All data sets together; the weights of rows that do not belong to a component are zero.
    """
    found: dict[str, Array] = {}
    for a in lin.arcs:
        first = a.rows.start
        for m, index, mask in a.sets:
            states = a.partials.states[index]
            k = len(m.components)
            rows = slice(first, first + int(mask.sum()))
            first = rows.stop
            if m.kind in _POSITIONS:
                jacobian, turn = m.partials(states), np.swapaxes(rtn_from_inertial(states), 1, 2)
                for part in range(k // 3):
                    at = slice(3 * part, 3 * part + 3)
                    axes = jacobian[:, at, at] @ turn
                    for j, axis in enumerate("RTN"):
                        w = np.zeros((len(states), k))
                        w[:, at] = axes[:, :, j]
                        name = ("", "v")[part] + axis
                        column = found.setdefault(name, np.zeros(len(lin.residuals)))
                        column[rows] = w.ravel()[mask]
            else:
                for j, name in enumerate(m.components):
                    w = np.zeros((len(states), k))
                    w[:, j] = 1.0
                    column = found.setdefault(name, np.zeros(len(lin.residuals)))
                    column[rows] = w.ravel()[mask]
    return [Direction(name, w) for name, w in found.items()]
