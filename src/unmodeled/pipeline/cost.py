"""Time and memory of a piece of work."""

from __future__ import annotations

import resource
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np
import psutil

from unmodeled.core.arrays import Array

__all__ = ["Meter", "peak_memory", "time_evaluation"]

_INTERVAL = 0.005


@dataclass
class Meter:
    """Context manager that measures wall time and the growth of resident memory.

    Attributes
    ----------
    seconds : float
        Wall time.
    peak_bytes : int
        Largest resident size during the work, minus that at its start; 0 if it fits in memory
        that the process already held.
    """

    seconds: float = 0.0
    peak_bytes: int = 0

    def __enter__(self) -> Self:
        self._process = psutil.Process()
        self._base = self._process.memory_info().rss
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        self._start = time.perf_counter()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.seconds = time.perf_counter() - self._start
        self._stop.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._stop.is_set():
            size = self._process.memory_info().rss - self._base
            self.peak_bytes = max(self.peak_bytes, size)
            self._stop.wait(_INTERVAL)


def time_evaluation(predict: Callable[[Array], Array], points: Array) -> tuple[float, float]:
    """Return seconds for one point alone and seconds a point in one call with all of them.

    The median of 20 single calls and the best of 3 calls with all points.
    """
    predict(points)
    single = []
    for k in range(20):
        x = points[k % len(points)][None]
        start = time.perf_counter()
        predict(x)
        single.append(time.perf_counter() - start)
    batch = []
    for _ in range(3):
        start = time.perf_counter()
        predict(points)
        batch.append(time.perf_counter() - start)
    return float(np.median(single)), min(batch) / len(points)


def peak_memory() -> int:
    """Return the largest resident size of this process so far, bytes."""
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size if sys.platform == "darwin" else size * 1024  # Linux counts in kB
