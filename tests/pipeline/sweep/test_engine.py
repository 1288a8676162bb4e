import multiprocessing
import random
import threading
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from contextlib import contextmanager

import pytest
from light import FakeRun, FakeRunner, answer, fake_runs, go_on, in_batches

from unmodeled.core.errors import ConfigError, InputError
from unmodeled.pipeline.sweep.engine import SweepError, run_batches
from unmodeled.pipeline.sweep.executors import Engine, inline_engine, process_engine
from unmodeled.pipeline.sweep.shard import Shard
from unmodeled.pipeline.sweep.store import Store
from unmodeled.pipeline.sweep.worker import batch_name, work


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "store")
    store.create()
    return store


def expected(count):
    return {r.id: answer(r).values for r in fake_runs(count)}


def run_all(store, runner, count=20, engine=None, size=3):
    run_batches(store, in_batches(fake_runs(count), size), runner, engine or inline_engine())


def test_workers_order_and_batches_change_nothing(tmp_path):
    log = str(tmp_path / "log")
    go_on(tmp_path / "one", 50, 1, log, 0.0)
    reference = (tmp_path / "one" / "results.parquet").read_bytes()
    for k, size in enumerate((1, 4, 50)):
        store = Store(tmp_path / f"s{k}")
        store.create()
        runs = fake_runs(50)
        random.Random(k).shuffle(runs)
        run_batches(store, in_batches(runs, size), FakeRunner(log), inline_engine())
        store.compact()
        assert store.compacted.read_bytes() == reference
    go_on(tmp_path / "two", 50, 2, log, 0.0)
    assert (tmp_path / "two" / "results.parquet").read_bytes() == reference


def test_progress_counts_every_run(store, tmp_path):
    told = []
    batches = in_batches(fake_runs(10), 4)
    run_batches(store, batches, FakeRunner(str(tmp_path / "log")), inline_engine(), told.append)
    assert sum(told) == 10
    assert max(told) == 1  # in this process after each run


def test_the_window_bounds_what_is_submitted(store, tmp_path):
    waiting, most, lock = 0, 0, threading.Lock()

    class Watched(ThreadPoolExecutor):
        def submit(self, *args, **kwargs):
            nonlocal waiting, most
            with lock:
                waiting += 1
                most = max(most, waiting)
            future = super().submit(*args, **kwargs)
            future.add_done_callback(done)
            return future

    def done(_):
        nonlocal waiting
        with lock:
            waiting -= 1

    @contextmanager
    def opened():
        with Watched(2) as pool:
            yield pool

    runner = FakeRunner(str(tmp_path / "log"), 0.001)
    run_all(store, runner, 40, Engine("threads", opened, window=5), size=1)
    assert store.finished() == expected(40)
    assert 2 <= most <= 5


class Breaks:
    """Fails on one run, the first ``times`` times."""

    def __init__(self, bad, times):
        self.bad, self.times = bad, times

    def __call__(self, runs):
        for run in runs:
            if run.id == self.bad and self.times:
                self.times -= 1
                raise ZeroDivisionError("a bug")
            yield answer(run)


def test_a_passing_error_is_tried_again(store):
    run_all(store, Breaks(fake_runs(5)[4].id, 2))
    assert store.finished() == expected(20)
    assert not list(store.started.iterdir())


def test_a_lasting_error_keeps_all_other_runs(store):
    bad = fake_runs(5)[4].id
    with pytest.raises(SweepError) as caught:
        run_all(store, Breaks(bad, 99))
    assert "1 batches (3 runs) failed 3 times; the first: ZeroDivisionError: a bug" in str(
        caught.value
    )
    assert caught.value.exit_code == 1
    assert "ZeroDivisionError" in (store.folder / "errors.txt").read_text()
    assert len(store.finished()) == 18  # the one before it in its batch is kept too
    assert bad not in store.finished()


