"""Positions from a JPL SPK kernel, taken as if they were measurements.

An ephemeris is the result of somebody's fit: its errors are not noise, and what that model left
out is left out of these "measurements", too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.constants import DAY
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.time import seconds_between, terrestrial_time
from unmodeled.datasets.measurement_files import MeasurementSet
from unmodeled.datasets.measurements import Kind, Measurements

__all__ = ["read_spk"]

_KM = 1e3
_ICRF = 1


def read_spk(
    path: str | Path,
    kind: str,
    *,
    target: int,
    center: int,
    sigma: npt.ArrayLike,
    start: str | float,
    end: str | float,
    step: float,
    epoch: str | None = None,
    label: str | None = None,
) -> MeasurementSet:
    """Sample one object of an SPK kernel.

    Parameters
    ----------
    path : str or Path
        The kernel (.bsp).
    kind : {"position", "position_velocity"}
        What to take.
    target, center : int
        NAIF numbers, e.g. 2101955 (Bennu) and 10 (Sun). Segments are joined where needed.
    sigma : array_like
        As in `Measurements`.
    start, end : str or float
        First and last moment: dates with their scales, or seconds since ``epoch``.
    step : float
        Seconds between samples.
    epoch : str, optional
        Time zero; ``start`` by default.
    label : str, optional
        Name in tables; the file's by default.

    Returns
    -------
    MeasurementSet
        m, m/s, relative to the centre, ICRF axes.

    Raises
    ------
    ConfigError
        On another kind, a step that is not positive, an end before the start, seconds without an
        epoch, or where the package jplephem is not installed.
    DataError
        If the file is missing or no kernel, lacks one of the bodies, does not cover the dates, is
        not along ICRF axes, or has a type of data that jplephem does not read.
    """
    path = Path(path)
    if kind not in ("position", "position_velocity"):
        raise ConfigError(f'{path.name}: kind is "{kind}"', allowed="position, position_velocity")
    zero = epoch or (start if isinstance(start, str) else "")
    if not zero:
        raise ConfigError(
            f"{path.name}: start is {start} s and time zero is not given",
            do='give epoch, or a date such as "2000-01-01T12:00:00 TDB"',
        )
    first, last = (
        seconds_between(zero, t) if isinstance(t, str) else float(t) for t in (start, end)
    )
    span = last - first
    if not (np.isfinite(step) and step > 0 and span > 0):
        raise ConfigError(
            f"{path.name}: step {step} s from {start} to {end}",
            allowed="step > 0 s, end after start",
        )
    # A share of a step beyond the end is rounding.
    times = first + np.arange(0.0, span + 1e-6 * step, step)
    tdb = terrestrial_time(zero, times).tdb
    kernel = _open(path)
    try:
        here, root = _states(kernel, target, path.name, tdb)
        there, other = _states(kernel, center, path.name, tdb)
    finally:
        kernel.close()
    if root != other:
        raise DataError(
            f"{path.name} does not join {target} and {center}: one hangs on {root}, one on {other}"
        )
    states = here - there
    values = states if kind == "position_velocity" else states[:, :3]
    found = Measurements(cast(Kind, kind), times, values, sigma, label or path.name, epoch=zero)
    notes: dict[str, object] = {"format": "SPK", "target": target, "center": center}
    return MeasurementSet((found,), zero, path.name, notes)


def _open(path: Path) -> Any:
    try:
        from jplephem.spk import SPK  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError as exc:
        raise ConfigError(
            "SPK kernels need the package jplephem", do="pip install 'unmodeled[planets]'"
        ) from exc
    try:
        return SPK.open(str(path))
    except FileNotFoundError as exc:
        raise DataError(f"there is no file {path}", do="check the path") from exc
    except Exception as exc:  # jplephem lets through whatever struct and mmap raise
        raise DataError(f"{path.name} is not an SPK kernel ({exc})") from exc


def _states(kernel: Any, body: int, file: str, tdb: Any) -> tuple[Array, int]:
    """Return states (n, 6), SI, relative to the root of the body's tree, and that root."""
    total = np.zeros((len(tdb), 6))
    targets = {s.target for s in kernel.segments} | {s.center for s in kernel.segments}
    if body not in targets:
        raise DataError(
            f"{file} has no body {body}", allowed=", ".join(str(t) for t in sorted(targets))
        )
    date = tdb.jd1 + tdb.jd2
    while True:
        chain = [s for s in kernel.segments if s.target == body]
        if not chain:
            return total, body
        done = np.zeros(len(date), dtype=bool)
        for segment in chain:
            inside = ~done & (date >= segment.start_jd) & (date <= segment.end_jd)
            if inside.any() and segment.center == chain[0].center:
                total[inside] += _compute(segment, tdb.jd1[inside], tdb.jd2[inside], file)
                done |= inside
        if not done.all():
            first, last = min(s.start_jd for s in chain), max(s.end_jd for s in chain)
            raise DataError(
                f"{file} does not cover all dates for body {body}",
                allowed=f"Julian dates {first:.2f} to {last:.2f} TDB",
            )
        body = int(chain[0].center)


def _compute(segment: Any, one: Array, two: Array, file: str) -> Array:
    if segment.frame != _ICRF:
        raise DataError(
            f"{file}: a segment is along the axes of NAIF frame {segment.frame}",
            allowed="frame 1 (J2000, ICRF axes)",
            do="convert the kernel",
        )
    try:
        position, velocity = segment.compute_and_differentiate(one, two)
    except (ValueError, NotImplementedError) as exc:
        raise DataError(f"{file}: {str(exc).splitlines()[0]}") from exc
    return np.concatenate([position * _KM, velocity * (_KM / DAY.value)]).T
