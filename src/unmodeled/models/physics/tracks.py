"""Where other bodies are, as polynomials of time that compiled code reads at run time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import chebyshev

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, NumericalError, nearest

__all__ = ["Tracks", "fit_series"]

#: Degrees that are tried: few different ones, because each is a compilation of its own.
DEGREES = (0, 5, 11, 17, 27, 41, 61, 91)


@dataclass(frozen=True)
class Tracks:
    """Positions of other bodies over one interval, as Chebyshev series.

    A kernel or a theory is asked once, at the nodes; compiled code gets the coefficients as
    runtime parameters, so that another epoch, or another kernel, needs no compilation.

    Parameters
    ----------
    start, end : float
        Interval on which the series hold, s since the epoch.
    coefficients : mapping of str to ndarray (d + 1, 3)
        Of each body's position relative to the central body, m, inertial axes; all of one degree.

    Raises
    ------
    ConfigError
        If the interval is empty or the shapes differ.
    """

    start: float
    end: float
    coefficients: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.start < self.end:
            raise ConfigError(f"tracks from {self.start} s to {self.end} s", allowed="start < end")
        if len({np.shape(c) for c in self.coefficients.values()}) > 1:
            raise ConfigError("tracks of different degrees", do="fit them together")

    @classmethod
    def fit(
        cls,
        positions: Mapping[str, Callable[[Array], Array]],
        start: float,
        end: float,
        tolerance: float = 1e-11,
    ) -> Tracks:
        """Fit series to functions of time.

        Parameters
        ----------
        positions : mapping of str to callable
            Takes times (n,), s, and returns positions (n, 3), m.
        start, end : float
            Interval, s.
        tolerance : float
            Largest error allowed, as a share of the distance.

        Raises
        ------
        NumericalError
            If no degree up to 91 reaches the tolerance.

        Examples
        --------
        >>> tracks = Tracks.fit({"sun": lambda t: [[1.5e11, 2e4 * s, 0.0] for s in t]}, 0.0, 100.0)
        >>> tracks.position("sun", [50.0]).round(3)
        array([[1.5e+11, 1.0e+06, 0.0e+00]])
        """
        series = fit_series(positions, start, end, tolerance)
        return cls(start, end, series)

    @property
    def degree(self) -> int:
        """Degree of the series; 0 without bodies."""
        return max((len(c) - 1 for c in self.coefficients.values()), default=0)

    def position(self, body: str, times: Array) -> Array:
        """Return positions (n, 3) of one body, m.

        Raises
        ------
        ConfigError
            If there is no such body.
        DataError
            If a time lies outside the interval.
        """
        if body not in self.coefficients:
            raise ConfigError(
                f'there is no track of "{body}"',
                allowed=", ".join(sorted(self.coefficients)) or "none was given",
                do=nearest(body, self.coefficients),
            )
        times = as_array(times, ("n",), "times")
        self.check(times)
        scaled = (2.0 * times - self.start - self.end) / (self.end - self.start)
        return np.asarray(chebyshev.chebval(scaled, self.coefficients[body]).T, dtype=np.float64)

    def check(self, times: Array) -> None:
        """Refuse times outside the interval."""
        slack = 1e-9 * (self.end - self.start)
        if np.min(times) < self.start - slack or np.max(times) > self.end + slack:
            raise DataError(
                f"times from {np.min(times):.6g} s to {np.max(times):.6g} s",
                allowed=f"{self.start:.6g} s to {self.end:.6g} s, where Sun, Moon and planets "
                "were computed",
            )


def fit_series(
    functions: Mapping[str, Callable[[Array], Array]],
    start: float,
    end: float,
    tolerance: float,
) -> dict[str, Array]:
    """Return Chebyshev coefficients (d + 1, k) of each function, all of the least degree that does.

    Raises
    ------
    NumericalError
        If no degree up to 91 reaches the tolerance.
    """
    if not functions:
        return {}
    # A node and an off-node test point each time: the error between the nodes counts.
    test = np.cos(np.pi * (np.arange(200) + 0.37) / 200.0)
    middle, half = 0.5 * (start + end), 0.5 * (end - start)
    at_test = {k: np.asarray(f(middle + half * test), dtype=float) for k, f in functions.items()}
    sizes = {k: np.linalg.norm(v, axis=-1).max() for k, v in at_test.items()}
    worst = np.inf
    for degree in DEGREES:
        nodes = chebyshev.chebpts1(degree + 1)
        series = {
            k: chebyshev.chebfit(nodes, np.asarray(f(middle + half * nodes), dtype=float), degree)
            for k, f in functions.items()
        }
        worst = max(
            float(np.abs(chebyshev.chebval(test, c).T - at_test[k]).max() / sizes[k])
            for k, c in series.items()
        )
        if worst <= tolerance:
            return series
    raise NumericalError(
        f"positions over {end - start:.6g} s need more than degree {DEGREES[-1]} "
        f"(error {worst:.1e} of the distance)",
        do="use shorter arcs",
    )
