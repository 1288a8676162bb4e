"""What runs in a worker: one batch at a time, each finished run on the disk at once."""

from __future__ import annotations

import hashlib
import os
import signal
import threading
from collections.abc import Callable, Iterable, Sequence
from multiprocessing import parent_process
from typing import Any, TypeAlias

from unmodeled.pipeline.sweep.journal import Journal, storage_error
from unmodeled.pipeline.sweep.run_config import RunConfig, RunResult
from unmodeled.pipeline.sweep.store import Store

__all__ = ["THREAD_VARIABLES", "RunBatch", "batch_name", "start_worker", "work"]

#: Turns runs into results, in any order; yields each as it is finished, or all at the end.
RunBatch: TypeAlias = Callable[[Sequence[RunConfig]], Iterable[RunResult]]

#: One thread for linear algebra in each worker: problems are small and many.
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

_journals: dict[tuple[int, str, str], Journal] = {}
# A Dask worker may have several threads; torch's settings belong to the process.
_one_at_a_time = threading.Lock()


def work(
    folder: str,
    runs: Sequence[RunConfig],
    run_batch: RunBatch,
    session: str,
    tell: Callable[[], None] | None = None,
) -> int:
    """Run a batch and journal each result; return how many were computed.

    Parameters
    ----------
    folder : str
        The store; this worker must see it.
    runs : sequence of RunConfig
        The batch.
    run_batch : callable
        The runner.
    session : str
        Of the driver. A worker that serves several drivers in turn starts a new journal for each,
        because a driver compacts and removes the journals when it ends.
    tell : callable, optional
        Called after each finished run.

    Raises
    ------
    InputError
        If the store is not there, or its disk is full.
    RuntimeError
        If the runner left a run out or returned a foreign one: a bug.
    """
    with _one_at_a_time:
        store = Store(folder)
        store.require()
        todo = list(runs)
        mark = store.started / batch_name(runs)
        if not _set(mark):  # a worker died over this batch: what it finished stays finished
            finished = store.finished()
            todo = [run for run in runs if run.id not in finished]
        journal = _journals.setdefault((os.getpid(), folder, session), Journal(store.journals))
        expected = {run.id for run in todo}
        for result in run_batch(todo) if todo else ():
            if result.id not in expected:
                raise RuntimeError(f"the runner returned run {result.id}, which is not wanted")
            journal.append(result)
            expected.remove(result.id)
            if tell is not None:
                tell()
        if expected:
            raise RuntimeError(f"the runner left out {len(expected)} of {len(todo)} runs")
        mark.unlink(missing_ok=True)
        return len(todo)


def batch_name(runs: Sequence[RunConfig]) -> str:
    """Return the name of a batch's mark."""
    return hashlib.sha256("".join(run.id for run in runs).encode()).hexdigest()[:16]


def start_worker() -> None:
    """Prepare a process of a pool: Ctrl-C is its parent's, and it does not outlive its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:

        def follow(process: Any = parent) -> None:
            process.join()
            os._exit(1)

        threading.Thread(target=follow, daemon=True, name="follow-parent").start()


def _set(mark: Any) -> bool:
    """Set a mark; return False if it is there already."""
    try:
        mark.open("x").close()
    except FileExistsError:
        return False
    except OSError as error:
        raise storage_error(error, mark.parent) from error
    return True
