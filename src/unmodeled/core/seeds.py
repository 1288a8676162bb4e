"""One seed, many named and independent random streams.

A stream depends on the seed and on its own name only: drawing more from one, or adding another,
changes nothing elsewhere.  That is what makes a run the same in any batch and on any worker.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from unmodeled.core.errors import ConfigError

__all__ = ["Streams"]


@dataclass(frozen=True, slots=True)
class Streams:
    """Named random streams of one seed.

    Parameters
    ----------
    seed : int
        Non-negative.

    Examples
    --------
    >>> a = Streams(1).generator("noise.state").normal()
    >>> b = Streams(1).generator("noise.state").normal()
    >>> a == b, a == Streams(1).generator("noise.acceleration").normal()
    (True, False)
    """

    seed: int

    def __post_init__(self) -> None:
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise ConfigError(f"seed is {self.seed!r}", allowed="an integer >= 0")

    def _sequence(self, name: str) -> np.random.SeedSequence:
        digest = hashlib.sha256(name.encode()).digest()
        words = np.frombuffer(digest[:16], dtype="<u4")
        return np.random.SeedSequence(self.seed, spawn_key=tuple(int(w) for w in words))

    def generator(self, name: str) -> np.random.Generator:
        """Return a fresh generator at the start of the named stream."""
        return np.random.Generator(np.random.PCG64(self._sequence(name)))

    def integer(self, name: str) -> int:
        """Return a 32-bit seed for a library that takes one, such as torch."""
        return int(self._sequence(name).generate_state(1)[0])
