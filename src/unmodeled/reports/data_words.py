"""What the results rest on, in words: orbits, samples, periods, noise."""

from __future__ import annotations

import numpy as np

from unmodeled.core.words import listed
from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.reports.numbers import number, seconds_text

__all__ = ["data_sentences", "elsewhere", "noise_sentence", "spans"]

_FEW_ORBITS = 30


def elsewhere(result: CharacterizationResult) -> str:
    """Return what extrapolation means here, to follow "worse": "on other orbits" or the like."""
    if _later(result):
        return "on later revolutions"
    return "on another orbit" if len(result.data.extrapolation_orbits) == 1 else "on other orbits"


def spans(result: CharacterizationResult) -> tuple[str, str]:
    """Return the length of the training orbit and of the others, in periods and time."""

    def span(k: int) -> tuple[float, float]:
        orbit, period = result.data.orbits[k], result.data.periods[k]
        # The last sample stands for the time to the next one, as 10 periods of 25 samples do.
        seconds = float(orbit.times[-1] - orbit.times[0]) * len(orbit) / (len(orbit) - 1)
        return seconds / period, seconds

    def text(low: tuple[float, float], high: tuple[float, float]) -> str:
        periods = sorted({f"{p[0]:.3g}" for p in (low, high)}, key=float)
        times = [seconds_text(s) for s in sorted((low[1], high[1]))]
        return f"{' to '.join(periods)} periods ({' to '.join(dict.fromkeys(times))})"

    others = [span(k) for k in result.data.extrapolation_orbits]
    return text(span(0), span(0)), text(
        min(others, key=lambda s: s[1]), max(others, key=lambda s: s[1])
    )


def data_sentences(result: CharacterizationResult) -> list[str]:
    """Return what was trained and tested on, with the caution that few orbits need."""
    data = result.data
    train, others = spans(result)
    count = len(data.extrapolation_orbits)
    if _later(result):
        orbits = f"later revolutions of the same orbit over {others}"
    else:
        orbits = f"{count} other orbit{'s' if count > 1 else ''} over {others}"
    trained, them = "one orbit", "it"
    if data.training_orbits > 1:
        trained, them = f"{data.training_orbits} orbits", "them"
    sentences = [
        f"Trained on {len(data.train)} samples of {trained} over {train}; tested on "
        f"{len(data.interpolation)} held-out samples of {them} (interpolation) and on "
        f"{len(data.extrapolation)} samples of {orbits} (extrapolation)."
    ]
    if data.spin_rate:
        axes = data.frame.replace("_", "-")
        sentences.append(
            f"Truth: {data.facts['truth']}; axes of the samples: {axes}, spin "
            f"{number(data.spin_rate, 4)} rad/s."
        )
    elif result.config.data.effects:
        sentences.append(f"Truth: {data.facts['truth']}.")
    if data.axes_rate is not None:
        sentences.append(
            f"The axes turn, instead, with the spin estimated from the noisy training samples: "
            f"{number(data.axes_rate, 7)} rad/s; other orbits are tested in the same axes."
        )
    sigma = data.orbits[0].acceleration_sigma
    if sigma > 0:
        size = _median_acceleration(result)
        sentences.append(
            "The accelerations come from the tabulated states; their error is about "
            f"{number(sigma)} m/s² (one sigma), {number(sigma / size)} of the acceleration: "
            "differences below that mean nothing."
        )
    if _later(result):
        sentences.append(
            "Later revolutions of the same orbit stay near the training orbit: a mild test of "
            "robustness. Give an arc of another orbit as data.extrapolation_trajectory for a "
            "hard one."
        )
    elif count < _FEW_ORBITS:
        sentences.append(
            "Robustness depends on the orbits that were drawn; "
            f"with {trained.replace('orbit', 'training orbit')} and {count} "
            f"other{'s' if count > 1 else ''} "
            "these numbers describe these orbits and not the method. Sweep over initial "
            "conditions before choosing a method."
        )
    sentences.append(noise_sentence(result))
    if result.config.training == "trajectory_consistent":
        sentences.append(
            "The learners did not see the samples but the states and accelerations of an orbit "
            "fitted to the noisy positions (training: trajectory_consistent). Its fit estimates "
            "harmonics of low degree, so that learners can come out alike. The uncertainty that "
            "they state leaves out that of the orbit's field, and is too small."
        )
    return sentences


def noise_sentence(result: CharacterizationResult) -> str:
    """Return the noise in SI and as a share of the medians, and what errors are counted from."""
    data, noise = result.data, result.data.noise
    truth = "the truth" if result.config.data.simulated else "the best knowledge of the orbit"
    end = f" Errors are counted from {truth}, not from the noisy samples."
    seen = noise.velocity if any("velocity" in n for n in _inputs(result)) else 0.0
    if noise.state == 0 and noise.acceleration == 0 and seen == 0:
        return f"No noise was added. Errors are counted from {truth}."
    radius = float(np.median(np.linalg.norm(data.train.positions, axis=1)))
    parts = []
    if noise.state > 0:
        parts.append(
            f"{number(noise.state * data.units.length)} m in position "
            f"({number(100 * noise.state / radius)} % of the median radius)"
        )
    if seen > 0:
        parts.append(f"{number(seen * data.units.velocity)} m/s in velocity")
    if noise.acceleration > 0:
        sigma = noise.acceleration * data.units.acceleration
        parts.append(
            f"{number(sigma)} m/s² in acceleration "
            f"({number(100 * sigma / _median_acceleration(result))} % of the median acceleration)"
        )
    return f"Noise on each axis, one sigma: {listed(parts)}, {noise.draws} draws.{end}"


def _inputs(result: CharacterizationResult) -> set[str]:
    return {name for learner in result.config.learners for name in learner.inputs}


def _median_acceleration(result: CharacterizationResult) -> float:
    """Median size of the training accelerations, m/s2."""
    sizes = np.linalg.norm(result.data.train.accelerations, axis=1)
    return float(np.median(sizes)) * result.data.units.acceleration


def _later(result: CharacterizationResult) -> bool:
    return str(result.data.facts.get("extrapolation", "")).startswith("later revolutions")
