"""kill -9 at random moments: nothing finished is lost or computed again."""

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import psutil
import pytest

from unmodeled.pipeline.sweep.store import Store

LIGHT = Path(__file__).with_name("light.py")
COUNT = 400


def start(folder, log, workers=1, seconds=0.004, count=COUNT):
    return subprocess.Popen(
        [sys.executable, str(LIGHT), str(folder), str(count), str(workers), str(log), str(seconds)],
        stdout=subprocess.DEVNULL,
    )


def begun(log):
    return Counter(log.read_text().split()) if log.exists() else Counter()


def wait_for_work(log, before, process):
    """Until the process has begun a run, so that a kill hits work and not the start only."""
    until = time.monotonic() + 60
    while begun(log) == before and process.poll() is None and time.monotonic() < until:
        time.sleep(0.002)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "store"
    assert start(folder, folder.with_name("log"), seconds=0.0).wait(120) == 0
    return (folder / "results.parquet").read_bytes()


def test_twenty_kills_lose_nothing_and_repeat_nothing(tmp_path, uninterrupted):
    """Moments are drawn over the whole life of the process: start, work, compaction."""
    folder, log = tmp_path / "store", tmp_path / "log"
    moments = random.Random(4)
    kills = 0
    seen = {}  # how often each run had been begun when it was first seen to be finished
    for k in range(20):
        process = start(folder, log)
        if k % 5:  # one in five anywhere in the start
            wait_for_work(log, begun(log), process)
        time.sleep(moments.uniform(0.0, 0.12))
        process.send_signal(signal.SIGKILL)
        kills += process.wait(60) == -signal.SIGKILL
        finished = Store(folder).finished() if folder.exists() else {}
        assert set(seen) <= set(finished)
        counts = begun(log)
        seen |= {name: counts[name] for name in finished if name not in seen}
    assert kills >= 15  # it must not have been over before the kills
    assert start(folder, log).wait(120) == 0
    assert (folder / "results.parquet").read_bytes() == uninterrupted
    assert not list((folder / "journal").iterdir())
    counts = begun(log)
    assert {name: counts[name] for name in seen} == seen
    assert sum(counts.values()) <= COUNT + 20  # each kill costs one run at most


def test_workers_die_with_their_killed_parent(tmp_path, uninterrupted):
    folder, log = tmp_path / "store", tmp_path / "log"
    process = start(folder, log, workers=2, seconds=0.05)
    wait_for_work(log, Counter(), process)
    children = psutil.Process(process.pid).children(recursive=True)
    assert len(children) >= 2
    process.send_signal(signal.SIGKILL)
    process.wait(60)
    _, alive = psutil.wait_procs(children, timeout=20)
    assert not alive
    finished = Store(folder).finished()
    counts = {name: begun(log)[name] for name in finished}
    assert start(folder, log, workers=2, seconds=0.0).wait(120) == 0
    assert {name: begun(log)[name] for name in finished} == counts
    assert (folder / "results.parquet").read_bytes() == uninterrupted


def test_a_killed_worker_is_replaced(tmp_path, uninterrupted):
    folder, log = tmp_path / "store", tmp_path / "log"
    process = start(folder, log, workers=2, seconds=0.01)
    wait_for_work(log, Counter(), process)
    workers = [
        p for p in psutil.Process(process.pid).children() if "spawn_main" in " ".join(p.cmdline())
    ]
    os.kill(workers[0].pid, signal.SIGKILL)
    assert process.wait(120) == 0
    assert (folder / "results.parquet").read_bytes() == uninterrupted
    assert sum(begun(log).values()) <= COUNT + 2  # each of the two workers lost one run at most
