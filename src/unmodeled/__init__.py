"""What does my force model lack, and can I trust what I learned about it?

The same names as on the command line, as plain functions on plain data:

>>> import unmodeled as um
>>> sorted(um.body_names())
['bennu', 'earth', 'eros', 'mars', 'moon']
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from unmodeled.datasets.bodies import Body, body_names, load_body
    from unmodeled.datasets.readers import read_trajectory
    from unmodeled.datasets.trajectory import Trajectory
    from unmodeled.pipeline.characterize import characterize
    from unmodeled.pipeline.config import CharacterizationConfig, load_config
    from unmodeled.pipeline.learned_field import LearnedField
    from unmodeled.pipeline.results import CharacterizationResult
    from unmodeled.reports import write_report

__all__ = [
    "Body",
    "CharacterizationConfig",
    "CharacterizationResult",
    "LearnedField",
    "Trajectory",
    "body_names",
    "characterize",
    "load_body",
    "load_config",
    "read_trajectory",
    "write_report",
]

_HOME = {
    "Body": "datasets.bodies",
    "body_names": "datasets.bodies",
    "load_body": "datasets.bodies",
    "read_trajectory": "datasets.readers",
    "Trajectory": "datasets.trajectory",
    "characterize": "pipeline.characterize",
    "CharacterizationConfig": "pipeline.config",
    "load_config": "pipeline.config",
    "LearnedField": "pipeline.learned_field",
    "CharacterizationResult": "pipeline.results",
    "write_report": "reports",
}


def __getattr__(name: str) -> Any:
    """Import on first use: torch alone takes seconds, and a name may not need it."""
    if name not in _HOME:
        raise AttributeError(f"module 'unmodeled' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"unmodeled.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
