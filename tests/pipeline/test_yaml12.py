import math

import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.yaml12 import parse_scalar, read_yaml, write_yaml


def file(tmp_path, text):
    path = tmp_path / "a.yaml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-2", 0.01),
        ("1E5", 1e5),
        ("-1.5e+3", -1500.0),
        ("12", 12),
        ("0x10", 16),
        ("0o17", 15),
        ("017", 17),  # YAML 1.1 reads an octal 15
        ("no", "no"),
        ("off", "off"),
        ("on", "on"),
        ("y", "y"),
        ("true", True),
        ("12:30:45", "12:30:45"),  # YAML 1.1 reads 45045
        (".inf", math.inf),
        ("null", None),
        ("", None),
        ("a.csv", "a.csv"),
        ("[1, 2.5]", [1, 2.5]),
        ("{a: 1}", {"a": 1}),
    ],
)
def test_scalars(text, value):
    read = parse_scalar(text)
    assert read == value
    assert type(read) is type(value)


def test_read(tmp_path):
    path = file(tmp_path, "a: 1e-3\nb: {c: no}  # µ\n")
    assert read_yaml(path) == read_yaml(str(path)) == {"a": 1e-3, "b": {"c": "no"}}


def test_written_is_read_and_keeps_its_order(tmp_path):
    content = {"z": 1e-300, "a": {"y": [1, 2.5, None], "b": "no"}, "t": "1e-2", "µ": "1"}
    path = tmp_path / "a.yaml"
    write_yaml(content, path)
    assert read_yaml(path) == content
    assert list(read_yaml(path)) == list(content)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3\n", 'line 3: found duplicate key "a" with value "3" (original value'),
        ("a:\n  b: 1\n  b: 2\n", 'line 3: found duplicate key "b"'),
        ("a: [1, 2\n", "line 2: "),
        ("a: 1\n b: 2\n", "line 2: mapping values are not allowed"),
        ("a: !!python/object/apply:os.system [ls]\n", "could not determine a constructor"),
        ("", "is empty. Allowed: a mapping of keys to values."),
        ("# only a comment\n", "is empty. Allowed: a mapping of keys to values."),
        ("- 1\n", "is a list. Allowed: a mapping of keys to values."),
        ("word", "is a str. Allowed: a mapping of keys to values."),
        ("a: 2024-13-45\n", "is not YAML (month must be in 1..12)."),
        ("a: !!int x\n", "is not YAML (invalid literal for int()"),
        (b"\xff\xfe\x00", "cannot be read ("),
        ("a: \x01\n", "is not YAML ("),
    ],
)
def test_files_that_are_refused(tmp_path, text, message):
    path = file(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        read_yaml(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(ConfigError) as caught:
        read_yaml(tmp_path / "b.yaml")
    assert str(caught.value) == (
        f"no file {tmp_path / 'b.yaml'}. Give the path of a configuration file."
    )
    with pytest.raises(ConfigError, match="cannot be read"):
        read_yaml(tmp_path)


@pytest.mark.parametrize("text", ["a: b: c", "[1", "2024-13-45", "{a: 1, a: 2}", "\x01"])
def test_values_that_are_refused(text):
    with pytest.raises(ConfigError) as caught:
        parse_scalar(text)
    assert str(caught.value) == f'"{text}" is not a YAML value.'
