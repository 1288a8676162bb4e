"""A real Dask cluster on this machine."""

import os
import signal
import sys
import threading
import time
from collections import Counter

import pytest
from light import FakeRunner, answer, fake_runs, in_batches

from unmodeled.core.errors import InputError
from unmodeled.pipeline.sweep.engine import run_batches
from unmodeled.pipeline.sweep.executors import dask_engine
from unmodeled.pipeline.sweep.store import Store

COUNT = 60
#: The cluster's own loop closes its sockets after pytest looks.
UNTIDY = ("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")


def test_dask_that_is_not_installed(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    store = Store(tmp_path)
    store.create()
    with pytest.raises(InputError, match=r"pip install 'unmodeled\[dask\]'"):
        run_batches(store, [tuple(fake_runs(1))], FakeRunner("/dev/null"), dask_engine("tcp://x:1"))


@pytest.mark.slow
@pytest.mark.filterwarnings(*UNTIDY)
def test_one_worker_killed_in_the_middle(tmp_path):
    distributed = pytest.importorskip("distributed")
    store = Store(tmp_path / "store")
    store.create()
    log = tmp_path / "log"
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    )
    with cluster, distributed.Client(cluster) as client:
        victim = sorted(client.run(os.getpid).values())[0]
        finished_at_kill = {}

        def kill():
            until = time.monotonic() + 60
            while len(store.finished()) < 10 and time.monotonic() < until:
                time.sleep(0.05)
            os.kill(victim, signal.SIGKILL)
            time.sleep(0.5)  # what was under way on the other worker counts as begun
            counts = Counter(log.read_text().split())
            finished_at_kill.update({name: counts[name] for name in store.finished()})

        killer = threading.Thread(target=kill)
        killer.start()
        engine = dask_engine(cluster.scheduler_address, window=6)
        run_batches(store, in_batches(fake_runs(COUNT), 5), FakeRunner(str(log), 0.1), engine)
        killer.join()
        assert victim not in client.run(os.getpid).values()
    assert store.finished() == {r.id: answer(r).values for r in fake_runs(COUNT)}
    counts = Counter(log.read_text().split())
    assert 10 <= len(finished_at_kill) < COUNT
    assert {name: counts[name] for name in finished_at_kill} == finished_at_kill
    assert sum(counts.values()) <= COUNT + 1  # the killed worker lost one run at most
    assert not list(store.started.iterdir())


@pytest.mark.slow
@pytest.mark.filterwarnings(*UNTIDY)
def test_no_scheduler(tmp_path):
    store = Store(tmp_path)
    store.create()
    engine = dask_engine("tcp://127.0.0.1:9")
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        run_batches(store, [tuple(fake_runs(1))], FakeRunner("/dev/null"), engine)
