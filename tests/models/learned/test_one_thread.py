"""A fit holds one thread: it is the same on every machine, and the same as in a batch."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import numpy as np
import torch  # before the pools are asked
from threadpoolctl import threadpool_info

from unmodeled.models.learned import fit_batch, learner_class

def pools():
    return max(p["num_threads"] for p in threadpool_info()), torch.get_num_threads()

seen = []

class Watching(learner_class("harmonic_least_squares")):
    def _fit(self, X, y, noise, progress):
        seen.append(pools())
        super()._fit(X, y, noise, progress)

rng = np.random.default_rng(0)
x = rng.normal(size=(300, 3))
x *= (1.5 + rng.uniform(size=(300, 1))) / np.linalg.norm(x, axis=1, keepdims=True)
y = -x / np.linalg.norm(x, axis=1, keepdims=True) ** 3 + 1e-4 * rng.normal(size=(300, 3))
before = pools()
alone = Watching().fit(x, y)
assert before == (2, 2), before
assert seen == [(1, 1)], seen
assert pools() == before, pools()
for name in ("harmonic_least_squares", "curl_free_gp"):
    learner = learner_class(name)()
    together = fit_batch(learner, [x[:60]], [y[:60]])[0]
    alone = learner_class(name)().fit(x[:60], y[:60])
    np.testing.assert_array_equal(alone.predict(x), together.predict(x), err_msg=name)
print("same")
"""


@pytest.mark.slow
def test_a_fit_holds_one_thread_and_equals_the_batch():
    two = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "2")
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env={**os.environ, **two},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "same"
