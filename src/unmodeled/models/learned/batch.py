"""Training of one learner on many data sets in one call."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import torch

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.core.threads import one_thread
from unmodeled.models.learned.exact_gp import ExactGP
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.residual import Residual
from unmodeled.models.learned.spectral_mlp import SpectralMLP

__all__ = ["fit_batch", "stack_members"]

#: Most memory that the networks of one stack take, bytes; on a processor a small stack, whose
#: numbers stay near the core, is also the fastest.
_STACK_BYTES = {"cpu": 2e7, "cuda": 8e9}
#: Hyperparameters in which the members of one stack may differ.
_OWN = {"random_state"}

_Job = Callable[[Progress], list[NumericalError | None]]


def fit_batch(
    learner: Learner | Sequence[Learner],
    Xs: Sequence[Array],
    ys: Sequence[Array],
    noises: Sequence[NoiseLevel] | None = None,
    *,
    device: str = "cpu",
    threads: int = 1,
    progress: Progress | None = None,
) -> list[Learner | NumericalError]:
    """Fit a learner to each of many data sets.

    On a processor every member equals ``learner.fit`` on its data alone, to the last bit, in
    whatever batch and order and with any number of threads. On a graphics card the arithmetic is
    the same but sums are rounded in another order.

    Data sets of the same number of samples are trained side by side, in stacks of bounded memory;
    other numbers form their own stacks. `SpectralMLP` and `ExactGP` (also inside `Residual`) have
    stacks; every other learner has a fit in closed form and is fitted member by member.

    Parameters
    ----------
    learner : Learner, or a sequence of them (b)
        Unfitted; left so. A sequence gives each data set its own hyperparameters.
    Xs, ys : sequence (b) of ndarray (n_i, 3)
        Positions and accelerations of each data set, as `Learner.fit` takes them.
    noises : sequence (b) of NoiseLevel, optional
        Known noise of each.
    device : str
        ``cpu``, or ``cuda`` (``cuda:1``) where torch has one.
    threads : int
        Stacks trained at the same time on a processor.
    progress : callable, optional
        Told the share done.

    Returns
    -------
    list (b) of Learner or NumericalError
        Fitted copies in the order of the data; where a fit broke down, its error in that place.

    Raises
    ------
    DataError, ConfigError
        As `Learner.fit`, for the first data set concerned; unknown device; lengths that differ.
    """
    count = len(Xs)
    learners = [learner] * count if isinstance(learner, Learner) else list(learner)
    given = list(noises) if noises is not None else [NoiseLevel()] * count
    if not len(ys) == len(learners) == len(given) == count:
        raise DataError(
            f"a batch of {count} sets of positions, {len(ys)} of accelerations, {len(learners)} "
            f"learners and {len(given)} noise levels",
            allowed="one of each for every member",
        )
    if threads < 1:
        raise ConfigError(f"threads is {threads}", allowed="1 or more")
    place = _device(device)
    # Whole copies, so that no member shares an object with the learner that was given.
    members = [one._from_params(one._params_for_json()) for one in learners]
    data = [m._checked_samples(X, y, n) for m, X, y, n in zip(members, Xs, ys, given, strict=True)]
    cores = [_Core(m, *d, n) for m, d, n in zip(members, data, given, strict=True)]
    results: list[Learner | NumericalError] = list(members)
    groups: dict[tuple[str, tuple[int, ...]], list[int]] = {}
    for k, core in enumerate(cores):
        groups.setdefault(core.key, []).append(k)
    stacks = [s for g in groups.values() for s in _stacks(g, cores[g[0]], place, threads)]
    tell = _Shares(progress or (lambda share: None), count)

    def train(number: int) -> None:
        chosen = stacks[number]
        errors = _fit_stack([cores[k] for k in chosen], place, partial(tell, number, len(chosen)))
        for k, error in zip(chosen, errors, strict=True):
            if error is None:
                cores[k].finish()
                members[k].n_samples_, members[k].n_inputs_ = data[k][0].shape
            else:
                results[k] = error

    with one_thread():
        if threads == 1:
            for number in range(len(stacks)):
                train(number)
        else:
            # Each thread of torch has its own count of threads.
            start = partial(torch.set_num_threads, 1)
            with ThreadPoolExecutor(threads, initializer=start) as pool:
                list(pool.map(train, range(len(stacks))))
    tell.end()
    return results


def stack_members(learner: Learner, samples: int, device: str = "cpu") -> int:
    """Return how many data sets of one size `fit_batch` trains side by side at most.

    More of them in one call take no less time, and their fitted models more memory.

    Parameters
    ----------
    learner : Learner
        What is trained.
    samples : int
        Of each data set.
    device : str
        As in `fit_batch`.
    """
    while isinstance(learner, Residual):
        learner = learner.learner
    return _members(learner, samples, _device(device).type)


class _Core:
    """What is trained for one member: the learner itself, or the one inside a `Residual`."""

    def __init__(self, member: Learner, X: Array, y: Array, noise: NoiseLevel) -> None:
        self.learner, self.X, self.y, self.noise = member, X, y, noise
        self._shells: list[Residual] = []
        while isinstance(self.learner, Residual):
            self._shells.append(self.learner)
            self.y = self.learner._rest(self.X, self.y)
            self.noise = self.learner._rest_noise(self.X, self.noise)
            self.learner = self.learner._prepared()
            self.X, self.y = self.learner._checked_samples(self.X, self.y, noise)
        own = {k: v for k, v in self.learner.get_params().items() if k not in _OWN}
        self.key = (f"{type(self.learner).__name__} {own!r}", X.shape)

    def finish(self) -> None:
        """Put the fitted learner back where it belongs."""
        for shell in self._shells:
            shell.learner_.n_samples_, shell.learner_.n_inputs_ = self.X.shape


class _Shares:
    """Adds up the progress of stacks; what is told never falls."""

    def __init__(self, progress: Progress, count: int) -> None:
        self._progress, self._count = progress, count
        self._done: dict[int, float] = {}
        self._told = 0.0

    def __call__(self, number: int, members: int, share: float) -> None:
        self._done[number] = share * members
        total = min(1.0, sum(list(self._done.values())) / self._count)
        if total > self._told:
            self._told = total
            self._progress(total)

    def end(self) -> None:
        if self._told < 1.0:
            self._progress(1.0)


def _device(name: str) -> torch.device:
    try:
        place = torch.device(name)
    except RuntimeError as exc:
        raise ConfigError(f'device is "{name}"', allowed="cpu, cuda, cuda:<number>") from exc
    if place.type not in _STACK_BYTES:
        raise ConfigError(f'device is "{name}"', allowed="cpu, cuda, cuda:<number>")
    if place.type == "cuda" and (place.index or 0) >= torch.cuda.device_count():
        raise ConfigError(
            f'device is "{name}", and torch finds {torch.cuda.device_count()} graphics cards',
            do="use device cpu, or install torch for your card",
        )
    return place


def _stacks(group: list[int], core: _Core, device: torch.device, threads: int) -> list[list[int]]:
    """Cut the members of a group into stacks."""
    size = _members(core.learner, len(core.X), device.type)
    size = min(size, max(1, math.ceil(len(group) / threads)))
    return [group[k : k + size] for k in range(0, len(group), size)]


def _members(learner: Learner, samples: int, device: str) -> int:
    if isinstance(learner, SpectralMLP):
        width, layers = learner.width, learner.layers
        numbers = 2 * samples * width * layers + 8 * width * width * layers
        return max(1, int(_STACK_BYTES[device] / (8 * numbers)))
    if isinstance(learner, ExactGP) and device == "cuda":
        return max(1, int(_STACK_BYTES["cuda"] / (8 * samples**2)))
    return 1  # on a processor a stack of processes is no faster, and takes more memory


def _fit_stack(
    cores: list[_Core], device: torch.device, progress: Progress
) -> list[NumericalError | None]:
    X, y, noise = [c.X for c in cores], [c.y for c in cores], [c.noise for c in cores]
    first = cores[0].learner
    try:
        if isinstance(first, SpectralMLP):
            networks = [c.learner for c in cores if isinstance(c.learner, SpectralMLP)]
            return SpectralMLP._fit_stack(networks, X, y, noise, device, progress)
        if isinstance(first, ExactGP):
            processes = [c.learner for c in cores if isinstance(c.learner, ExactGP)]
            return ExactGP._fit_stack(processes, X, y, noise, device, progress)
        first._fit(X[0], y[0], noise[0], progress)
    except NumericalError as error:  # of a stack of one
        return [error]
    return [None]
