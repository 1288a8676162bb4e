"""What the tide of the solid Earth has beyond one Love number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import sqrt
from typing import ClassVar

from heyoka import expression, model

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.third_body import third_body_gm
from unmodeled.models.physics.tidal_arguments import TIDE_DAY, Coefficients, harmonics, wave
from unmodeled.models.physics.vectors import norm
from unmodeled.models.physics.zonal import REFERENCE_RADIUS

__all__ = ["FineSolidTide"]

SCALE = Parameter(
    "fine_tide_scale", unit="1", value=1.0, description="fine part of the solid tide; 0: none"
)
_BODIES = ("sun", "moon")

#: Love numbers of the anelastic Earth, [IERS2010] Table 6.3: real and imaginary part by degree and
#: order; those of degree 2 less the real 0.30190 of the plain solid tide.
_PLAIN = 0.30190
_LOVE = {
    (2, 1): (0.29830 - _PLAIN, -0.00144),
    (2, 2): (0.30102 - _PLAIN, -0.00130),
    (3, 0): (0.093, 0.0),
    (3, 1): (0.093, 0.0),
    (3, 2): (0.093, 0.0),
    (3, 3): (0.094, 0.0),
}
#: Of the harmonics of degree 4 that a tide of degree 2 makes in an Earth that is not round.
_TO_DEGREE_4 = {0: -0.00089, 1: -0.00080, 2: -0.00057}

#: Multipliers of GMST + pi, l, l', F, D, Omega; amplitudes in phase and out of phase, 1e-12; and
#: what the node splits off, by steps of Omega, as a share: [IERS2010] Tables 6.5a, 6.5b.
_WAVES: tuple[tuple[tuple[int, ...], float, float, dict[int, float]], ...] = (
    ((1, 0, 0, 2, 0, 2), -6.8, 0.6, {-1: 1.3 / 6.8}),  # O1
    ((1, 1, 0, 0, 0, 0), 1.3, -0.1, {}),  # NO1
    ((1, 0, 1, 2, -2, 2), -1.9, 0.1, {}),  # pi1
    ((1, 0, 0, 2, -2, 2), -43.4, 2.9, {-1: -0.5 / 43.4}),  # P1
    ((1, 0, 1, 0, 0, 0), 1.6, -0.1, {}),  # S1
    ((1, 0, 0, 0, 0, 0), 470.9, -30.2, {-1: -8.8 / 470.9, 1: 68.1 / 470.9, 2: -1.6 / 470.9}),  # K1
    ((1, 0, -1, 0, 0, 0), -20.6, -0.3, {}),  # psi1
    ((1, 0, 0, -2, 2, -2), -5.0, 0.3, {}),  # phi1
    ((1, -1, 0, 0, 0, 0), -2.1, 0.1, {1: 0.4 / 2.1}),  # J1
    ((0, 0, 0, -2, 2, -2), -5.5, 4.3, {}),  # Ssa
    ((0, -1, 0, 0, 0, 0), -1.2, 3.7, {}),  # Mm
    ((0, 0, 0, -2, 0, -2), 0.6, 6.3, {1: 2.6 / 6.3}),  # Mf
)


@dataclass(frozen=True)
class FineSolidTide(Effect):
    r"""What the tide of the solid Earth has beyond one real k2 of 0.30190.

    .. math::
        \Delta\bar C_{nm} - i\,\Delta\bar S_{nm} = s \left[\frac{\delta k_{nm}}{2n+1}
        \sum_b \frac{\mu_b}{\mu} \left(\frac{R}{r_b}\right)^{n+1} \bar P_{nm}(\sin\Phi_b)
        e^{-im\lambda_b} + \eta_m \sum_f A_f e^{i\theta_f}\right]

    with eta_0 = 1, eta_1 = -i. Source: [IERS2010] Eq. 6.6-6.8. The first
    sum holds how k2 depends on the order, the lag of the bulge, degree 3, and degree 4 raised by
    degree 2; the second how the response depends on frequency: the free nutation of the core
    makes the tide near a sidereal day (K1) smaller. Waves below 1e-12 and that of
    19 years, which stands still, are left out (3e-12 in C21, 2e-11 in C20). With
    ``tide_k2`` = 0.30190 in `SolidTide` the two together are the tide of the conventions (tide
    free). Earth only; body-fixed axes, equator and prime meridian of the ITRF. ``fine_tide_scale``
    is 1 for the Earth, 0 for none. ``tide_day`` is where time zero lies.

    Size: 2e-10 m/s2 at LAGEOS; K1 tilts the orbit steadily: 4 cm in a day.

    Confused with: an error of the pole, the tides of the oceans. Not to be combined with a model
    that has complex Love numbers already.
    """

    name: ClassVar[str] = "fine_solid_tide"
    axes: ClassVar[str] = "body"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Scale, date, GM, reference radius, GM of Sun and Moon."""
        return (SCALE, TIDE_DAY, GM, REFERENCE_RADIUS, *(third_body_gm(b) for b in _BODIES))

    @property
    def bodies(self) -> tuple[str, ...]:
        """Sun and Moon."""
        return _BODIES

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of `potential`."""
        ax, ay, az = model.sh_gravity_acc(
            list(s.position), harmonics(self._field(s), 4), **_settings(s)
        )
        return ax, ay, az

    def potential(self, s: Symbols) -> expression:
        """Return the force function."""
        return model.sh_gravity_pot(list(s.position), harmonics(self._field(s), 4), **_settings(s))

    def _field(self, s: Symbols) -> Coefficients:
        zero = expression(0.0)
        found: dict[tuple[int, int], tuple[expression, expression]] = {}

        def add(n: int, m: int, c: expression, sine: expression) -> None:
            before = found.get((n, m), (zero, zero))
            found[n, m] = (before[0] + c, before[1] + sine)

        for body in _BODIES:
            for n, m, x, y in _raised(s, body):
                if (n, m) in _LOVE:
                    real, imaginary = _LOVE[n, m]
                    add(n, m, real * x + imaginary * y, real * y - imaginary * x)
                if n == 2:
                    add(4, m, _TO_DEGREE_4[m] * x, _TO_DEGREE_4[m] * y)
        for multipliers, inside, outside, beside in _WAVES:
            c, sine = wave(s, multipliers, beside)
            a, b = 1e-12 * inside, 1e-12 * outside
            if multipliers[0] == 1:
                add(2, 1, a * sine + b * c, a * c - b * sine)
            else:
                add(2, 0, a * c - b * sine, zero)
        return found


def _settings(s: Symbols) -> dict[str, expression | int]:
    return {"mu": s["fine_tide_scale"] * s["GM"], "a": s["R_ref"], "max_degree": 4, "max_order": 3}


def _raised(s: Symbols, body: str) -> Iterator[tuple[int, int, expression, expression]]:
    """C and S of degrees 2 and 3 that a body would raise with Love numbers of 1."""
    place = s.bodies[body]
    d = norm(place)
    x, y, z = (component / d for component in place)
    ratio = s["R_ref"] / d
    size = s[f"GM_{body}"] / s["GM"] * ratio * ratio * ratio
    powers = [(expression(1.0), expression(0.0)), (x, y), (x * x - y * y, 2.0 * x * y)]
    powers.append((x * powers[2][0] - y * powers[2][1], x * powers[2][1] + y * powers[2][0]))
    legendre = {
        (2, 0): sqrt(5.0) * (1.5 * z * z - 0.5),
        (2, 1): sqrt(15.0) * z,
        (2, 2): expression(sqrt(15.0) / 2.0),
        (3, 0): sqrt(7.0) * z * (2.5 * z * z - 1.5),
        (3, 1): sqrt(7.0 / 6.0) * (7.5 * z * z - 1.5),
        (3, 2): sqrt(7.0 / 60.0) * 15.0 * z,
        (3, 3): expression(sqrt(7.0 / 360.0) * 15.0),
    }
    for (n, m), p in legendre.items():
        factor = p * size / (2.0 * n + 1.0)
        if n == 3:
            factor = factor * ratio
        yield n, m, factor * powers[m][0], factor * powers[m][1]
