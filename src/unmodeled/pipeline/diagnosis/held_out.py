"""How well a model predicts arcs that it was not fitted to."""

from __future__ import annotations

from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.orbit_fit import fit_orbits

__all__ = ["held_out_rms"]


def held_out_rms(case: Case) -> float | None:
    """Return the residual RMS of the held-out arcs in sigmas; None if there are none.

    Their initial states are fitted, nothing else: the parameters are those of the case.
    """
    if not case.held_out:
        return None
    fit = fit_orbits(
        case.dynamics,
        case.held_out,
        instruments=case.instruments,
        instrument_values=case.instrument_values,
    )
    return fit.rms_in_sigmas
