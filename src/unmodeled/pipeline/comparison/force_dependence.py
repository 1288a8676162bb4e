"""On which inputs does the missing force depend? Has it a curl, or a period of its own?"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from unmodeled.pipeline.comparison.force_inference import (
    ForceData,
    Smooth,
    gradient_root,
    smooth_root,
    wave_root,
)
from unmodeled.pipeline.comparison.force_inputs import Axes, ForceInputs, input_sets
from unmodeled.pipeline.comparison.left_out import left_out_errors, skill_and_error, stretches

__all__ = ["Dependence", "Option", "dependence"]

#: Length scales tried, in root mean squares of the centred inputs.
_LENGTHS = (0.1, 0.25, 0.5, 1.0, 2.0)
#: On the unit circle, with as many harmonics as the shortest needs to 1 %.
_ARCS = (0.35, 0.7, 1.4)
_HARMONICS, _SEARCHED = 8, 5
#: Trial frequencies: steps in the whole span, at most this many; nodes in the shortest period.
_STEPS, _TRIALS, _SHORTEST = 12, 600, 8
#: Fewer turns than this in the longest arc are no repetition.
_TURNS = 2.0
#: ln of a Bayes factor that counts: curl or no curl, one set of inputs or another.
_CURL = _TIE = 3.0


@dataclass(frozen=True)
class Option:
    """A set of inputs, weighed.

    Parameters
    ----------
    inputs : ForceInputs
        The set.
    log_bayes : float
        ln of the Bayes factor against no force; length scale, size and period unknown.
    skill, skill_error : float
        Share of the sum of squares of left-out stretches that is explained, and its standard
        error.
    smooth : Smooth
        At the likeliest length scale.
    curl_log_bayes : float or None
        ln of the Bayes factor of a field without curl against any field; None where the inputs
        are no place.
    """

    inputs: ForceInputs
    log_bayes: float
    skill: float
    skill_error: float
    smooth: Smooth = field(repr=False)
    curl_log_bayes: float | None = None


@dataclass(frozen=True)
class Dependence:
    """What the force depends on.

    Parameters
    ----------
    options : tuple of Option
        All sets of inputs, the chosen one first.
    possible_skill : float
        What noise allows.
    """

    options: tuple[Option, ...]
    possible_skill: float

    @property
    def best(self) -> Option:
        """The chosen one."""
        return self.options[0]

    @property
    def rivals(self) -> tuple[str, ...]:
        """Other inputs, in words, that explain the residuals as well (20 to 1)."""
        near = (o for o in self.options[1:] if o.log_bayes > self.best.log_bayes - _TIE)
        return tuple(dict.fromkeys(o.inputs.title for o in near))

    @property
    def curl_free(self) -> bool | None:
        """Whether a field needs no curl; None: it is no field, or it cannot be told."""
        ratio = self.best.curl_log_bayes
        return None if ratio is None or abs(ratio) < _CURL else ratio > 0

    def table(self) -> pd.DataFrame:
        """Return a row a set: inputs, axes, log_bayes, skill, skill_error."""
        return pd.DataFrame(
            {
                "inputs": [o.inputs.title for o in self.options],
                "axes": [o.inputs.axes for o in self.options],
                "log_bayes": [o.log_bayes for o in self.options],
                "skill": [o.skill for o in self.options],
                "skill_error": [o.skill_error for o in self.options],
            }
        )


def dependence(data: ForceData) -> Dependence:
    """Weigh what the force may be a function of.

    Parameters
    ----------
    data : ForceData
        Residuals, and what a force does to them.

    Notes
    -----
    For each set of inputs the force is a Gaussian process of them, inferred from the residuals
    themselves: states and free parameters are projected out, nothing is differentiated. The set
    with the most evidence is chosen (a force that is a function of place is also some function of
    time, and pays for that freedom); of sets that cannot be told apart, one of place. Its skill
    is that on whole stretches of time, left out in turn and predicted from the rest.
    """
    parts = list(stretches(data.lin))
    none = np.zeros((len(data.residual), 0))
    nothing = left_out_errors(data.known, none, data.residual, parts)
    options = []
    for inputs in input_sets(data.lin):
        options.append(_weighed(data, inputs))
    for axes in ("inertial", "rtn"):
        found = _periodic(data, axes)
        options += [found] if found is not None else []
    finished = []
    for inputs, logs, smooth, curl in options:
        rows = data.rows(data.turn(inputs), smooth.root @ smooth.found.posterior_root())
        errors = left_out_errors(data.known, rows, data.residual, parts)
        finished.append(
            Option(
                inputs, logs, *skill_and_error(errors, nothing), smooth=smooth, curl_log_bayes=curl
            )
        )
    top = max(o.log_bayes for o in finished)
    near = [o for o in finished if o.log_bayes > top - _TIE]
    # Where these data cannot tell, a force is a function of place.
    best = max(near, key=lambda o: (o.inputs.is_place, o.log_bayes))
    rest = sorted((o for o in finished if o is not best), key=lambda o: -o.log_bayes)
    noise = min(o.smooth.found.variance for o in near)
    possible = 1.0 - len(data.residual) * noise / float(nothing.sum())
    return Dependence((best, *rest), float(max(possible, 0.0)))


_Weighed = tuple[ForceInputs, float, Smooth, float | None]


def _weighed(data: ForceData, inputs: ForceInputs) -> _Weighed:
    x, own = data.inputs(inputs), data.turned(data.turn(inputs))
    spread = float(np.sqrt(np.mean((x - x.mean(axis=0)) ** 2)))
    tried = [data.weigh(own, smooth_root(x, length * spread)) for length in _LENGTHS]
    best = max(tried, key=lambda s: s.found.logs.max(initial=0.0))
    logs = _mean([s.found.log_bayes for s in tried])
    curl = None
    if inputs.is_place:
        free = [data.weigh(own, gradient_root(x, length * spread)) for length in _LENGTHS]
        curl = _mean([s.found.log_bayes for s in free]) - logs
    return inputs, logs, best, curl


def _periodic(data: ForceData, axes: Axes) -> _Weighed | None:
    """Weigh a force that repeats with a period of its own, constant in space or in the orbit."""
    span = float(np.ptp(data.times))
    longest = max(float(np.ptp(a.partials.nodes)) for a in data.lin.arcs)
    step = float(np.median(np.diff(data.times)))
    lowest, highest = _TURNS / longest, 1.0 / (_SHORTEST * step)
    count = int(min(np.ceil((highest - lowest) * _STEPS * span), _TRIALS))
    if count < 2:
        return None
    frequencies = lowest + np.arange(count) / (_STEPS * span)
    own = data.turned(data.turn(ForceInputs("time", axes)))
    length = _ARCS[0]
    logs = []
    for f in frequencies:
        root = wave_root(2 * np.pi * f * data.times, length, _SEARCHED)
        logs.append(data.weigh(own, root).found.log_bayes)
    top = int(np.argmax(logs))
    finer = frequencies[top] + np.linspace(-1, 1, 41) / (_STEPS * span)
    tried: list[tuple[float, float, Smooth]] = []
    for f in finer:
        for arc in _ARCS:
            smooth = data.weigh(own, wave_root(2 * np.pi * f * data.times, arc, _HARMONICS))
            tried.append((float(smooth.found.logs.max(initial=0.0)), float(f), smooth))
    _, f, best = max(tried, key=lambda t: t[0])
    evidence = float(np.logaddexp.reduce(logs) - np.log(count))
    fine = best.found.log_bayes - np.log(count)
    return ForceInputs("period", axes, period=1.0 / f), max(evidence, float(fine)), best, None


def _mean(logs: list[float]) -> float:
    return float(np.logaddexp.reduce(logs) - np.log(len(logs)))
