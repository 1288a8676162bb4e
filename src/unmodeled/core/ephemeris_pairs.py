"""Names of bodies in ephemerides and the check of a pair (body, centre)."""

from __future__ import annotations

from collections.abc import Collection

from unmodeled.core.errors import DataError, nearest

__all__ = ["PLANETS", "check_pair"]

#: Bodies of every ephemeris, from the Sun outwards.
PLANETS = (
    "sun",
    "mercury",
    "venus",
    "earth",
    "moon",
    "mars",
    "jupiter",
    "saturn",
    "uranus",
    "neptune",
)


def check_pair(body: str, centre: str, known: Collection[str], source: str) -> tuple[str, str]:
    """Return both names in lower case.

    Raises
    ------
    DataError
        If a name is not in ``known``, or both are the same.
    """
    names = (body.lower(), centre.lower())
    for name in names:
        if name not in known:
            raise DataError(
                f'the ephemeris ({source}) has no body "{name}"',
                allowed=", ".join(known),
                do=nearest(name, known),
            )
    if names[0] == names[1]:
        raise DataError(
            f'"{names[0]}" is both body and centre', do="ask for a body relative to another one"
        )
    return names
