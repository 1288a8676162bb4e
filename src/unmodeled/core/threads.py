"""One thread a process: results must not depend on how many processors a machine has."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

__all__ = ["one_thread"]


@contextmanager
def one_thread() -> Iterator[None]:
    """Hold linear algebra and torch to one thread inside the block.

    Sums that are split over threads differ in the last bits, and training amplifies them.
    Problems here are small and many: they are spread over processes, one thread each.
    """
    torch = sys.modules.get("torch")  # not imported only to be told
    before = torch.get_num_threads() if torch else 0
    with threadpool_limits(limits=1):
        if torch:
            torch.set_num_threads(1)
        try:
            yield
        finally:
            if torch:
                torch.set_num_threads(before)
