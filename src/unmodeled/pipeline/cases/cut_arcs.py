"""Measurements cut into arcs: to be fitted, and held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.time import seconds_between
from unmodeled.datasets.measurements import Measurements
from unmodeled.pipeline.cases.case_config import CaseConfig, StateConfig
from unmodeled.pipeline.cases.quantities import parse_quantity

__all__ = ["Piece", "cut", "seconds_after"]


@dataclass(frozen=True)
class Piece:
    """One arc before it has an initial state.

    Parameters
    ----------
    name : str
        In tables.
    start : float
        Time of the initial state, s.
    measurements : tuple of Measurements
        Those of this arc.
    held_out : bool
        True: never fitted to.
    state : ndarray (6,), optional
        Initial state from the case file, m and m/s.
    """

    name: str
    start: float
    measurements: tuple[Measurements, ...]
    held_out: bool = False
    state: Array | None = None


def cut(config: CaseConfig, sets: Sequence[Measurements]) -> list[Piece]:
    """Cut measurements at the case's arcs.

    An arc holds the measurements from its start up to, but not at, its end; the last one holds
    its end. Arcs of equal length begin at the first measurement.

    Raises
    ------
    ConfigError
        If arcs end before they start, all are held out, or a number is not that of an arc.
    DataError
        If an arc has no data.
    """
    first = min(float(m.times[0]) for m in sets)
    last = max(float(m.times[-1]) for m in sets)
    windows = _windows(config, first, last)
    held = config.arcs.held_out
    chosen = {len(windows)} if held == "last" else set(held)
    if not chosen <= set(range(1, len(windows) + 1)):
        raise ConfigError(
            f"arcs.held_out is {sorted(chosen)}", allowed=f"numbers 1 to {len(windows)}, or last"
        )
    pieces = []
    for number, (name, start, end, out, state) in enumerate(windows, start=1):
        closed = number == len(windows) or windows[number][1] > end
        inside = [_between(m, start, end, closed) for m in sets]
        found = tuple(m for m in inside if m is not None)
        if not found:
            raise DataError(
                f"{name} from {start:.6g} s to {end:.6g} s has no measurements",
                allowed=f"data reach from {first:.6g} s to {last:.6g} s after the epoch",
                do="change the arcs",
            )
        begin = start if state is not None else min(float(m.times[0]) for m in found)
        initial = None if state is None else np.array(state.state())
        pieces.append(Piece(name, begin, found, out or number in chosen, initial))
    if all(p.held_out for p in pieces):
        raise ConfigError("every arc is held out", allowed="at least one to be fitted")
    return pieces


def seconds_after(given: Any, epoch: str, name: str) -> float:
    """Return seconds after the epoch of ``"2 h"`` or of a date with its scale."""
    if isinstance(given, str) and "T" in given and given[:4].isdigit():
        return seconds_between(epoch, given)
    return parse_quantity(given, "s", name)


def _windows(
    config: CaseConfig, first: float, last: float
) -> list[tuple[str, float, float, bool, StateConfig | None]]:
    arcs, alone = config.arcs, config.initial_state
    if arcs.each:
        out = []
        for number, arc in enumerate(arcs.each, start=1):
            name = arc.name or f"arc {number}"
            start = seconds_after(arc.start, config.epoch, f"{name}: start")
            end = seconds_after(arc.end, config.epoch, f"{name}: end")
            if not start < end:
                raise ConfigError(f"{name} ends at {end:.6g} s and starts at {start:.6g} s")
            out.append((name, start, end, arc.role == "held_out", arc.initial_state))
        if alone is not None:
            raise ConfigError(
                "initial_state stands beside a list of arcs", do="give it in each arc"
            )
        return out
    # A state that is given holds at the epoch of the case.
    begin = 0.0 if alone is not None else first
    if arcs.length is None:
        return [("arc 1", begin, last, False, alone)]
    length = parse_quantity(arcs.length, "s", "arcs.length")
    if not length > 0:
        raise ConfigError(f"arcs.length is {arcs.length}", allowed="a time > 0")
    count = max(1, int(np.ceil((last - begin) / length * (1 - 1e-12))))
    if alone is not None and count > 1:
        raise ConfigError(
            f"one initial_state for {count} arcs", do="list the arcs, each with its initial_state"
        )
    return [
        (f"arc {k + 1}", begin + k * length, begin + (k + 1) * length, False, alone)
        for k in range(count)
    ]


def _between(m: Measurements, start: float, end: float, closed: bool) -> Measurements | None:
    mask = (m.times >= start) & ((m.times <= end) if closed else (m.times < end))
    return m.subset(mask) if mask.any() else None