def test_runners_that_leave_out_or_invent_are_found(store):
    missing = fake_runs(3)[0]
    with pytest.raises(SweepError, match="the runner left out 1 of 1 runs"):
        run_all(store, lambda runs: [answer(r) for r in runs if r != missing], 3)
    with pytest.raises(SweepError, match="returned run ff, which is not wanted"):
        run_all(store, lambda runs: [answer(FakeRun("ff"))], 3)


def test_input_errors_stop_at_once(store):
    def refuses(runs):
        raise InputError("no body")

    with pytest.raises(InputError, match="no body"):
        run_all(store, refuses)


def test_ctrl_c_keeps_what_is_finished(store):
    def stopped(runs):
        for run in runs:
            if run.id == fake_runs(9)[8].id:
                raise KeyboardInterrupt
            yield answer(run)

    with pytest.raises(KeyboardInterrupt):
        run_all(store, stopped)
    assert len(store.finished()) == 8


def test_ctrl_c_ends_the_processes(store, tmp_path):
    before = set(multiprocessing.active_children())

    def interrupt(count):
        if count:
            raise KeyboardInterrupt

    runner = FakeRunner(str(tmp_path / "log"), 0.05)
    with pytest.raises(KeyboardInterrupt):
        run_batches(store, in_batches(fake_runs(400), 10), runner, process_engine(2), interrupt)
    assert set(multiprocessing.active_children()) == before
    assert 0 < len(store.finished()) < 400


def test_a_batch_over_which_a_worker_died_goes_on_where_it_was(store, tmp_path):
    runs = tuple(fake_runs(6))
    with pytest.raises(ZeroDivisionError):
        work(str(store.folder), runs, Breaks(runs[4].id, 1), "a")
    assert (store.started / batch_name(runs)).exists()
    log = tmp_path / "log"
    assert work(str(store.folder), runs, FakeRunner(str(log)), "a") == 2
    assert log.read_text().split() == [r.id for r in runs[4:]]
    assert store.finished() == expected(6)


def test_a_pool_that_always_breaks_ends(store):
    class Broken(ThreadPoolExecutor):
        def submit(self, fn, folder, batch, *rest, **kwargs):
            (store.started / batch_name(batch)).touch()

            def dies():
                raise BrokenExecutor

            return super().submit(dies)

    @contextmanager
    def opened():
        with Broken(1) as pool:
            yield pool

    with pytest.raises(SweepError, match="the worker was killed; out of memory"):
        run_all(store, None, 6, Engine("broken", opened, window=2))


def test_journals_of_two_drivers_are_two_files(store):
    """A Dask worker outlives a driver, which removes the journals when it ends."""
    runs = fake_runs(2)
    work(str(store.folder), runs[:1], FakeRunner("/dev/null"), "first")
    store.compact()
    work(str(store.folder), runs[1:], FakeRunner("/dev/null"), "second")
    assert store.finished() == expected(2)


def test_worker_that_does_not_see_the_store(tmp_path):
    with pytest.raises(InputError, match="all workers must see it"):
        work(str(tmp_path / "elsewhere"), fake_runs(1), FakeRunner("/dev/null"), "s")


def test_workers_below_one():
    with pytest.raises(ConfigError, match="0 workers"):
        process_engine(0)


class Cell(FakeRun):
    cell = "one"


@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_shards_are_a_partition(count):
    runs = [Cell(str(k)) for k in range(100)]
    parts = [Shard(i + 1, count).of(runs) for i in range(count)]
    assert sorted(r.id for part in parts for r in part) == sorted(r.id for r in runs)
    if count <= 25:
        assert max(map(len, parts)) <= 2 * min(map(len, parts))


@pytest.mark.parametrize("text", ["0/4", "5/4", "1/0", "a/b", "1", "1/4/2", "-1/4", ""])
def test_bad_shards(text):
    with pytest.raises(ConfigError, match="Allowed: i/n with 1 <= i <= n"):
        Shard.parse(text)
