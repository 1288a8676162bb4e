"""A published gravity field, or a part of it, times one number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

from heyoka import expression, model

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.egm2008 import egm2008_values
from unmodeled.models.physics.spherical_harmonics import coefficient_names

__all__ = ["ScaledField"]

Values = Callable[[int, int | None, int], dict[str, float]]

#: Published fields by name: functions of degree, order and least degree.
FIELDS: Mapping[str, Values] = MappingProxyType({"egm2008": egm2008_values})
PARTS = ("all", "tesserals", "zonals")


@dataclass(frozen=True)
class ScaledField(Effect):
    r"""A published field in fully normalised spherical harmonics, times one scale.

    .. math::
        U = s\,\frac{GM}{r} \sum_{n=n_0}^{N} \left(\frac{R}{r}\right)^n \sum_{m}
        \bar P_{nm}(\sin\varphi)\,(\bar C_{nm}\cos m\lambda + \bar S_{nm}\sin m\lambda)

    in body-fixed axes. Source: [MontenbruckGill2000] Eq. 3.13-3.15; coefficients of
    [Pavlis2012]. The candidate for "this part of the field is missing": one parameter,
    ``egm2008_tesserals_2_8_scale`` (field, part, least and highest degree), which is 1 where the
    published field holds and 0 for none of it. The coefficients are structure and compiled in;
    for coefficients that are parameters take `SphericalHarmonics` with `egm2008_values`. GM and R
    of the field, ``egm2008_GM`` and ``egm2008_R``, belong to its coefficients and are not those of
    the model; their defaults are the published ones, SI.

    Size (root mean square over the sphere, Earth, degrees 2-8): zonals 1.4e-2, tesserals 1.7e-4
    m/s2 at 6,878 km; tesserals 9.9e-6 m/s2 at LAGEOS.

    Confused with: other ranges of degrees, the rotation angle of the body. Not to be combined with
    `SphericalHarmonics` or `Zonal` of the same degrees.

    Parameters
    ----------
    field : str
        Name of the published field: "egm2008".
    degree : int
        Highest degree.
    order : int, optional
        Highest order; the degree if not given.
    part : str
        "all", "tesserals" (order 1 and above) or "zonals" (order 0).
    min_degree : int
        Least degree, 2 or more.
    """

    field: str = "egm2008"
    degree: int = 8
    order: int | None = None
    part: str = "all"
    min_degree: int = 2
    name: ClassVar[str] = "scaled_field"
    axes: ClassVar[str] = "body"

    def __post_init__(self) -> None:
        if self.field not in FIELDS:
            raise ConfigError(f'published field "{self.field}"', allowed=", ".join(FIELDS))
        if self.part not in PARTS:
            raise ConfigError(f'part "{self.part}" of a field', allowed=", ".join(PARTS))
        if not 2 <= self.min_degree <= self.degree:
            raise ConfigError(
                f"a published field from degree {self.min_degree} to {self.degree}",
                allowed="2 <= min_degree <= degree",
            )
        if self.order is not None and not 0 <= self.order <= self.degree:
            raise ConfigError(
                f"a published field of degree {self.degree} and order {self.order}",
                allowed="0 <= order <= degree",
            )
        if not self._names:
            raise ConfigError(
                "the tesserals of a published field of order 0", allowed="order 1 or more"
            )

    @property
    def scale_name(self) -> str:
        """Name of the scale."""
        return f"{self.field}_{self.part}_{self.min_degree}_{self.degree}_scale"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The scale; GM and reference radius of the field."""
        published = FIELDS[self.field](self.min_degree, 0, self.min_degree)
        return (
            Parameter(
                self.scale_name,
                unit="1",
                value=1.0,
                description=f"{self.part} of {self.field}; 1: as published, 0: none",
            ),
            Parameter(
                f"{self.field}_GM",
                unit="m3 s-2",
                value=published["GM"],
                scale=published["GM"],
                lower=0.0,
                description=f"GM that goes with {self.field}",
            ),
            Parameter(
                f"{self.field}_R",
                unit="m",
                value=published["R_ref"],
                scale=published["R_ref"],
                lower=0.0,
                description=f"reference radius of {self.field}",
            ),
        )

    @property
    def terms(self) -> frozenset[str]:
        """One term for each coefficient."""
        return frozenset("gravity {}({},{})".format(*name.split("_")) for name in self._names)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of the field."""
        ax, ay, az = model.sh_gravity_acc(
            list(s.position), self._coefficients(), **self._settings(s)
        )
        return ax, ay, az

    def potential(self, s: Symbols) -> expression:
        """Return the force function."""
        return model.sh_gravity_pot(list(s.position), self._coefficients(), **self._settings(s))

    def _settings(self, s: Symbols) -> dict[str, Any]:
        return {
            "mu": s[self.scale_name] * s[f"{self.field}_GM"],
            "a": s[f"{self.field}_R"],
            "max_degree": self.degree,
            "max_order": self._top_order,
        }

    @property
    def _top_order(self) -> int:
        if self.part == "zonals":
            return 0
        return self.degree if self.order is None else self.order

    @property
    def _names(self) -> list[str]:
        names = coefficient_names(self.degree, self._top_order, self.min_degree)
        least = 1 if self.part == "tesserals" else 0
        return [name for name in names if int(name.split("_")[2]) >= least]

    def _coefficients(self) -> list[tuple[expression, expression]]:
        """C and S of every degree and order from 0 on; those of another part are zero."""
        values = FIELDS[self.field](self.degree, None, self.min_degree)
        kept = {name: values[name] for name in self._names}
        return [
            (expression(kept.get(f"C_{n}_{m}", 0.0)), expression(kept.get(f"S_{n}_{m}", 0.0)))
            for n in range(self.degree + 1)
            for m in range(n + 1)
        ]
