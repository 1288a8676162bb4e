"""Numbers for people: few digits, SI prefixes, powers of ten without markup."""

from __future__ import annotations

import math

__all__ = ["bytes_text", "engineering", "number", "power_of_ten", "seconds_text"]

_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_PREFIXES = {
    -15: "f",
    -12: "p",
    -9: "n",
    -6: "µ",
    -3: "m",
    0: "",
    3: "k",
    6: "M",
    9: "G",
}
_MINUTE, _HOUR, _DAY = 60.0, 3600.0, 86_400.0


def number(value: float, digits: int = 2) -> str:
    """Return a number with a few significant digits, plain where that is short.

    Parameters
    ----------
    value : float
        May be infinite or NaN.
    digits : int
        Significant digits; whole numbers below 100,000 keep all of theirs.

    Examples
    --------
    >>> [number(v) for v in (2.14e-5, 0.492, 98.3, 1234.0, 2.5e7, float("inf"))]
    ['2.1e-5', '0.49', '98', '1200', '2.5e7', '∞']
    """
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0:
        return "0"
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    power = int(exponent)
    if -3 <= power < 5:
        decimals = max(digits - 1 - power, 0)
        return f"{round(value, digits - 1 - power):.{decimals}f}"
    return f"{mantissa}e{power}"


def engineering(largest: float) -> tuple[float, str]:
    """Return factor and SI prefix that bring a size to between 1 and 1000.

    Examples
    --------
    >>> engineering(5.8e-5)
    (1000000.0, 'µ')
    """
    if not (math.isfinite(largest) and largest > 0):
        return 1.0, ""
    power = 3 * math.floor(math.log10(largest) / 3 + 1e-12)
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return 10.0**-power, _PREFIXES[power]


def power_of_ten(exponent: int) -> str:
    """Return ten to a power in plain characters.

    Examples
    --------
    >>> power_of_ten(-5)
    '10⁻⁵'
    """
    return "10" + str(exponent).translate(_SUPERSCRIPT)


def seconds_text(seconds: float, digits: int = 2) -> str:
    """Return a time with a unit that suits it.

    Examples
    --------
    >>> [seconds_text(v) for v in (2.2e-6, 0.031, 12.0, 14032.0, 3e5)]
    ['2.2 µs', '31 ms', '12 s', '3.9 h', '3.5 d']
    """
    if not math.isfinite(seconds):
        return number(seconds)
    for unit, size in (("d", _DAY), ("h", _HOUR), ("min", _MINUTE)):
        if seconds >= 2 * size:
            return f"{number(seconds / size, digits)} {unit}"
    if seconds >= 1:
        return f"{number(seconds, digits)} s"
    factor, prefix = engineering(seconds)
    return f"{number(seconds * factor, digits)} {prefix}s"


def bytes_text(size: float) -> str:
    """Return a size of memory in kB, MB or GB (powers of 1000).

    Examples
    --------
    >>> bytes_text(0), bytes_text(48_000), bytes_text(2.5e9)
    ('0 kB', '48 kB', '2.5 GB')
    """
    for unit, scale in (("GB", 1e9), ("MB", 1e6)):
        if size >= scale:
            return f"{number(size / scale)} {unit}"
    return f"{number(size / 1e3)} kB"
