"""Run batches on an executor: a bounded window, lost workers replaced, Ctrl-C at any moment."""

from __future__ import annotations

import secrets
import traceback
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field

from unmodeled.core.errors import UnmodeledError
from unmodeled.pipeline.sweep.executors import Engine
from unmodeled.pipeline.sweep.run_config import RunConfig
from unmodeled.pipeline.sweep.store import Store
from unmodeled.pipeline.sweep.worker import RunBatch, batch_name, work

__all__ = ["SweepError", "run_batches"]

Batch = tuple[RunConfig, ...]
#: A batch over which workers died or that raised an unexpected error is tried this often.
_ATTEMPTS = 3
#: After so many batches that failed for good, the rest is not tried.
_GIVE_UP_AFTER = 5
_LOOK_EVERY_S = 0.5


class SweepError(UnmodeledError):
    """Some batches ended in an unexpected error; all other runs are kept."""


@dataclass
class _Progress:
    """What is waiting, running, and broken."""

    waiting: deque[Batch]
    running: dict[Future[int], Batch] = field(default_factory=dict)
    attempts: Counter[str] = field(default_factory=Counter)
    failed: list[tuple[Batch, BaseException]] = field(default_factory=list)


def run_batches(
    store: Store,
    batches: Sequence[Batch],
    run_batch: RunBatch,
    engine: Engine,
    tell: Callable[[int], None] = lambda finished: None,
) -> None:
    """Run all batches; each finished run is in the store's journals.

    Parameters
    ----------
    store : Store
        Held by `Store.lock`.
    batches : sequence of tuple of RunConfig
        In the order in which they are started.
    run_batch : callable
        The runner; pickled for other processes.
    engine : Engine
        Where.
    tell : callable
        Told now and then how many runs have been finished since the last time.

    Raises
    ------
    SweepError
        If batches failed for unexpected reasons, three times each; the rest was run.
    InputError
        If a worker does not see the store or its disk is full; at once.
    """
    state = _Progress(deque(batches))
    session = secrets.token_hex(8)
    store.appended()  # what is there already is no progress
    while state.waiting or state.running:
        with engine.executor() as executor:
            _drain(state, store, executor, run_batch, engine, session, tell)
        # Reached with work left only if the pool broke: what was in flight is tried again.
        _requeue(state, store)
    tell(store.appended())
    if state.failed:
        raise _summary(store, state)


def _drain(
    state: _Progress,
    store: Store,
    executor: Executor,
    run_batch: RunBatch,
    engine: Engine,
    session: str,
    tell: Callable[[int], None],
) -> None:
    """Work until all is done, or the executor broke."""
    folder = str(store.folder.resolve())
    each = (lambda: tell(store.appended()),) if engine.inline else ()
    while state.waiting or state.running:
        while state.waiting and len(state.running) < engine.window:
            batch = state.waiting.popleft()
            try:
                future = executor.submit(work, folder, batch, run_batch, session, *each)
            except BrokenExecutor:
                state.waiting.appendleft(batch)
                return
            state.running[future] = batch
        done, _ = wait(state.running, timeout=_LOOK_EVERY_S, return_when=FIRST_COMPLETED)
        tell(store.appended())
        for future in done:
            error = future.exception()
            if isinstance(error, BrokenExecutor):
                return
            batch = state.running.pop(future)
            if error is not None:
                _judge(state, batch, error)


def _judge(state: _Progress, batch: Batch, error: BaseException) -> None:
    """Stop on what the user can mend; try the rest again, and give up in the end."""
    if isinstance(error, UnmodeledError):
        raise error
    name = batch_name(batch)
    state.attempts[name] += 1
    if state.attempts[name] < _ATTEMPTS:
        state.waiting.append(batch)
        return
    state.failed.append((batch, error))
    if len(state.failed) >= _GIVE_UP_AFTER:
        state.waiting.clear()


def _requeue(state: _Progress, store: Store) -> None:
    """Put batches of a broken pool back; those that had been started count an attempt."""
    for future, batch in list(state.running.items()):
        del state.running[future]
        if future.done() and not future.cancelled() and future.exception() is None:
            continue
        if (store.started / batch_name(batch)).exists():
            _judge(state, batch, RuntimeError("the worker was killed; out of memory?"))
        else:
            state.waiting.appendleft(batch)


def _summary(store: Store, state: _Progress) -> SweepError:
    """Write the tracebacks to a file; return one sentence."""
    path = store.folder / "errors.txt"
    path.write_text("\n".join("".join(traceback.format_exception(e)) for _, e in state.failed))
    runs = sum(len(batch) for batch, _ in state.failed)
    error = state.failed[0][1]
    return SweepError(
        f"{len(state.failed)} batches ({runs} runs) failed {_ATTEMPTS} times; the first: "
        f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}",
        do=f"see {path}; all other finished runs are kept",
    )
