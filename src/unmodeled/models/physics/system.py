"""The sum of effects as symbols: what gets compiled, without any numbers."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from heyoka import cos, expression, make_vars, par, sin, time

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector

__all__ = ["ORIENTATION", "STATE_NAMES", "System"]

STATE_NAMES = ("x", "y", "z", "vx", "vy", "vz")

#: Parameters of the orientation of a spinning body.
SPIN_RATE = Parameter("spin_rate", unit="rad s-1", scale=1e-6, description="rotation rate about z")
PRIME_MERIDIAN = Parameter(
    "prime_meridian", unit="rad", scale=1e-3, description="angle of the prime meridian at epoch"
)
POLE_X = Parameter("pole_x", unit="rad", scale=1e-6, description="turn of the equator about its x")
POLE_Y = Parameter("pole_y", unit="rad", scale=1e-6, description="turn of the equator about its y")
#: All of them: what acts through every effect in body axes.
ORIENTATION = (SPIN_RATE, PRIME_MERIDIAN, POLE_X, POLE_Y)

Rows: TypeAlias = tuple[Vector, Vector, Vector]


@dataclass(frozen=True)
class System:
    """A set of effects about one body: the key under which compiled code is kept.

    Parameters
    ----------
    effects : tuple of Effect
        At least one; no physical term twice.
    spinning : bool
        True: the body turns about its pole with the parameters ``spin_rate`` and
        ``prime_meridian``. False: body axes are the inertial axes.
    tilt_degree : int, optional
        None: the pole is the inertial z. Otherwise the degree of the series that turns inertial
        axes to the equator of the body; the parameters ``pole_x`` and ``pole_y`` then correct it.
    track_degree : int
        Degree of the series for the positions of other bodies.

    Raises
    ------
    ConfigError
        If there is no effect, or a term is contained twice.
    """

    effects: tuple[Effect, ...]
    spinning: bool = False
    tilt_degree: int | None = None
    track_degree: int = 0

    def __post_init__(self) -> None:
        if not self.effects:
            raise ConfigError("a force model without effects", do="add at least a point mass")
        counts = Counter(term for effect in self.effects for term in effect.terms)
        double = sorted(term for term, count in counts.items() if count > 1)
        if double:
            who = ", ".join(e.name for e in self.effects if double[0] in e.terms)
            raise ConfigError(
                f'the force model contains "{double[0]}" twice ({who})',
                allowed="each term once",
                do="drop one of the effects or change its degrees",
            )

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, each name once, in order of appearance."""
        found: dict[str, Parameter] = {}
        for effect in self.effects:
            for parameter in effect.parameters:
                if found.setdefault(parameter.name, parameter) != parameter:
                    raise ConfigError(
                        f"two effects declare the parameter {parameter.name} differently"
                    )
        if self.spinning:
            found |= {p.name: p for p in (SPIN_RATE, PRIME_MERIDIAN)}
        if self.tilted:
            found |= {p.name: p for p in (POLE_X, POLE_Y)}
        return tuple(found.values())

    @property
    def tilted(self) -> bool:
        """True if body axes turn about a pole that is not the inertial z."""
        return self.spinning and self.tilt_degree is not None

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """Names of the other bodies that the effects ask for, sorted."""
        return tuple(sorted({name for effect in self.effects for name in effect.bodies}))

    @cached_property
    def count(self) -> int:
        """Number of runtime parameters: those with a name, then those of the series."""
        series = 3 * (self.track_degree + 1) * len(self.bodies)
        tilt = 9 * (self.tilt_degree + 2) if self.tilted and self.tilt_degree is not None else 0
        return len(self.parameters) + 2 * bool(series or tilt) + series + tilt

    @cached_property
    def parameter_symbols(self) -> dict[str, expression]:
        """Runtime parameter of each name."""
        return {p.name: par[i] for i, p in enumerate(self.parameters)}

    @cached_property
    def body_symbols(self) -> dict[str, Vector]:
        """Position of each other body, inertial axes."""
        first = len(self.parameters) + 2
        size = self.track_degree + 1
        found = {}
        for k, name in enumerate(self.bodies):
            x, y, z = (
                _series(first + (3 * k + i) * size, size, self._scaled_time) for i in range(3)
            )
            found[name] = (x, y, z)
        return found

    @property
    def _scaled_time(self) -> expression:
        """Time mapped to -1 .. 1 on the interval of the series: centre and 1 / half length."""
        first = len(self.parameters)
        return (time - par[first]) * par[first + 1]

    @cached_property
    def _tilt(self) -> tuple[Rows, Rows]:
        """Q(t) and W of `Orientation`."""
        assert self.tilt_degree is not None
        size = self.tilt_degree + 1
        first = len(self.parameters) + 2 + 3 * (self.track_degree + 1) * len(self.bodies)
        flat = [_series(first + k * size, size, self._scaled_time) for k in range(9)]
        fixed = [par[first + 9 * size + k] for k in range(9)]
        return _rows(flat), _rows(fixed)

    @cached_property
    def state_symbols(self) -> tuple[expression, ...]:
        """Position and velocity variables."""
        return tuple(make_vars(*STATE_NAMES))

    @property
    def position_only(self) -> bool:
        """True if no effect looks at the velocity."""
        return all(effect.position_only for effect in self.effects)

    @cached_property
    def acceleration(self) -> Vector:
        """Sum of all accelerations, inertial components."""
        parts = [self._of(effect) for effect in self.effects]
        return _sum([p[0] for p in parts]), _sum([p[1] for p in parts]), _sum([p[2] for p in parts])

    @cached_property
    def potential(self) -> expression | None:
        """Sum of the force functions, or None if an effect has none."""
        parts = [effect.potential(self._symbols(effect)) for effect in self.effects]
        if any(p is None for p in parts):
            return None
        return _sum([p for p in parts if p is not None])

    @cached_property
    def edges(self) -> tuple[expression, ...]:
        """Expressions of which the integrator must stop at every zero."""
        return tuple(e for effect in self.effects for e in effect.edges(self._symbols(effect)))

    @cached_property
    def equations(self) -> list[tuple[expression, expression]]:
        """First-order equations of motion: (variable, time derivative)."""
        s = self.state_symbols
        return list(zip(s, (*s[3:], *self.acceleration), strict=True))

    def _of(self, effect: Effect) -> Vector:
        a = effect.acceleration(self._symbols(effect))
        return self._turn(a, -1) if self._in_body_axes(effect) else a

    def _symbols(self, effect: Effect) -> Symbols:
        s = self.state_symbols
        position, velocity = (s[0], s[1], s[2]), (s[3], s[4], s[5])
        bodies = {name: self.body_symbols[name] for name in effect.bodies}
        if self._in_body_axes(effect):
            position, velocity = self._turn(position, 1), self._turn(velocity, 1)
            bodies = {name: self._turn(v, 1) for name, v in bodies.items()}
        return Symbols(position, velocity, time, self.parameter_symbols, bodies)

    def _in_body_axes(self, effect: Effect) -> bool:
        return self.spinning and effect.axes == "body"

    def _turn(self, v: Vector, sign: int) -> Vector:
        """Components on axes turned with the body (+1), or back (-1)."""
        if not self.tilted:
            return self._spin(v, sign)
        slow, fixed = self._tilt
        if sign > 0:
            return _times(fixed, self._spin(self._nod(_times(slow, v), 1), 1))
        turned = self._spin(_times(_transposed(fixed), v), -1)
        return _times(_transposed(slow), self._nod(turned, -1))

    def _spin(self, v: Vector, sign: int) -> Vector:
        p = self.parameter_symbols
        angle = p["prime_meridian"] + p["spin_rate"] * time
        c, s = cos(angle), sign * sin(angle)
        return c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]

    def _nod(self, v: Vector, sign: int) -> Vector:
        """Turn the equator by pole_x about its x and pole_y about its y: exact rotations."""
        a, b = self.parameter_symbols["pole_x"], self.parameter_symbols["pole_y"]
        ca, sa, cb, sb = cos(a), sign * sin(a), cos(b), sign * sin(b)
        if sign > 0:
            v = (v[0], ca * v[1] + sa * v[2], ca * v[2] - sa * v[1])
            return cb * v[0] - sb * v[2], v[1], cb * v[2] + sb * v[0]
        v = (cb * v[0] - sb * v[2], v[1], cb * v[2] + sb * v[0])
        return v[0], ca * v[1] + sa * v[2], ca * v[2] - sa * v[1]


def _series(first: int, size: int, x: expression) -> expression:
    """Chebyshev series with the runtime parameters from ``first`` on (Clenshaw's recurrence)."""
    if size == 1:
        return par[first] + 0.0 * x
    above, here = expression(0.0), par[first + size - 1]
    for k in range(size - 2, 0, -1):
        above, here = here, par[first + k] + 2.0 * x * here - above
    return par[first] + x * here - above


def _rows(flat: list[expression]) -> Rows:
    a, b, c = ((flat[k], flat[k + 1], flat[k + 2]) for k in (0, 3, 6))
    return a, b, c


def _transposed(m: Rows) -> Rows:
    return _rows([m[j][i] for i in range(3) for j in range(3)])


def _times(m: Rows, v: Vector) -> Vector:
    x, y, z = (row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in m)
    return x, y, z


def _sum(terms: list[expression]) -> expression:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total
