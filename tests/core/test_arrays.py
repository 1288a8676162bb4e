import numpy as np
import pytest

from unmodeled.core.arrays import as_array, check_increasing
from unmodeled.core.errors import DataError


def text_of(function, *arguments):
    with pytest.raises(DataError) as caught:
        function(*arguments)
    return str(caught.value)


def test_conversion():
    out = as_array([[1, 2, 3], [4, 5, 6]], ("n", 3), "x")
    assert out.dtype == np.float64
    assert out.flags.c_contiguous
    turned = as_array(np.arange(6.0).reshape(3, 2).T, (2, 3), "x")
    assert turned.flags.c_contiguous
    assert np.array_equal(turned, [[0, 2, 4], [1, 3, 5]])
    assert as_array(4, (), "x").shape == ()
    assert as_array([], ("n",), "x").shape == (0,)


def test_no_copy_where_none_is_needed():
    x = np.ones((4, 3))
    assert as_array(x, ("n", 3), "x") is x


def test_same_letter_same_size():
    assert as_array(np.eye(3), ("n", "n"), "x").shape == (3, 3)
    assert (
        text_of(as_array, np.ones((2, 3)), ("n", "n"), "x")
        == "x has shape (2, 3). Allowed: shape (n, n)."
    )


@pytest.mark.parametrize(
    ("values", "shape", "text"),
    [
        ([1, 2], (3,), "v has shape (2,). Allowed: shape (3,)."),
        ([[1, 2]], ("n",), "v has shape (1, 2). Allowed: shape (n,)."),
        (1.0, ("n",), "v has shape (). Allowed: shape (n,)."),
        ([1.0], (), "v has shape (1,). Allowed: shape ()."),
        (
            [[1, 2, 3], [4, np.nan, np.inf]],
            ("n", 3),
            "v has 2 value(s) that are not finite, the first (nan) at index (1, 1). "
            "Allowed: finite numbers. Remove or repair these samples.",
        ),
        (
            -np.inf,
            (),
            "v has 1 value(s) that are not finite, the first (-inf) at index (). "
            "Allowed: finite numbers. Remove or repair these samples.",
        ),
        (
            [1j],
            ("n",),
            "v cannot be read as numbers (complex numbers). "
            "Allowed: a numeric array of shape (n,).",
        ),
        (
            ["a"],
            ("n",),
            "v cannot be read as numbers (could not convert string to float: 'a'). "
            "Allowed: a numeric array of shape (n,).",
        ),
    ],
)
def test_refusals(values, shape, text):
    assert text_of(as_array, values, shape, "v") == text


def test_ragged_rows_are_refused():
    assert "v cannot be read as numbers" in text_of(as_array, [[1, 2], [3]], ("n", 2), "v")


def test_increasing_times_pass():
    for times in ([], [5.0], [-1.0, 0.0, 1e-9]):
        check_increasing(np.array(times), "t")


@pytest.mark.parametrize(
    ("times", "text"),
    [
        ([0, 1, 1, 2], "t repeats at sample 2: 1.000000 s is followed by 1.000000 s."),
        ([0, 2, 1, 1], "t goes back at sample 2: 2.000000 s is followed by 1.000000 s."),
    ],
)
def test_times_that_do_not_increase(times, text):
    rest = " Allowed: strictly increasing times. Sort the samples and remove duplicates."
    assert text_of(check_increasing, np.array(times, dtype=float), "t") == text + rest
