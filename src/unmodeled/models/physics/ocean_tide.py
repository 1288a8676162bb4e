"""The tide of the oceans, as far as a satellite feels it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression, model

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.tidal_arguments import TIDE_DAY, Coefficients, harmonics, wave
from unmodeled.models.physics.zonal import REFERENCE_RADIUS

__all__ = ["OceanTide"]

SCALE = Parameter(
    "ocean_tide_scale", unit="1", value=1.0, description="tide of the oceans; 0: none"
)
_DEGREE = 4

_M1 = {-1: 0.1886}  # what the node splits off Q1 and O1: the potential's ratio
_M2 = {-1: -0.0373}
#: Multipliers of GMST + pi, l, l', F, D, Omega; what the node splits off, by steps of Omega, as a
#: share; C+ and S+ of the order of the wave and degrees 2, 3 and 4, 1e-11. P1 has the sign that its
#: neighbour K1 demands (copies of the table have the other): its potential is -0.331 of K1's.
_WAVES: tuple[tuple[tuple[int, ...], dict[int, float], tuple[float, ...]], ...] = (
    ((1, 1, 0, 2, 0, 2), _M1, (-3.75105, -3.54595, 0.87847, 3.23688, -0.85943, -2.72810)),  # Q1
    (
        (1, 0, 0, 2, 0, 2),
        _M1,
        (-16.83767, -18.02652, -1.71828, 13.48984, -1.84095, -14.34306),
    ),  # O1
    ((1, 0, 0, 2, -2, 2), {}, (-6.70855, -6.15415, -2.46513, 1.63987, 1.80098, -6.00830)),  # P1
    (
        (1, 0, 0, 0, 0, 0),
        {-1: -0.0198, 1: 0.1357},
        (20.22034, 18.62745, 7.35715, -5.00724, -5.61915, 18.07323),
    ),  # K1
    ((2, 1, 0, 2, 0, 2), _M2, (-7.03645, 11.66906, 0.66582, -2.90877, 5.78837, -6.91324)),  # N2
    ((2, 0, 0, 2, 0, 2), _M2, (-39.36214, 46.75729, 1.20179, -8.55770, 31.12272, -25.20358)),  # M2
    ((2, 0, 0, 2, -2, 2), {}, (-15.68722, 15.74867, -3.75420, -7.96726, 13.38392, -3.94697)),  # S2
    (
        (2, 0, 0, 0, 0, 0),
        {1: 0.2980},
        (-4.11082, 4.36794, -1.12847, -2.44280, 3.63734, -0.88924),
    ),  # K2
    ((0, 0, 0, -2, 2, -2), {}, (-3.60843, -0.13143, -0.06857, 0.00484, 0.67498, -0.03008)),  # Ssa
    ((0, -1, 0, 0, 0, 0), {}, (-5.83353, -1.02368, 0.08685, -0.24269, 0.73493, -0.24003)),  # Mm
    (
        (0, 0, 0, -2, 0, -2),
        {1: 0.4147},
        (-9.80623, -2.87460, 0.67473, -0.41760, 1.73312, -0.56419),
    ),  # Mf
)


@dataclass(frozen=True)
class OceanTide(Effect):
    r"""Tide of the oceans: the part of the main waves that goes round with Moon and Sun.

    .. math::
        \Delta\bar C_{nm} - i\,\Delta\bar S_{nm} = s \sum_f (C^+_{f,nm} - i S^+_{f,nm})\,
        e^{i\theta_f}

    Source: [IERS2010] Eq. 6.15, coefficients of FES2004 [Lyard2006] with the load of the water on
    the solid Earth. Waves Q1, O1, P1, K1 (order 1), N2, M2, S2, K2 (order 2), Mm, Mf and
    Ssa (order 0), degrees 2 to 4; each has the neighbour that the node splits off,
    in proportion to the tide-generating potential. What goes the other way round, or has another
    order, pushes a satellite to and fro within a day and is left out (mm at LAGEOS), as
    are smaller waves and the tide of the air. Earth only; body-fixed axes of the ITRF.
    ``ocean_tide_scale`` is 1 for the Earth, 0 for none. ``tide_day`` is where time zero lies.

    Size: 6e-10 in C22 and 3e-10 in C21, 7 % of the solid tide; 5e-10 m/s2 at LAGEOS.

    Confused with: the solid tide (k2 seems 7 % smaller to a high satellite). Not to be combined
    with another ocean tide.
    """

    name: ClassVar[str] = "ocean_tide"
    axes: ClassVar[str] = "body"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Scale, date, GM, reference radius."""
        return SCALE, TIDE_DAY, GM, REFERENCE_RADIUS

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of `potential`."""
        ax, ay, az = model.sh_gravity_acc(
            list(s.position), harmonics(_field(s), _DEGREE), **_settings(s)
        )
        return ax, ay, az

    def potential(self, s: Symbols) -> expression:
        """Return the force function."""
        return model.sh_gravity_pot(list(s.position), harmonics(_field(s), _DEGREE), **_settings(s))


def _settings(s: Symbols) -> dict[str, expression | int]:
    scaled = s["ocean_tide_scale"] * s["GM"]
    return {"mu": scaled, "a": s["R_ref"], "max_degree": _DEGREE, "max_order": 2}


def _field(s: Symbols) -> Coefficients:
    zero = expression(0.0)
    found: dict[tuple[int, int], tuple[expression, expression]] = {}
    for multipliers, beside, amplitudes in _WAVES:
        m = multipliers[0]
        c, sine = wave(s, multipliers, beside)
        for n in range(2, _DEGREE + 1):
            p, q = (1e-11 * a for a in amplitudes[2 * n - 4 : 2 * n - 2])
            before = found.get((n, m), (zero, zero))
            along, across = p * c + q * sine, q * c - p * sine
            found[n, m] = (before[0] + along, before[1] + (across if m else zero))
    return found
