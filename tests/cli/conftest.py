"""A simulated case with a hidden effect, and commands that must be refused."""

from __future__ import annotations

import shutil
import sys

import pytest
from tests.cli.commands import call

from unmodeled import cli

#: Few candidates: the commands are tested here, not the search.
FEW = "candidates: [zonal_5, srp, constant_radial]\n"


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Return the folder of a case with a hidden effect, made by the command."""
    folder = tmp_path_factory.mktemp("cases") / "hidden"
    words = ["simulate", "bennu", "--hide", "srp=1000", "--seed", "1", "--held-out", "--out"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["unmodeled", *words, str(folder)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
    assert stop.value.code in (0, None)
    path = folder / "case.yaml"
    path.write_text(FEW + path.read_text())
    return folder


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys, simulated):
    """Run a command that must be refused; return the sentence."""
    shutil.copytree(simulated, tmp_path / "hidden")
    monkeypatch.chdir(tmp_path)

    def fail(*arguments):
        made = sorted(p.name for p in tmp_path.rglob("*"))
        code, out, err = call(monkeypatch, capsys, *arguments)
        assert code == 2
        assert out == ""
        assert err.startswith("error: ")
        assert sorted(p.name for p in tmp_path.rglob("*")) == made  # nothing was written
        return err

    return fail
