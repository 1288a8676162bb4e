"""The command line: parse, call, print. Nothing is only here."""

from __future__ import annotations

import os
import sys
import warnings

# One BLAS thread: learners work on many small problems, where more threads only get in each
# other's way. Must be set before numpy and torch load; a user's own setting wins.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from unmodeled.cli import (  # noqa: E402, F401
    cases,
    characterize,
    lists,
    navigate,
    report,
    select,
    simulate,
    sweep,
)
from unmodeled.cli.tools import app, errors, show_warning  # noqa: E402
from unmodeled.core.errors import UnmodeledError  # noqa: E402

__all__ = ["app", "main"]


def main() -> None:
    """Run the command line: exit code 2 and one sentence for bad input, never a traceback."""
    warnings.showwarning = show_warning
    try:
        app()
    except UnmodeledError as error:
        errors.print(f"error: {error}", style="bold red", markup=False, soft_wrap=True)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        sys.exit(0)
