"""The provenance record that goes with every run folder."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

__all__ = ["Provenance", "collect_provenance"]

_PACKAGES = ("unmodeled", "heyoka", "torch", "gpytorch", "numpy", "scipy", "pandas", "astropy")


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a result comes from.

    Parameters
    ----------
    config_hash : str
        SHA-256 of the resolved configuration.
    seed : int
        The run's seed.
    versions : dict
        Versions of the packages that make the numbers.
    commit : str
        Git commit of the source tree, with ``+`` if it had changes; empty outside a checkout.
    python, system, processors, host, finished : str, str, int, str, str
        Interpreter, operating system, usable processors, host name, end of the run in UTC.
    """

    config_hash: str
    seed: int
    versions: dict[str, str]
    commit: str
    python: str
    system: str
    processors: int
    host: str
    finished: str

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return asdict(self)


def collect_provenance(config_hash: str, seed: int) -> Provenance:
    """Record versions, host and time, now."""
    return Provenance(
        config_hash=config_hash,
        seed=seed,
        versions={name: metadata.version(name) for name in _PACKAGES},
        commit=_commit(),
        python=platform.python_version(),
        system=f"{platform.system()} {platform.machine()}",
        processors=_processors(),
        host=platform.node(),
        finished=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    )


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _commit() -> str:
    """Commit of the checkout that this file lies in; empty for an installed package."""
    here = Path(__file__).resolve()
    if "site-packages" in here.parts:
        return ""

    def git(*words: str) -> str:
        return subprocess.run(
            ["git", "-C", str(here.parent), *words], capture_output=True, text=True, check=True
        ).stdout.strip()

    try:
        return git("rev-parse", "--short=12", "HEAD") + (
            "+" if git("status", "--porcelain", "--untracked-files=no") else ""
        )
    except (OSError, subprocess.CalledProcessError):
        return ""
