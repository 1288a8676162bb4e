import errno

import pytest

from unmodeled.core.errors import InputError
from unmodeled.pipeline.run_folder import run_folder


def finish(target, text):
    with run_folder(target) as staging:
        (staging / "provenance.json").write_text(text)


def stop_half_way(target, stop):
    with run_folder(target) as staging:
        (staging / "provenance.json").write_text("half")
        raise stop


def test_appears_whole_and_is_replaced_whole(tmp_path):
    target = tmp_path / "runs" / "a"
    finish(target, "first")
    with run_folder(target) as staging:
        (staging / "provenance.json").write_text("second")
        assert (target / "provenance.json").read_text() == "first"
    assert (target / "provenance.json").read_text() == "second"
    assert [p.name for p in target.parent.iterdir()] == ["a"]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, RuntimeError])
def test_an_interrupt_leaves_the_earlier_run(tmp_path, stop):
    target = tmp_path / "a"
    finish(target, "first")
    with pytest.raises(stop):
        stop_half_way(target, stop)
    assert (target / "provenance.json").read_text() == "first"
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (errno.ENOSPC, "no space left while writing .*a. Free space or choose another --out"),
        (errno.EACCES, "a cannot be written. Choose another --out"),
    ],
)
def test_a_full_or_closed_disk_is_said_in_one_sentence(tmp_path, number, text):
    target = tmp_path / "a"
    finish(target, "first")
    with pytest.raises(InputError, match=text), run_folder(target):
        raise OSError(number, "from the system")
    assert (target / "provenance.json").read_text() == "first"


def test_other_errors_of_the_system_pass_through(tmp_path):
    with pytest.raises(OSError, match="strange"), run_folder(tmp_path / "a"):
        raise OSError(errno.EIO, "strange")


def test_foreign_files_are_never_replaced(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="holds files that are not a run of unmodeled"):
        finish(tmp_path, "x")
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
