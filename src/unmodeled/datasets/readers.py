"""One door to every trajectory file: the suffix chooses the reader."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from unmodeled.core.errors import ConfigError, DataError, nearest
from unmodeled.datasets.oem import read_oem
from unmodeled.datasets.sp3 import read_sp3
from unmodeled.datasets.tabular import read_csv, read_parquet
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["READERS", "read_trajectory"]

#: Suffix (before any ``.gz``) -> reader.  A new format is one more line here.
READERS: dict[str, Callable[..., Trajectory]] = {
    ".csv": read_csv,
    ".parquet": read_parquet,
    ".sp3": read_sp3,
    ".eph": read_sp3,
    ".oem": read_oem,
    ".kvn": read_oem,
    ".xml": read_oem,
    ".txt": read_oem,
}
# Readers that unpack .gz themselves.
_UNPACK = (read_sp3, read_oem)


def read_trajectory(path: str | Path, **options: Any) -> Trajectory:
    """Read a trajectory from any known file.

    Parameters
    ----------
    path : str or Path
        A file ending in .csv or .parquet; .sp3 or .eph (both SP3); .oem, .kvn, .xml or .txt (OEM,
        KVN or XML by content).  SP3 and OEM also with .gz.
    **options
        Passed to the reader, e.g. ``satellite="L52"`` or ``accelerations=False``.

    Returns
    -------
    Trajectory
        In SI.

    Raises
    ------
    DataError
        If the suffix is unknown, or the reader refuses the file.
    ConfigError
        If the reader has no such option.
    """
    path = Path(path)
    suffixes = [s.lower() for s in path.suffixes]
    packed = suffixes[-1:] == [".gz"]
    suffix = (suffixes[:-1] if packed else suffixes)[-1:] or [""]
    reader = READERS.get(suffix[0])
    if reader is None or (packed and reader not in _UNPACK):
        known = sorted(READERS) + [f"{s}.gz" for s, r in READERS.items() if r in _UNPACK]
        shown = "".join(suffix) + (".gz" if packed else "")
        raise DataError(
            f'{path.name} has suffix "{shown}"',
            allowed=", ".join(known),
            do=nearest(shown, known),
        )
    allowed = [p for p in inspect.signature(reader).parameters if p != "path"]
    for name in options:
        if name not in allowed:
            raise ConfigError(
                f'files of type {suffix[0]} have no option "{name}"',
                allowed=", ".join(allowed),
                do=nearest(name, allowed),
            )
    return reader(path, **options)
