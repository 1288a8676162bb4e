"""Body cards: gravity, size, spin, orbit and air of a central body, each value with its source.

A card is a YAML file; those in ``cards/`` ship with the package and users write their own.  Zonal
coefficients follow J_n = -C_n0 with plain Legendre polynomials; a card may give them fully
normalised instead, and must then say so: J_n = sqrt(2 n + 1) Jbar_n, [MontenbruckGill2000]
section 3.2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy.typing as npt
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, nearest
from unmodeled.core.kepler_orbit import HeliocentricOrbit
from unmodeled.core.pole import Pole
from unmodeled.datasets.atmosphere import Atmosphere
from unmodeled.datasets.card_sections import read_sections

__all__ = ["Body", "body_names", "heliocentric_orbits", "load_body"]

_CARDS = Path(__file__).parent / "cards"
_CONVENTIONS = ("unnormalised", "fully_normalised")
_FIELDS = ("egm2008",)
# k2 of a homogeneous fluid body, [MurrayDermott1999] section 4.6: none is larger.
_FLUID_K2 = 1.5


@dataclass(frozen=True)
class Body:
    """A central body, in SI.

    Parameters
    ----------
    name : str
        Short name, e.g. ``"bennu"``.
    title : str
        Name for figures, e.g. ``"(101955) Bennu"``.
    gm : float
        Gravitational parameter, m3/s2.
    brillouin_radius : float
        Radius of the smallest sphere about the centre of mass that holds the body, m: inside it
        an orbit may collide and the harmonic series need not converge.
    reference_radius : float
        Radius that the zonal coefficients refer to, m.
    zonals : mapping of int to float
        Coefficient of each degree n >= 2, in the card's convention.
    zonal_convention : str
        ``"unnormalised"`` or ``"fully_normalised"``.
    spin_rate : float
        Rad/s about +z, sidereal; negative if retrograde.
    pole : Pole, optional
        Spin axis and prime meridian. Without one :meth:`pole_matrix` refuses; the Earth has none
        because ``core.earth_orientation`` knows it better.
    heliocentric_orbit : HeliocentricOrbit, optional
        Osculating elements of a small body, for where the Sun is.
    love_number_k2 : float, optional
        Degree 2, for solid tides.
    atmosphere : Atmosphere, optional
        Layers of exponential density over ``reference_radius``.
    gravity_field : str
        Name of a full field that is at hand for the body (``"egm2008"``), or empty.
    sources : mapping of str to str
        Key into REFERENCES.md of each value.
    notes : str
        What a user must know.

    Raises
    ------
    ConfigError
        If a value is not finite, a radius or gm is not positive, a degree is below 2, the Love
        number is not in 0 to 1.5, or the convention, the field or a source's key is unknown.

    Examples
    --------
    >>> load_body("bennu").zonal_unnormalised()[2]
    0.0193
    """

    name: str
    title: str
    gm: float
    brillouin_radius: float
    reference_radius: float
    zonals: Mapping[int, float] = field(default_factory=dict)
    zonal_convention: str = "unnormalised"
    spin_rate: float = 0.0
    pole: Pole | None = None
    heliocentric_orbit: HeliocentricOrbit | None = None
    love_number_k2: float | None = None
    atmosphere: Atmosphere | None = None
    gravity_field: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
    notes: str = ""

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("gm", "brillouin_radius", "reference_radius", "spin_rate"):
            put(self, name, self._number(name, getattr(self, name)))
            if name != "spin_rate" and not getattr(self, name) > 0:
                raise ConfigError(
                    f"body {self.name}: {name} is {getattr(self, name)}", allowed="a number > 0"
                )
        if self.zonal_convention not in _CONVENTIONS:
            raise ConfigError(
                f'body {self.name}: zonal_convention is "{self.zonal_convention}"',
                allowed=", ".join(_CONVENTIONS),
                do=nearest(str(self.zonal_convention), _CONVENTIONS),
            )
        self._check_parts()
        if not isinstance(self.zonals, Mapping) or not isinstance(self.sources, Mapping):
            raise ConfigError(
                f"body {self.name}: zonals and sources must be tables",
                do='write them like "zonals: {2: 1.93e-2, 3: -1.22e-3}"',
            )
        for degree in self.zonals:
            if isinstance(degree, bool) or not isinstance(degree, int) or degree < 2:
                raise ConfigError(
                    f"body {self.name}: zonal degree {degree!r}", allowed="whole numbers >= 2"
                )
        values = {n: self._number(f"zonal J{n}", j) for n, j in sorted(self.zonals.items())}
        known = [f.name for f in fields(self)]
        for key in self.sources:
            if key not in known:
                raise ConfigError(
                    f'body {self.name}: sources name "{key}"', do=nearest(str(key), known)
                )
        # Read-only views: a frozen body must not change through its tables.
        put(self, "zonals", MappingProxyType(values))
        put(self, "sources", MappingProxyType({k: str(v) for k, v in self.sources.items()}))

    def _check_parts(self) -> None:
        parts = (
            ("pole", Pole),
            ("heliocentric_orbit", HeliocentricOrbit),
            ("atmosphere", Atmosphere),
        )
        for name, kind in parts:
            value = getattr(self, name)
            if value is not None and not isinstance(value, kind):
                raise ConfigError(
                    f"body {self.name}: {name} is {value!r}", allowed=f"a {kind.__name__}"
                )
        if self.love_number_k2 is not None:
            k2 = self._number("love_number_k2", self.love_number_k2)
            if not 0 <= k2 <= _FLUID_K2:
                raise ConfigError(
                    f"body {self.name}: love_number_k2 is {k2:g}", allowed=f"0 to {_FLUID_K2}"
                )
            object.__setattr__(self, "love_number_k2", k2)
        if self.gravity_field and self.gravity_field not in _FIELDS:
            raise ConfigError(
                f'body {self.name}: gravity_field is "{self.gravity_field}"',
                allowed=", ".join(_FIELDS) + ", or nothing",
                do=nearest(str(self.gravity_field), _FIELDS),
            )

    def _number(self, name: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ConfigError(f"body {self.name}: {name} is {value!r}", allowed="a number")
        if not math.isfinite(value):
            raise ConfigError(f"body {self.name}: {name} is {value}", allowed="a finite number")
        return float(value)

    def __hash__(self) -> int:
        return hash((self.name, self.gm, self.reference_radius, tuple(self.zonals.items())))

    def __reduce__(self) -> tuple[Any, ...]:
        # Read-only views cannot be pickled; workers rebuild the body from plain tables.
        plain = {f.name: getattr(self, f.name) for f in fields(self)}
        plain["zonals"], plain["sources"] = dict(self.zonals), dict(self.sources)
        return _rebuild, (plain,)

    @property
    def radius(self) -> float:
        """Brillouin radius, m: the unit of length and the surface that ends an orbit."""
        return self.brillouin_radius

    def zonal_unnormalised(self) -> dict[int, float]:
        """J_n of each degree, unnormalised, referred to ``reference_radius``."""
        if self.zonal_convention == "unnormalised":
            return dict(self.zonals)
        return {n: math.sqrt(2 * n + 1) * j for n, j in self.zonals.items()}

    def pole_matrix(self) -> Array:
        """Rotation from ICRF axes to the body's equatorial axes, (3, 3).

        z along the pole, x along the ascending node of the equator on the ICRF's xy-plane; the
        axes do not spin. See :class:`~unmodeled.core.pole.Pole`.

        Raises
        ------
        ConfigError
            If the card has no pole.
        """
        return self._known_pole().matrix()

    def body_fixed_from_icrf(self, epoch: str, times: npt.ArrayLike) -> Array:
        """Rotation from ICRF axes into the spinning body at ``times`` (n,) s after ``epoch``.

        Returns
        -------
        ndarray (n, 3, 3)
            Uniform spin at ``spin_rate`` about the card's pole, its angle counted from J2000.

        Raises
        ------
        ConfigError
            If the card has no pole.
        DataError
            If the epoch or the times cannot be read.
        """
        return self._known_pole().body_fixed_from_icrf(epoch, times, self.spin_rate)

    def _known_pole(self) -> Pole:
        if self.pole is None:
            raise ConfigError(
                f"the card of {self.name} has no pole",
                do="use core.earth_orientation"
                if self.name == "earth"
                else 'add one: "pole: {right_ascension_deg: 85.65, declination_deg: -60.17}"',
            )
        return self.pole


def body_names() -> list[str]:
    """Names of the cards that ship with the package, sorted.

    Examples
    --------
    >>> body_names()
    ['bennu', 'earth', 'eros', 'mars', 'moon', 'sun']
    """
    return sorted(p.stem for p in _CARDS.glob("*.yaml"))


def heliocentric_orbits() -> dict[str, HeliocentricOrbit]:
    """Osculating elements of the shipped cards that have them, for ``core.ephemeris``.

    Examples
    --------
    >>> sorted(heliocentric_orbits())
    ['bennu', 'eros']
    """
    orbits = {name: load_body(name).heliocentric_orbit for name in body_names()}
    return {name: orbit for name, orbit in orbits.items() if orbit is not None}


def load_body(name_or_path: str | Path) -> Body:
    """Load a body from a shipped card by name, or from a card file.

    Parameters
    ----------
    name_or_path : str or Path
        ``"bennu"``, or the path of a ``.yaml`` file.

    Raises
    ------
    ConfigError
        If there is no such card, the file is not a table in YAML, a key is unknown or missing,
        or a value is refused by :class:`Body`.
    """
    text = str(name_or_path)
    path = Path(text)
    if path.suffix not in (".yaml", ".yml"):
        path = _CARDS / f"{text.lower()}.yaml"
        if text.lower() not in body_names():
            raise ConfigError(
                f'there is no body "{text}"',
                allowed=", ".join(body_names()) + ", or the path of a .yaml card",
                do=nearest(text.lower(), body_names()),
            )
    return _read(path)


def _rebuild(values: dict[str, Any]) -> Body:
    return Body(**values)


def _read(path: Path) -> Body:
    try:
        # YAML 1.2: 1e-2 is a number, and "no" is a word.
        card = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except FileNotFoundError as exc:
        raise ConfigError(f"there is no card {path}", do="check the path") from exc
    except (OSError, UnicodeDecodeError, YAMLError) as exc:
        raise ConfigError(f"card {path} cannot be read ({_first_line(exc)})") from exc
    known = [f.name for f in fields(Body)]
    if not isinstance(card, dict):
        raise ConfigError(f"card {path} is not a table", allowed="keys " + ", ".join(known))
    for key in card:
        if key not in known:
            raise ConfigError(
                f'card {path} has an unknown key "{key}"', do=nearest(str(key), known)
            )
    for key in ("name", "gm", "brillouin_radius"):
        if key not in card:
            raise ConfigError(f'card {path} lacks the key "{key}"', do="add it")
    # Most cards refer their harmonics to the Brillouin sphere itself.
    filled = {"title": card["name"], "reference_radius": card["brillouin_radius"]}
    filled.update(read_sections(card, str(path)))
    return Body(**filled)


def _first_line(exc: Exception) -> str:
    return " ".join(str(exc).split())[:200]
