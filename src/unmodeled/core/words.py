"""Words of sentences that several layers write."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["listed"]


def listed(parts: Sequence[str]) -> str:
    """Return a list as a sentence has it.

    Examples
    --------
    >>> listed(["a"]), listed(["a", "b"]), listed(["a", "b", "c"])
    ('a', 'a and b', 'a, b and c')
    """
    *first, last = parts
    return f"{', '.join(first)} and {last}" if first else last
