"""Folders and files of results appear whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from unmodeled.core.errors import InputError

__all__ = ["check_run_folder", "new_files", "run_folder"]

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
    with _staging(target) as staging:
        yield staging
        if target.exists():
            old = target.with_name(f".{target.name}.{os.getpid()}.old")
            target.rename(old)
            staging.rename(target)
            shutil.rmtree(old)
        else:
            staging.rename(target)


@contextmanager
def new_files(target: Path) -> Iterator[Path]:
    """Give a staging folder whose files move into the target when the block ends without error.

    The target is made if it is missing; what it holds stays.

    Raises
    ------
    InputError
        If the target is a file, holds a file of the same name, or cannot be written, or if the
        disk is full.
    """
    if target.is_file():
        raise InputError(f"{target} is a file", allowed="a folder")
    with _staging(target) as staging:
        yield staging
        names = sorted(p.name for p in staging.iterdir())
        held = [n for n in names if (target / n).exists()]
        if held:
            raise InputError(f"{target} holds {', '.join(held)} already", do="name another folder")
        target.mkdir(exist_ok=True)
        for name in names:
            (staging / name).rename(target / name)


@contextmanager
def _staging(target: Path) -> Iterator[Path]:
    """Give a folder beside the target that is gone in the end; say in a sentence what fails."""
    staging = target.with_name(f".{target.name}.{os.getpid()}.partial")
    try:
        staging.mkdir(parents=True, exist_ok=False)
        yield staging
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise InputError(
                f"no space left while writing {target}", do="free space or choose another --out"
            ) from error
        if error.errno in (errno.EACCES, errno.EROFS, errno.EPERM, errno.ENOTDIR, errno.EEXIST):
            raise InputError(f"{target} cannot be written", do="choose another --out") from error
        raise
    finally:
        shutil.rmtree(staging, ignore_errors=True)
