"""How tests call the command line."""

from __future__ import annotations

import sys

import pytest

from unmodeled import cli


def call(monkeypatch, capsys, *arguments):
    """Run the command line; return exit code, stdout, stderr in one line."""
    monkeypatch.setattr(sys, "argv", ["unmodeled", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    shown = capsys.readouterr()
    assert "Traceback" not in shown.err + shown.out
    return stop.value.code or 0, shown.out, " ".join(shown.err.split())
