"""Answers to Figs. 1 and 4 of [Neamati2022]: the body's field and its collisions, no learners."""

from __future__ import annotations

import numpy as np
import pandas as pd

from unmodeled.pipeline.trends.collision_boundary import Boundary
from unmodeled.pipeline.trends.zonal_reach import ZonalReach
from unmodeled.reports.numbers import number
from unmodeled.reports.reproduction.compared import Found

__all__ = ["answer_fig1", "answer_fig4"]

# A boundary is called roughly linear if a straight line is wrong about fewer than this share.
_ROUGHLY = 0.05


def answer_fig1(reach: ZonalReach) -> dict[str, Found]:
    """Return what the zonal contours say."""
    radii = {n: reach.largest(n) for n in reach.radius}
    listed = ", ".join(f"J{n} {number(r, 3)}" for n, r in radii.items())
    inside = [f"J{n}" for n, r in radii.items() if r < 1]
    hill = reach.hill_radius
    remark = "The paper prints no Hill radius; ours has the semi-major axis of the body card."
    return {
        "share": Found(
            f"Hill radius {number(hill / 1e3, 3)} km, "
            f"{number(hill / reach.body.brillouin_radius, 3)} Brillouin radii; "
            f"{100 * reach.share:g} % of GM / r there",
            None,
            remark,
        ),
        "close": Found(
            f"largest radius of each contour, Brillouin radii: {listed}",
            max(radii.values()) < 0.1 * hill / reach.body.brillouin_radius,
            "Rule: all contours within a tenth of the Hill radius."
            + (f" {' and '.join(inside)} never leaves the Brillouin sphere." if inside else ""),
        ),
        "growth": Found(
            "a term falls as r^-(n+1)",
            False,
            "As printed, |u_n / u_H| would be raised to the power n+1; a zonal term itself is "
            "GM/r Jn (R/r)^n Pn, so that within the contour it grows as (r_contour / r)^(n+1). "
            "We read the caption so.",
        ),
    }


def answer_fig4(screened: pd.DataFrame, boundary: Boundary) -> dict[str, Found]:
    """Return what the screened initial conditions say."""
    hit = float(np.mean(screened["entry_periods"].notna()))
    b = boundary
    return {
        "linear": Found(
            f"e = {b.slope:.3f} a {'−' if b.intercept < 0 else '+'} {abs(b.intercept):.3f} is "
            f"wrong about {100 * b.wrong:.1f} % of {len(screened)} initial conditions "
            f"({100 * hit:.0f} % collide)",
            b.wrong < _ROUGHLY,
            f"Rule: wrong about less than {100 * _ROUGHLY:g} %. Kepler's boundary e = 1 − 1/a "
            f"bends and is wrong about {100 * b.wrong_kepler:.1f} %: "
            + ("it is the better one." if b.wrong_kepler < b.wrong else "the line is the better."),
        ),
        "others": Found(
            f"with the angles the share of errors goes from {100 * b.wrong_curved:.2f} to "
            f"{100 * b.wrong_other:.2f} %, likelihood-ratio P {number(b.p_other)}",
            b.p_other < 0.05 if len(screened) >= 1000 else None,
            "Rule: P < 0.05 beside a, e and a e, with 1,000 initial conditions or more. Of those "
            f"whose point-mass orbit stays outside the sphere {100 * b.hit_outside:.1f} % collide, "
            f"of those whose enters it {100 * b.free_inside:.1f} % never do.",
        ),
    }
