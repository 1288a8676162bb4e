"""When does each of many orbits first enter a sphere?"""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.physics import compiled
from unmodeled.models.physics.system import System

__all__ = ["first_entry"]

#: heyoka's outcomes: the terminal event i is reported as -i - 1.
_ENTERED, _STEPPED, _TIME_LIMIT = -1, -4294967297, -4294967299
#: Each orbit is followed in this many stretches, so that no lane waits long for another.
_STRETCHES = 10


def first_entry(
    system: System, pars: Array, states: Array, durations: Array, radius: float
) -> Array:
    """Follow orbits side by side, as many as the processor has lanes.

    A lane whose orbit has ended takes the next one. An orbit's result does not depend on its
    neighbours, to the last bit.

    Parameters
    ----------
    system : System
        The force model.
    pars : ndarray (p,)
        Its parameter values.
    states : ndarray (b, 6)
        States at time zero.
    durations : ndarray (b,)
        How long to follow each orbit.
    radius : float
        Radius of the sphere.

    Returns
    -------
    ndarray (b,)
        Time of entry; 0 for an orbit that starts inside; NaN for one that stays outside.

    Raises
    ------
    NumericalError
        If an integration breaks down outside the sphere.
    """
    entry = np.full(len(states), np.nan)
    inside = np.linalg.norm(states[:, :3], axis=1) <= radius
    entry[inside] = 0.0
    queue = list(np.flatnonzero(~inside)[::-1])
    if not queue:
        return entry
    ta = compiled.batch_integrator(system)
    lanes = ta.batch_size
    ta.pars[:] = np.append(pars, radius)[:, None]
    ta.state[:] = states[queue[-1]][:, None]  # an idle lane rests on any valid state
    member = np.full(lanes, -1)
    stretch = np.zeros(lanes, dtype=int)
    clock, clock_rest = np.zeros(lanes), np.zeros(lanes)
    target = np.zeros(lanes)
    while True:
        for lane in range(lanes):
            orbit = member[lane]
            if orbit >= 0 and clock[lane] >= target[lane]:  # a stretch is done: the next
                stretch[lane] += 1
                target[lane] = durations[orbit] * (stretch[lane] / _STRETCHES)
            elif orbit < 0:
                clock[lane] = clock_rest[lane] = target[lane] = 0.0
                if queue:
                    orbit = member[lane] = queue.pop()
                    ta.state[:, lane] = states[orbit]
                    stretch[lane] = 1
                    target[lane] = durations[orbit] / _STRETCHES
        if np.all(member < 0):
            return entry
        # heyoka keeps time in two doubles; dropping the second would make a result depend on
        # when a neighbour stopped.
        ta.set_dtime(clock, clock_rest)
        ta.propagate_until(target)
        clock, clock_rest = (np.array(t) for t in ta.dtime)
        for lane, (outcome, *_) in enumerate(ta.propagate_res):
            orbit, code = member[lane], int(outcome)
            if orbit < 0:
                continue
            if code == _ENTERED:
                entry[orbit] = clock[lane]
                member[lane] = -1
            elif code == _TIME_LIMIT and stretch[lane] == _STRETCHES:
                member[lane] = -1
            elif code not in (_STEPPED, _TIME_LIMIT):
                raise NumericalError(
                    f"orbit {orbit} could not be integrated ({outcome})",
                    do="check its initial state",
                )
