import datetime
import json
import re
from importlib import metadata

from unmodeled.core import provenance
from unmodeled.core.provenance import collect_provenance


def test_record():
    before = datetime.datetime.now(datetime.UTC).replace(microsecond=0)
    record = collect_provenance("abc", 7)
    after = datetime.datetime.now(datetime.UTC)
    assert (record.config_hash, record.seed) == ("abc", 7)
    assert record.versions["heyoka"] == metadata.version("heyoka")
    assert {"unmodeled", "torch", "numpy"} <= set(record.versions)
    assert record.processors >= 1
    assert before <= datetime.datetime.fromisoformat(record.finished) <= after
    assert re.fullmatch(r"([0-9a-f]{12}\+?)?", record.commit)


def test_it_is_plain_data():
    record = collect_provenance("abc", 7).as_dict()
    assert json.loads(json.dumps(record)) == record


def test_no_commit_outside_a_checkout(tmp_path, monkeypatch):
    # a folder without a repository, then an installed package
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path))
    (tmp_path / "package").mkdir()
    monkeypatch.setattr(provenance, "__file__", str(tmp_path / "package" / "x.py"))
    assert collect_provenance("", 0).commit == ""
    monkeypatch.setattr(provenance, "__file__", str(tmp_path / "site-packages" / "x.py"))
    assert collect_provenance("", 0).commit == ""


def test_no_commit_without_git(monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert collect_provenance("", 0).commit == ""
