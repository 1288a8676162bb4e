"""A sweep of fake runs that starts in a fraction of a second: no torch, no pandas.

Run as a program it works on a store until it is done or killed:

    python light.py STORE COUNT WORKERS LOG [SLEEP]
"""

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from unmodeled.core.errors import UnmodeledError
from unmodeled.pipeline.sweep.engine import run_batches
from unmodeled.pipeline.sweep.executors import inline_engine, process_engine
from unmodeled.pipeline.sweep.run_config import RunResult
from unmodeled.pipeline.sweep.store import Store


@dataclass(frozen=True)
class FakeRun:
    id: str


@dataclass(frozen=True)
class FakeRunner:
    """Logs each run that it begins, sleeps, and answers with numbers made from the id."""

    log: str
    seconds: float = 0.0

    def __call__(self, runs):
        for run in runs:
            with Path(self.log).open("a") as file:
                file.write(run.id + "\n")
            time.sleep(self.seconds)
            yield answer(run)


def answer(run):
    number = int(run.id, 16)
    return RunResult(run.id, {"x": number / 7, "word": f"w{number}", "count": number})


def fake_runs(count):
    return [FakeRun(f"{k:032x}") for k in range(count)]


def in_batches(runs, size):
    return [tuple(runs[k : k + size]) for k in range(0, len(runs), size)]


def go_on(folder, count, workers, log, seconds):
    """What `sweep` does, without a plan."""
    store = Store(folder)
    store.create()
    engine = inline_engine() if workers == 1 else process_engine(workers)
    with store.lock():
        store.compact()
        store.forget_started()
        finished = store.finished()
        pending = [run for run in fake_runs(count) if run.id not in finished]
        run_batches(store, in_batches(pending, 7), FakeRunner(log, seconds), engine)
        store.compact()


if __name__ == "__main__":
    _, folder, count, workers, log, *seconds = sys.argv
    print(os.getpid(), flush=True)
    try:
        go_on(folder, int(count), int(workers), log, float(seconds[0]) if seconds else 0.0)
    except UnmodeledError as error:
        print(error, file=sys.stderr)
        sys.exit(error.exit_code)
