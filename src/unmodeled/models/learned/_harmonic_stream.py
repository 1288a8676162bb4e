"""Samples of a harmonic fit, block by block: held in memory, or as they come."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError
from unmodeled.models.learned._harmonic_field import CHUNK
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["Block", "blocks_of", "blocks_of_stream"]

#: Positions (n, 3), accelerations (n, 3) and their noise, n at most `CHUNK`.
Block = tuple[Array, Array, NoiseLevel]


def blocks_of(X: Array, y: Array, noise: NoiseLevel) -> Iterator[Block]:
    """Cut samples in memory."""
    for k in range(0, len(X), CHUNK):
        part = slice(k, k + CHUNK)
        own = noise.samples if noise.samples is None else noise.samples[part]
        gradient = noise.gradient if noise.gradient is None else noise.gradient[part]
        yield X[part], y[part], replace(noise, samples=own, gradient=gradient)


def blocks_of_stream(
    learner: str, chunks: Iterable[Sequence[Array]], noise: NoiseLevel
) -> Iterator[Block]:
    """Check chunks of any sizes and cut them as `blocks_of` would cut all of them together.

    Sums of the same blocks are the same to the last bit.

    Parameters
    ----------
    learner : str
        Name for messages.
    chunks : iterable of (X, y) or (X, y, deviations)
        See `HarmonicGP.fit_stream`.
    noise : NoiseLevel
        Common to all.
    """
    held: list[Array] = []
    count, columns = 0, 0
    for k, chunk in enumerate(chunks):
        rows = _checked(learner, k, chunk)
        if columns and rows.shape[1] != columns:
            raise DataError(
                f"{learner}: chunk {k} comes with{'' if rows.shape[1] > 6 else 'out'} noise of its "
                "samples, and those before do not agree",
                allowed="noise with every chunk, or with none",
            )
        columns = rows.shape[1]
        held.append(rows)
        count += len(rows)
        while count >= CHUNK:
            together = np.concatenate(held)
            yield _block(together[:CHUNK], noise)
            held = [together[CHUNK:]]
            count -= CHUNK
    if count:
        yield _block(np.concatenate(held), noise)


def _checked(learner: str, k: int, chunk: Sequence[Array]) -> Array:
    """Return the samples of a chunk side by side, (n, 6) or (n, 9)."""
    if not 2 <= len(chunk) <= 3:
        raise DataError(
            f"{learner}: chunk {k} has {len(chunk)} parts",
            allowed="(positions, accelerations) or (positions, accelerations, deviations)",
        )
    X = as_array(chunk[0], ("n", 3), f"X of chunk {k}")
    y = as_array(chunk[1], ("n", 3), f"y of chunk {k}")
    if len(X) != len(y):
        raise DataError(
            f"X of chunk {k} has {len(X)} samples and y has {len(y)}",
            allowed="one acceleration a position",
        )
    if len(chunk) == 2:
        return np.concatenate([X, y], axis=1)
    deviations = as_array(chunk[2], ("n", 3), f"deviations of chunk {k}")
    if len(deviations) != len(X):
        raise DataError(
            f"X of chunk {k} has {len(X)} samples and their noise has {len(deviations)}",
            allowed="a noise level for each sample",
        )
    return np.concatenate([X, y, deviations], axis=1)


def _block(rows: Array, noise: NoiseLevel) -> Block:
    own = replace(noise, samples=rows[:, 6:]) if rows.shape[1] > 6 else noise
    # Copies in C order, as samples in memory are: products of another layout differ.
    return rows[:, :3].copy(), rows[:, 3:6].copy(), own
