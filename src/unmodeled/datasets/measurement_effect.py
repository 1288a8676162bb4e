"""The contract of measurement effects: what blames the instrument instead of the physics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, nearest
from unmodeled.core.parameters import Parameter
from unmodeled.datasets.measurements import Measurements

__all__ = ["MeasurementEffect"]


@dataclass(frozen=True)
class MeasurementEffect(ABC):
    """One error of an instrument, a clock, a station or of the bookkeeping.

    The counterpart of :class:`unmodeled.models.physics.effect.Effect`: it acts on predictions,
    not on the orbit. The body of a concrete docstring is the card: formula, size, what it is
    confused with, source. At zero the measurements are unchanged; values add to what the
    measurements hold already.

    Parameters
    ----------
    of : str
        Label of the data set (for `StationPosition`: name of the station) that it concerns, which
        then also stands in the parameters' names, ``"range_bias[DSS-25]"``. Empty: all data sets
        of its kinds share one parameter, ``"range_bias"``.
    """

    #: Name in cases and reports.
    name: ClassVar[str]
    #: Kinds of measurement that it can act on.
    kinds: ClassVar[tuple[str, ...]]

    of: str = ""

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters with unit and scale; zero means no effect."""

    @abstractmethod
    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return d predicted / d parameter of an *applied* ``m``, (n, k, p).

        Parameters
        ----------
        m : Measurements
            As `applied` returns it.
        states : ndarray (n, 6)
            At ``m.times``, inertial, SI.
        accelerations : ndarray (n, 3)
            At the same times, m/s2; only effects on time use them.
        """

    @abstractmethod
    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        """Return the measurements with the effect."""

    def applied(self, m: Measurements, values: Mapping[str, float]) -> Measurements:
        """Return the measurements as an instrument with these parameters makes them.

        Exact, not linearised. The result's ``times`` are where the orbit must be evaluated.

        Parameters
        ----------
        m : Measurements
            Must be one that the effect `concerns`.
        values : mapping of str to float
            All parameters of the effect; others are ignored.

        Raises
        ------
        ConfigError
            If the effect does not concern ``m``, or a parameter is missing.
        """
        if not self.concerns(m):
            raise ConfigError(
                f"{self.name} does not act on {m.label} ({m.kind})",
                allowed=", ".join(self.kinds) + (f" of {self.of}" if self.of else ""),
            )
        names = [p.name for p in self.parameters]
        for name in names:
            if name not in values:
                raise ConfigError(f'parameter "{name}" is missing', do=nearest(name, values))
        return self._applied(m, tuple(float(values[name]) for name in names))

    def concerns(self, m: Measurements) -> bool:
        """Whether the effect acts on these measurements."""
        return m.kind in self.kinds and self.of in ("", m.label)

    def _named(self, stem: str) -> str:
        return f"{stem}[{self.of}]" if self.of else stem

    def _parameter(self, stem: str, unit: str, scale: float, description: str) -> Parameter:
        return Parameter(self._named(stem), unit=unit, scale=scale, description=description)


def constant_columns(m: Measurements, factors: Array) -> Array:
    """Return columns (n, k, k): component j moves by ``factors`` (n,) times parameter j."""
    columns: Array = factors[:, None, None] * np.eye(len(m.components))
    return columns
