"""How far from a body each zonal term matters, [Neamati2022] Fig. 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import eval_legendre, roots_legendre

from unmodeled.core.arrays import Array
from unmodeled.core.constants import GM_OF
from unmodeled.core.errors import ConfigError
from unmodeled.datasets.bodies import Body

__all__ = ["ZonalReach", "hill_radius", "zonal_reach"]


def hill_radius(body: Body) -> float:
    """Return a (GM / 3 GM_sun)^(1/3) in metres, a the semi-major axis about the Sun.

    Source: [MurrayDermott1999].

    Raises
    ------
    ConfigError
        If the card gives no orbit about the Sun.
    """
    if body.heliocentric_orbit is None:
        raise ConfigError(
            f"body {body.name} has no heliocentric_orbit, and so no Hill radius",
            allowed="a body card with heliocentric_orbit, such as bennu",
        )
    a = body.heliocentric_orbit.semi_major_axis
    return float(a * (body.gm / (3 * GM_OF["sun"].value)) ** (1 / 3))


@dataclass(frozen=True)
class ZonalReach:
    """Contours of the zonal terms.

    Parameters
    ----------
    body : Body
        Whose.
    hill_radius : float
        m.
    share : float
        Of the specific potential at the Hill radius that a term has on its contour.
    colatitude : ndarray (m,)
        From the pole, rad, 0 to pi.
    radius : dict of int to ndarray (m,)
        By degree, m; zero where the Legendre polynomial is.
    """

    body: Body
    hill_radius: float
    share: float
    colatitude: Array
    radius: dict[int, Array]

    def largest(self, degree: int) -> float:
        """Largest distance of a contour from the centre, Brillouin radii."""
        return float(self.radius[degree].max()) / self.body.brillouin_radius


def zonal_reach(body: Body, share: float = 0.1, count: int = 721) -> ZonalReach:
    r"""Return where each zonal term has a given share of the potential at the Hill radius.

    .. math::
        |u_n| = \frac{GM}{r} |J_n| \left(\frac{R}{r}\right)^n |P_n(\cos\theta)|
              = \text{share} \cdot \frac{GM}{r_H}

    solved for r. Inside the contour the term grows as r^-(n+1).

    Parameters
    ----------
    body : Body
        With zonals and an orbit about the Sun.
    share : float
        0.1 in the paper.
    count : int
        Evenly spaced co-latitudes; the zeros of the polynomials are added.

    Raises
    ------
    ConfigError
        If the card gives no zonals, or no orbit about the Sun, or the share is not positive.
    """
    zonals = {n: j for n, j in body.zonal_unnormalised().items() if j != 0}
    if not zonals:
        raise ConfigError(f"body {body.name} has no zonals", do="choose a body that has")
    if not share > 0:
        raise ConfigError(f"share is {share}", allowed="a number > 0")
    hill = hill_radius(body)
    # The zeros of the polynomials too, so that each lobe closes at the centre.
    zeros = [np.arccos(roots_legendre(n)[0]) for n in zonals]
    theta = np.unique(np.concatenate([np.linspace(0.0, np.pi, count), *zeros]))
    ratio = {
        n: abs(j) * np.abs(eval_legendre(n, np.cos(theta))) * hill / (share * body.reference_radius)
        for n, j in zonals.items()
    }
    radius = {n: body.reference_radius * x ** (1 / (n + 1)) for n, x in ratio.items()}
    return ZonalReach(body, hill, share, theta, radius)
