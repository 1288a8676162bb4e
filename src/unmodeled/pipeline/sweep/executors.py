"""Where batches run: in this process, in processes, on a Dask cluster; all are Executors."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from unmodeled.core.errors import ConfigError, InputError
from unmodeled.pipeline.sweep.worker import THREAD_VARIABLES, start_worker

__all__ = ["Engine", "InlineExecutor", "dask_engine", "inline_engine", "process_engine"]

T = TypeVar("T")
#: Longest wait for the thread of a pool whose processes have ended, s.
_MANAGER_S = 5.0


@dataclass(frozen=True)
class Engine:
    """A place to run batches.

    Parameters
    ----------
    name : str
        For messages.
    executor : callable
        Opens an executor; a pool that broke is opened again.
    window : int
        Most batches submitted at a time: a scheduler that holds a hundred thousand futures is
        slow, and what is not submitted need not be cancelled.
    inline : bool
        Whether batches run in this process, one after the other.
    """

    name: str
    executor: Callable[[], AbstractContextManager[Executor]]
    window: int
    inline: bool = False


class InlineExecutor(Executor):
    """Runs what is submitted at once, in this process."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Return a future that is done; Ctrl-C is not caught in it."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - the future's owner looks at it
            future.set_exception(error)
        return future


def inline_engine() -> Engine:
    """Run one batch after the other in this process."""

    @contextmanager
    def opened() -> Iterator[Executor]:
        yield InlineExecutor()

    return Engine("this process", opened, 1, inline=True)


def process_engine(workers: int) -> Engine:
    """Run in new processes (spawn), each with one thread for linear algebra.

    Raises
    ------
    ConfigError
        If the number of workers is below 1.
    """
    if workers < 1:
        raise ConfigError(f"{workers} workers", allowed="1 or more")

    @contextmanager
    def opened() -> Iterator[Executor]:
        with _one_thread_each():
            pool = ProcessPoolExecutor(
                workers,
                mp_context=multiprocessing.get_context("spawn"),
                initializer=start_worker,
            )
            try:
                yield pool
                pool.shutdown()
            finally:
                _end(pool)

    return Engine(f"{workers} processes", opened, 2 * workers)


def dask_engine(address: str, window: int = 256) -> Engine:
    """Run on a Dask cluster that is up already; its workers see the store's folder.

    Parameters
    ----------
    address : str
        Of the scheduler, e.g. ``tcp://node:8786``.
    window : int
        Most futures at a time.

    Raises
    ------
    InputError
        When opened: dask is not installed, or the scheduler does not answer.
    """

    @contextmanager
    def opened() -> Iterator[Executor]:
        try:
            from distributed import Client
        except ImportError as error:
            raise InputError(
                "--scheduler needs dask, which is not installed",
                do="install it, on the workers too: pip install 'unmodeled[dask]'",
            ) from error
        try:
            client = Client(address, timeout=20, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(
                f"no Dask scheduler answers at {address}",
                allowed="the address that the scheduler printed, e.g. tcp://node:8786",
            ) from error
        with client:
            # pure=False: two batches that look alike are still two batches.
            executor = client.get_executor(pure=False)
            try:
                yield executor
            finally:
                executor.shutdown(wait=False)

    return Engine(f"Dask at {address}", opened, window)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Set the variables that a new process reads before it loads its linear algebra."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _end(pool: ProcessPoolExecutor) -> None:
    """End a pool now; what its workers have journaled is safe."""
    # Before Python 3.14 (terminate_workers) there is no public way to reach the processes.
    processes = list((getattr(pool, "_processes", None) or {}).values())
    manager = getattr(pool, "_executor_manager_thread", None)
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.terminate()
    for process in processes:
        process.join()
    # That thread joins the processes too: who comes second returns before the first has noted
    # the end. It may hang on the pipe of a process that was killed while reading (gh-94777).
    if manager is not None:
        manager.join(_MANAGER_S)
