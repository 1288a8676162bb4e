"""Captions and alternative texts, written from the settings in force."""

from __future__ import annotations

import math

from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.pipeline.use_check import point_mass_summaries
from unmodeled.reports.data_words import elsewhere, spans
from unmodeled.reports.figures.acceleration_curves import shown_periods
from unmodeled.reports.numbers import number

__all__ = ["caption"]


def caption(name: str, result: CharacterizationResult) -> tuple[str, str]:
    """Return alternative text and caption of a figure.

    Parameters
    ----------
    name : str
        Name of the figure: ``"error-summary"``, ``"error-against-radius"``,
        ``"acceleration-curves"``, ``"flight-error"``, ``"calibration"`` or ``"trajectories"``.
    result : CharacterizationResult
        The settings are read from it.

    Raises
    ------
    KeyError
        For an unknown name.
    """
    alt, text = {
        "error-summary": _summary,
        "error-against-radius": _radius,
        "acceleration-curves": _curves,
        "flight-error": _flight,
        "calibration": _calibration,
        "trajectories": _trajectories,
    }[name](result)
    return alt, text


def _summary(result: CharacterizationResult) -> tuple[str, str]:
    reference = point_mass_summaries(result.data)["extrapolation"].median
    return (
        "Dot-and-whisker chart of the fractional acceleration errors of all learners; the table "
        "below holds the numbers",
        "Fractional acceleration error of each learner on its training samples, on held-out "
        f"samples of the same orbit (interpolation) and {elsewhere(result)} (extrapolation): "
        "median, quartiles and worst, sorted by extrapolation median. The dotted line is the "
        f"extrapolation median of the bare known point mass, {number(reference)}: a marker to the "
        "right of it is worse than having learned nothing. " + _basis(result),
    )


def _radius(result: CharacterizationResult) -> tuple[str, str]:
    return (
        "Fractional acceleration error against radius, a panel for each learner",
        "Fractional acceleration error of every sample against its distance from the centre, all "
        "panels on the same axes. One Brillouin radius is "
        f"{number(result.data.units.length, 4)} m; every sample lies outside the Brillouin sphere "
        "or on it. Errors too small for the axis lie on its lower edge, infinite ones on the upper "
        "edge, with their number. " + _basis(result),
    )


def _curves(result: CharacterizationResult) -> tuple[str, str]:
    return (
        "Curves of true and predicted acceleration in three dimensions",
        "Acceleration along the training orbit (left) and along the first extrapolation orbit "
        f"(right), the first {shown_periods(result):.3g} periods at most: true in black, predicted "
        "in the learner's colour. Circles mark the start, triangles the end. Lines between the "
        "samples are interpolated for drawing.",
    )


def _flight(result: CharacterizationResult) -> tuple[str, str]:
    longest = max(result.config.flight.periods)
    floor = result.flight_floor
    end = (
        f"The thin dotted line at {number(floor)} m is the largest error of flying the true field "
        "with the same solver: differences below it mean nothing."
        if math.isfinite(floor)
        else "The data is measured, so the solver's own share is not known."
    )
    return (
        "Position error against time for flights with each learned model",
        "Distance between the orbit flown with each learned model from the true initial state and "
        f"the true orbit, over {longest:g} Kepler period{'s' if longest != 1 else ''}. A cross "
        "marks a flight that ended early (impact, escape, or a field that is not finite). " + end,
    )


def _calibration(result: CharacterizationResult) -> tuple[str, str]:
    return (
        "Coverage of predicted intervals, and actual error against predicted sigma",
        "Left: share of acceleration components whose error lies inside the predicted interval, "
        "against the share that should; markers at 68.3 % and 95 %. Below the diagonal the model "
        "is over-confident, above it cautious. Right: actual error of each component against its "
        "predicted standard deviation; about two thirds of the points should lie below the line.",
    )


def _trajectories(result: CharacterizationResult) -> tuple[str, str]:
    train, others = spans(result)
    many = result.data.training_orbits > 1
    orbits, on = ("orbits", "them") if many else ("orbit", "it")
    return (
        "Three-dimensional view of the training orbit, the extrapolation orbits and the body",
        f"The training {orbits} over {train}, the held-out samples on {on}, and the extrapolation "
        f"{'orbit' if len(result.data.extrapolation_orbits) == 1 else 'orbits'} over {others}, "
        "inertial axes. "
        f"The sphere is the Brillouin sphere of radius {number(result.data.units.length, 4)} m.",
    )


def _basis(result: CharacterizationResult) -> str:
    data = result.data
    count = len(data.extrapolation_orbits)
    noise = data.noise
    if noise.state == 0 and noise.acceleration == 0:
        level = "no noise"
    else:
        level = (
            f"noise of {number(noise.state * data.units.length)} m and "
            f"{number(noise.acceleration * data.units.acceleration)} m/s² in training"
        )
    return (
        f"{len(data.train)} training, {len(data.interpolation)} interpolation and "
        f"{len(data.extrapolation)} extrapolation samples "
        f"({count} orbit{'s' if count > 1 else ''}), {level}."
    )
