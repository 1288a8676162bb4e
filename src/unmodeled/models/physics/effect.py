"""An effect is one cause of acceleration, written once as symbols.

From the symbols come, compiled and never by hand: accelerations at many points, orbits, the
state-transition matrix and the sensitivity to every parameter.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from heyoka import expression

from unmodeled.core.parameters import Parameter

__all__ = ["Effect", "Symbols", "Vector"]

#: Three scalar expressions: the components of a vector.
Vector: TypeAlias = tuple[expression, expression, expression]


@dataclass(frozen=True)
class Symbols:
    """What an effect may depend on, as symbols.

    Parameters
    ----------
    position, velocity : Vector
        Relative to the body's centre, components on the axes that the effect asked for
        (`Effect.axes`): inertial, or fixed in the body. The velocity is relative to inertial
        axes in both.
    time : expression
        Seconds since the epoch.
    parameters : mapping of str to expression
        Runtime parameters by name: a new value never recompiles.
    bodies : mapping of str to Vector
        Positions of the bodies that the effect asked for (`Effect.bodies`) relative to the central
        body, on the same axes as ``position``.
    """

    position: Vector
    velocity: Vector
    time: expression
    parameters: Mapping[str, expression]
    bodies: Mapping[str, Vector] = field(default_factory=dict)

    def __getitem__(self, name: str) -> expression:
        return self.parameters[name]


class Effect(ABC):
    """One force on the spacecraft, per unit mass.

    A concrete effect is a frozen dataclass whose fields are its *structure* (degrees, orders):
    two effects that compare equal share one compilation. Numbers that may change are parameters.

    The body of the docstring is the effect's card: formula, source, what it must not be combined
    with.
    """

    #: Name in configurations and reports.
    name: ClassVar[str]
    #: Axes of `Symbols.position` and of the returned vector: "inertial" or "body".
    axes: ClassVar[str] = "inertial"
    #: True if the acceleration depends on the position only (and on the body's orientation).
    position_only: ClassVar[bool] = True

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters with unit, scale and bounds; same name in two effects: the same number."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the other bodies whose positions the effect needs, e.g. ``("sun",)``."""
        return ()

    def events(self, values: Mapping[str, float]) -> tuple[tuple[float, float], ...]:
        """Return when the force changes abruptly: pairs of time and width of the change, s."""
        return ()

    @abstractmethod
    def acceleration(self, s: Symbols) -> Vector:
        """Return the acceleration, in the length and time units of the parameters."""

    def potential(self, s: Symbols) -> expression | None:
        """Return the force function U with acceleration = +grad U, or None if there is none."""
        return None

    def edges(self, s: Symbols) -> tuple[expression, ...]:
        """Return expressions of which the integrator must stop at every zero.

        For changes that are short against a Taylor step and too small for it to see, such as the
        edge of a shadow. The expressions themselves are smooth and slow.
        """
        return ()

    @property
    def terms(self) -> frozenset[str]:
        """Names of the physical terms contained; no two effects of a model may share one."""
        return frozenset({self.name})
