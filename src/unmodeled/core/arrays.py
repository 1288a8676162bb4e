"""Shape, finiteness and order checks for arrays that come from outside."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from unmodeled.core.errors import DataError

__all__ = ["Array", "as_array", "check_increasing"]

Array: TypeAlias = npt.NDArray[np.float64]


def as_array(values: npt.ArrayLike, shape: tuple[int | str, ...], name: str) -> Array:
    """Return ``values`` as a finite float64 array of the wanted shape.

    Parameters
    ----------
    values : array_like
        What to check.
    shape : tuple of int or str
        Wanted sizes; a letter stands for any size, the same letter for the same size.
    name : str
        Name used in the error text.

    Returns
    -------
    ndarray of float64
        A C-ordered array; a copy only where one is needed.

    Raises
    ------
    DataError
        If the number of axes or a size differs, or a value is NaN or infinite.

    Examples
    --------
    >>> as_array([[1, 2, 3]], ("n", 3), "positions").shape
    (1, 3)
    """
    wanted = "(" + ", ".join(str(s) for s in shape) + ("," if len(shape) == 1 else "") + ")"
    try:
        if np.iscomplexobj(values):
            raise TypeError("complex numbers")
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as exc:
        raise DataError(
            f"{name} cannot be read as numbers ({exc})",
            allowed=f"a numeric array of shape {wanted}",
        ) from exc
    if np.ndim(values) == 0:  # ascontiguousarray lifts a number to one axis
        array = array.reshape(())
    sizes: dict[str, int] = {}
    fits = array.ndim == len(shape)
    for size, want in zip(array.shape, shape, strict=False):
        fits = fits and size == (sizes.setdefault(want, size) if isinstance(want, str) else want)
    if not fits:
        raise DataError(f"{name} has shape {array.shape}", allowed=f"shape {wanted}")
    bad = ~np.isfinite(array)
    if bad.any():
        where = tuple(int(i) for i in np.argwhere(bad)[0])
        raise DataError(
            f"{name} has {int(bad.sum())} value(s) that are not finite, the first "
            f"({array[where]}) at index {where}",
            allowed="finite numbers",
            do="remove or repair these samples",
        )
    return array


def check_increasing(times: Array, name: str) -> None:
    """Raise ``DataError`` unless ``times`` (n,) increase strictly.

    Raises
    ------
    DataError
        Naming the first index that does not increase, and whether it repeats or goes back.
    """
    steps = np.diff(times)
    if np.all(steps > 0):
        return
    k = int(np.argmax(steps <= 0))
    kind = "repeats" if steps[k] == 0 else "goes back"
    raise DataError(
        f"{name} {kind} at sample {k + 1}: {times[k]:.6f} s is followed by {times[k + 1]:.6f} s",
        allowed="strictly increasing times",
        do="sort the samples and remove duplicates",
    )
