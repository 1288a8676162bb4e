"""The sum of effects as symbols: what gets compiled, without any numbers."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

from heyoka import cos, expression, make_vars, par, sin, time

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector

__all__ = ["STATE_NAMES", "System"]

STATE_NAMES = ("x", "y", "z", "vx", "vy", "vz")

#: Parameters of the orientation of a spinning body.
SPIN_RATE = Parameter("spin_rate", unit="rad s-1", scale=1e-6, description="rotation rate about z")
PRIME_MERIDIAN = Parameter(
    "prime_meridian", unit="rad", scale=1e-3, description="angle of the prime meridian at epoch"
)


@dataclass(frozen=True)
class System:
    """A set of effects about one body: the key under which compiled code is kept.

    Parameters
    ----------
    effects : tuple of Effect
        At least one; no physical term twice.
    spinning : bool
        True: the body turns about z with the parameters ``spin_rate`` and ``prime_meridian``.
        False: body axes are the inertial axes.

    Raises
    ------
    ConfigError
        If there is no effect, or a term is contained twice.
    """

    effects: tuple[Effect, ...]
    spinning: bool = False

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
        return tuple(found.values())

    @cached_property
    def parameter_symbols(self) -> dict[str, expression]:
        """Runtime parameter of each name."""
        return {p.name: par[i] for i, p in enumerate(self.parameters)}

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
        if self._in_body_axes(effect):
            position, velocity = self._turn(position, 1), self._turn(velocity, 1)
        return Symbols(position, velocity, time, self.parameter_symbols)

    def _in_body_axes(self, effect: Effect) -> bool:
        return self.spinning and effect.axes == "body"

    def _turn(self, v: Vector, sign: int) -> Vector:
        """Components on axes turned with the body (+1), or back (-1)."""
        p = self.parameter_symbols
        angle = p["prime_meridian"] + p["spin_rate"] * time
        c, s = cos(angle), sign * sin(angle)
        return c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]


def _sum(terms: list[expression]) -> expression:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total
