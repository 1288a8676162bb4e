"""YAML 1.2 files: ``1e-2`` is a number, ``no`` is a word, a key given twice is an error."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from unmodeled.core.errors import ConfigError

__all__ = ["parse_scalar", "read_yaml", "write_yaml", "yaml_text"]


def read_yaml(path: Path | str) -> dict[str, Any]:
    """Read a YAML file whose top level is a mapping.

    Raises
    ------
    ConfigError
        If the file is missing, empty, not text, or not YAML (with the line).
    """
    path = Path(path)
    try:
        content = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except FileNotFoundError as exc:
        raise ConfigError(f"no file {path}", do="give the path of a configuration file") from exc
    except (OSError, UnicodeDecodeError) as exc:
        raise ConfigError(f"{path} cannot be read ({exc})") from exc
    except MarkedYAMLError as exc:
        line = exc.problem_mark.line + 1 if exc.problem_mark else 0
        problem = (exc.problem or "not YAML").splitlines()[0]
        raise ConfigError(f"{path}, line {line}: {problem}", do="mend the YAML") from exc
    except (YAMLError, ValueError) as exc:  # ValueError: a date such as 2024-13-45
        raise ConfigError(f"{path} is not YAML ({str(exc).splitlines()[0]})") from exc
    if not isinstance(content, dict):
        kind = "empty" if content is None else f"a {type(content).__name__}"
        raise ConfigError(f"{path} is {kind}", allowed="a mapping of keys to values")
    return content


def write_yaml(content: dict[str, Any], path: Path | str) -> None:
    """Write plain data as YAML, keys in the order given."""
    Path(path).write_text(yaml_text(content), encoding="utf-8")


def yaml_text(content: dict[str, Any]) -> str:
    """Return plain data as YAML, keys in the order given."""
    yaml = YAML()  # the round-trip writer keeps the order of keys
    yaml.default_flow_style = False
    text = io.StringIO()
    yaml.dump(content, text)
    return text.getvalue()


def parse_scalar(text: str) -> Any:
    """Return one value as YAML 1.2 reads it: ``"1e-2"`` is 0.01, ``"a.csv"`` a word.

    Raises
    ------
    ConfigError
        If it is not YAML.

    Examples
    --------
    >>> parse_scalar("1e-2"), parse_scalar("[1, 3]"), parse_scalar("no")
    (0.01, [1, 3], 'no')
    """
    try:
        return YAML(typ="safe", pure=True).load(text)
    except (YAMLError, ValueError) as exc:
        raise ConfigError(f'"{text}" is not a YAML value') from exc
