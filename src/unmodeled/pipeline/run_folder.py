"""A run folder appears whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from unmodeled.core.errors import InputError

__all__ = ["check_run_folder", "run_folder"]

#: A folder that holds this file is a run folder and may be replaced by a new run.
_MARK = "provenance.json"


def check_run_folder(target: Path) -> None:
    """Refuse a target that is a file, or a folder with something else in it.

    Raises
    ------
    InputError
        Before any work is done.
    """
    if target.is_file():
        raise InputError(f"{target} is a file", allowed="a folder for the results")
    if target.is_dir() and any(target.iterdir()) and not (target / _MARK).exists():
        raise InputError(
            f"{target} holds files that are not a run of unmodeled",
            do="choose another --out, or empty it",
        )


@contextmanager
def run_folder(target: Path) -> Iterator[Path]:
    """Give a staging folder that takes the target's place when the block ends without error.

    An interrupt, a full disk or an error leaves an earlier run in ``target`` as it was.

    Raises
    ------
    InputError
        If the target cannot be used, or the disk is full.
    """
    check_run_folder(target)
    staging = target.with_name(f".{target.name}.{os.getpid()}.partial")
    try:
        staging.mkdir(parents=True, exist_ok=False)
        yield staging
        if target.exists():
            old = target.with_name(f".{target.name}.{os.getpid()}.old")
            target.rename(old)
            staging.rename(target)
            shutil.rmtree(old)
        else:
            staging.rename(target)
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise InputError(
                f"no space left while writing {target}", do="free space or choose another --out"
            ) from error
        if error.errno in (errno.EACCES, errno.EROFS, errno.EPERM):
            raise InputError(f"{target} cannot be written", do="choose another --out") from error
        raise
    finally:
        shutil.rmtree(staging, ignore_errors=True)
