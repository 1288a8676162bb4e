"""The error hierarchy: every message says what was found, what is allowed, and what to do next.

``InputError`` and its children mean that the user can mend the input; the command line answers
them with exit code 2 and one sentence.  ``NumericalError`` means that a computation failed for
reasons that the input alone does not explain; exit code 3.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import ClassVar

__all__ = [
    "ConfigError",
    "DataError",
    "InputError",
    "NumericalError",
    "OrbitError",
    "UnmodeledError",
    "UnmodeledWarning",
    "nearest",
]


class UnmodeledError(Exception):
    """Base of all errors that this package raises on purpose.

    Parameters
    ----------
    found : str
        What was found, with the offending value.
    allowed : str, optional
        What would have been accepted.
    do : str, optional
        What to do next.
    """

    exit_code: ClassVar[int] = 1

    def __init__(self, found: str, *, allowed: str = "", do: str = "") -> None:
        self.found = found
        self.allowed = allowed
        self.do = do
        sentence = found.rstrip(".")
        if allowed:
            sentence += f". Allowed: {allowed.rstrip('.')}"
        if do:
            sentence += f". {do[0].upper()}{do[1:].rstrip('.')}"
        super().__init__(sentence if sentence.endswith("?") else sentence + ".")


class InputError(UnmodeledError):
    """The user can mend the input."""

    exit_code = 2


class ConfigError(InputError):
    """A configuration file or option is wrong."""


class DataError(InputError):
    """A measurement or trajectory file, or an array, is wrong."""


class OrbitError(InputError):
    """An orbit hits the body, is not bound, or cannot be propagated."""


class NumericalError(UnmodeledError):
    """A computation failed: a factorisation, an integration, a fit."""

    exit_code = 3


class UnmodeledWarning(UserWarning):
    """A result that can be used, but with care."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a hint that names the nearest known name, or lists all of them.

    Examples
    --------
    >>> nearest("benu", ["bennu", "eros"])
    'did you mean "bennu"?'
    >>> nearest("pluto", ["bennu", "eros"])
    'known: bennu, eros'
    """
    names = sorted(known)
    folded = {n.casefold(): n for n in names}
    close = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.6)
    if close:
        return f'did you mean "{folded[close[0]]}"?'
    return "known: " + ", ".join(names)
