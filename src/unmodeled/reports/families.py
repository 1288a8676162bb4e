"""One colour for each family of effects, the same in every figure and table."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

__all__ = ["FAMILY_COLOURS", "family_colour"]

# Okabe & Ito (2008) and Tol's "muted", as for the learners: safe for colour-vision deficiencies.
FAMILY_COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "gravity": "#0072B2",
        "third body": "#56B4E9",
        "radiation": "#E69F00",
        "atmosphere": "#009E73",
        "relativity": "#882255",
        "propulsion": "#D55E00",
        "non-gravitational": "#CC79A7",
        "instrument": "#4B5563",
    }
)
_OTHER = "#8A8A2B"


def family_colour(family: str) -> str:
    """Return the colour of a family of effects.

    Examples
    --------
    >>> family_colour("gravity")
    '#0072B2'
    """
    return FAMILY_COLOURS.get(family, _OTHER)
