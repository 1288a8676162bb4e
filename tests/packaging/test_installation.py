"""Only `unmodeled` is installed, whole, and running from the root makes no second copy."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GENERIC = ("models", "datasets", "pipeline", "reports")
#: .ci/run names the interpreter of an empty environment with only the wheel; else this one.
PYTHON = os.environ.get("UNMODELED_EMPTY_PYTHON", sys.executable)


def python(code, cwd):
    return subprocess.run(
        [PYTHON, "-c", code], cwd=cwd, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("name", GENERIC)
def test_generic_names_do_not_resolve_from_an_empty_folder(name, tmp_path):
    code = f"import importlib.util as u; print(u.find_spec({name!r}))"
    assert python(code, tmp_path).stdout.strip() == "None"


def test_every_module_and_data_file_is_installed(tmp_path):
    wanted = {
        str(p.relative_to(ROOT / "src"))
        for p in (ROOT / "src" / "unmodeled").rglob("*")
        if p.is_file() and "__pycache__" not in p.parts
    }
    code = (
        "import unmodeled, pathlib; r = pathlib.Path(unmodeled.__file__).parent;"
        "print('\\n'.join(str(p.relative_to(r.parent)) for p in r.rglob('*') if p.is_file()))"
    )
    done = python(code, tmp_path)
    assert done.returncode == 0, done.stderr
    missing = wanted - set(done.stdout.split())
    assert not missing


def test_running_from_the_root_makes_no_second_copy_of_a_class():
    """The links at the root are for browsing: the package never imports through them."""
    code = (
        "import unmodeled, sys; from unmodeled.models.learned import Learner;"
        "import unmodeled.pipeline.characterize, unmodeled.reports;"
        "print([m for m in sys.modules if m.split('.')[0] in"
        " ('models', 'datasets', 'pipeline', 'reports')])"
    )
    done = python(code, ROOT)
    assert done.stdout.strip() == "[]", done.stderr


@pytest.mark.parametrize("name", GENERIC)
def test_the_links_at_the_root_lead_into_the_package(name):
    link = ROOT / name
    if not link.is_symlink():
        pytest.skip("this checkout was made without symbolic links")
    assert link.resolve() == ROOT / "src" / "unmodeled" / name


def test_importing_the_package_loads_no_torch(tmp_path):
    code = "import unmodeled, unmodeled.cli, sys; print('torch' in sys.modules)"
    assert python(code, tmp_path).stdout.strip() == "False"


def test_public_names_resolve():
    import unmodeled

    for name in unmodeled.__all__:
        assert getattr(unmodeled, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        _ = unmodeled.nonsense
