"""Low and high noise, low and high data volume: the parts of a grid that get their own answer."""

from __future__ import annotations

import itertools
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

__all__ = ["regimes_of"]

#: One truth value a row.
Mask: TypeAlias = np.ndarray[Any, np.dtype[np.bool_]]

_NOISE = ("noise.state", "noise.acceleration")
_VOLUMES = {"low": 10.0, "moderate": 100.0}


def regimes_of(table: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Split a sweep's table by noise and data volume, where the grid varies them.

    A level is high if it is in the upper half of the levels of the grid; noise is high if that
    of the state or that of the acceleration is.

    Returns
    -------
    dict of str to DataFrame
        By name, e.g. ``"low noise, high volume"``; ``"all runs"`` if neither varies. Regimes
        without runs are left out.
    """
    splits = [s for s in (_noise(table), _volume(table)) if s is not None]
    if not splits:
        return {"all runs": table}
    found = {}
    for choice in itertools.product(("low", "high"), repeat=len(splits)):
        keep = np.ones(len(table), dtype=bool)
        for level, (_, high) in zip(choice, splits, strict=True):
            keep &= high if level == "high" else ~high
        if keep.any():
            names = (f"{level} {name}" for level, (name, _) in zip(choice, splits, strict=True))
            found[", ".join(names)] = table[keep]
    return found


def _noise(table: pd.DataFrame) -> tuple[str, Mask] | None:
    columns = [c for c in _NOISE if c in table and len(table[c].unique()) > 1]
    if not columns:
        return None
    return "noise", np.any([_upper_half(table[c]) for c in columns], axis=0)


def _volume(table: pd.DataFrame) -> tuple[str, Mask] | None:
    for column in ("data.train_periods", "data.volume"):
        if column in table and len(table[column].unique()) > 1:
            levels = table[column].map(lambda v: _VOLUMES.get(v, v)).astype(float)
            return "volume", _upper_half(levels)
    return None


def _upper_half(values: pd.Series[Any]) -> Mask:
    levels = np.unique(values.to_numpy(dtype=np.float64))
    middle = float(levels[(len(levels) - 1) // 2])
    return np.asarray(values.to_numpy(dtype=np.float64) > middle, dtype=np.bool_)
