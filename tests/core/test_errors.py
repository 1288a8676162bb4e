import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from unmodeled.core.errors import (
    ConfigError,
    DataError,
    InputError,
    NumericalError,
    OrbitError,
    UnmodeledError,
    UnmodeledWarning,
    nearest,
)


@pytest.mark.parametrize(
    ("found", "allowed", "do", "text"),
    [
        ("x is 3", "", "", "x is 3."),
        ("x is 3.", "", "", "x is 3."),
        ("x is 3", "x > 4", "", "x is 3. Allowed: x > 4."),
        ("x is 3", "", "raise x", "x is 3. Raise x."),
        ("x is 3", "x > 4.", "raise x.", "x is 3. Allowed: x > 4. Raise x."),
        ("no y", "", 'did you mean "x"?', 'no y. Did you mean "x"?'),
    ],
)
def test_sentence(found, allowed, do, text):
    error = UnmodeledError(found, allowed=allowed, do=do)
    assert str(error) == text
    assert (error.found, error.allowed, error.do) == (found, allowed, do)


@pytest.mark.parametrize("kind", [ConfigError, DataError, OrbitError])
def test_input_errors_exit_with_2(kind):
    assert issubclass(kind, InputError)
    assert kind.exit_code == 2


def test_other_exit_codes_and_bases():
    assert UnmodeledError.exit_code == 1
    assert NumericalError.exit_code == 3
    assert not issubclass(NumericalError, InputError)
    assert issubclass(UnmodeledWarning, UserWarning)


def test_nearest():
    known = ["bennu", "eros", "Mars"]
    assert nearest("benu", known) == 'did you mean "bennu"?'
    assert nearest("EROS", known) == 'did you mean "eros"?'
    assert nearest("mars", known) == 'did you mean "Mars"?'
    assert nearest("zzz", known) == "known: Mars, bennu, eros"
    assert nearest("gm", iter(["GM"])) == 'did you mean "GM"?'


@given(st.sets(st.text(string.ascii_letters, min_size=1, max_size=8), min_size=1, max_size=5))
def test_a_known_name_is_its_own_nearest(names):
    for name in names:
        suggestion = nearest(name, names)
        assert suggestion.casefold() == f'did you mean "{name}"?'.casefold()
