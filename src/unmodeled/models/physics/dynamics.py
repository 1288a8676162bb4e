"""A force model with numbers: accelerations, partials, orbits, collisions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from heyoka import taylor_outcome

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import ConfigError, DataError, OrbitError, nearest
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics import compiled
from unmodeled.models.physics.collision import first_entry
from unmodeled.models.physics.continuous_orbit import ContinuousOrbit
from unmodeled.models.physics.effect import Effect
from unmodeled.models.physics.orientation import Orientation
from unmodeled.models.physics.runtime_series import runtime_series
from unmodeled.models.physics.system import ORIENTATION, System
from unmodeled.models.physics.tracks import Tracks
from unmodeled.models.physics.variational_orbit import VariationalOrbit

__all__ = ["Dynamics"]

#: Steps after which an orbit is given up: about 2,500 revolutions. One that falls towards a centre
#: takes ever smaller steps, and each is kept (1 kB) where states are asked for later.
_MOST_STEPS = 100_000


class Dynamics:
    """Sum of effects about one body, with values of its parameters.

    Everything is in one consistent set of units: SI when the values are SI. Immutable.

    Parameters
    ----------
    effects : iterable of Effect
        The forces.
    values : mapping of str to float
        Parameter values; those not given keep the effect's default.
    spinning : bool
        True if effects in body axes turn with the parameters ``spin_rate`` (rad per unit time,
        about z) and ``prime_meridian`` (rad).
    tracks : Tracks, optional
        Positions of the other bodies that the effects ask for; orbits stay inside its interval.
    orientation : Orientation, optional
        How the body is turned, in place of ``spinning``: its pole need not be the inertial z.

    Raises
    ------
    ConfigError
        Unknown parameter (the nearest name is suggested), value out of bounds, term twice, a body
        without a track, or tracks and an orientation on different intervals.

    Examples
    --------
    >>> from unmodeled.models.physics import Dynamics, PointMass
    >>> Dynamics([PointMass()], {"GM": 4.0}).acceleration([[2.0, 0.0, 0.0]])
    array([[-1., -0., -0.]])
    """

    def __init__(
        self,
        effects: Iterable[Effect],
        values: Mapping[str, float] | None = None,
        *,
        spinning: bool = False,
        tracks: Tracks | None = None,
        orientation: Orientation | None = None,
    ) -> None:
        effects = tuple(effects)
        needed = {name for effect in effects for name in effect.bodies}
        self.tracks, self.orientation = tracks, orientation
        self.system = System(
            effects,
            spinning or orientation is not None,
            tilt_degree=orientation.degree if orientation else None,
            track_degree=tracks.degree if tracks and needed else 0,
        )
        given = dict(values or {})
        if orientation is not None:
            given = {
                "spin_rate": orientation.spin_rate,
                "prime_meridian": orientation.prime_meridian,
            } | given
        known = {p.name for p in self.system.parameters}
        for name in given:
            if name not in known:
                raise ConfigError(f'unknown parameter "{name}"', do=nearest(name, known))
        self._parameters = tuple(
            p.with_value(given.get(p.name, p.value)) for p in self.system.parameters
        )
        series = runtime_series(self.system, needed, tracks, orientation)
        self._pars = np.array([*(p.value for p in self._parameters), *series])

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects."""
        return self.system.effects

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters with their values."""
        return self._parameters

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by name."""
        return {p.name: p.value for p in self._parameters}

    def with_values(self, values: Mapping[str, float]) -> Dynamics:
        """Return the same model with some values changed; nothing is compiled again."""
        merged = self.values | dict(values)
        return Dynamics(
            self.effects,
            merged,
            spinning=self.system.spinning,
            tracks=self.tracks,
            orientation=self.orientation,
        )

    def with_effects(self, effects: Iterable[Effect], values: Mapping[str, float]) -> Dynamics:
        """Return a model of other effects in the same surroundings."""
        chosen = System(tuple(effects), self.system.spinning, self.system.tilt_degree)
        known = {p.name for p in chosen.parameters}
        merged = {k: v for k, v in (self.values | dict(values)).items() if k in known}
        return Dynamics(
            chosen.effects,
            merged,
            spinning=self.system.spinning,
            tracks=self.tracks,
            orientation=self.orientation,
        )

    # Pointwise -------------------------------------------------------------------------------

    def acceleration(self, points: Any, times: Any = 0.0) -> Array:
        """Return accelerations (n, 3), inertial components.

        Parameters
        ----------
        points : array_like (n, 3) or (n, 6)
            Positions, or states; a model that needs the velocity refuses bare positions.
        times : float or array_like (n,)
            Time since the epoch; matters for spinning bodies and moving sources.
        """
        return self._evaluate(compiled.acceleration_function(self.system), points, times)

    def state_partials(self, points: Any, times: Any = 0.0) -> Array:
        """Return d acceleration / d state, shape (n, 3, 6)."""
        # Effect by effect: a model with one effect more compiles the derivatives of that one only.
        states = self._moving(points)
        total = np.zeros((len(states), 18))
        for part in self._parts:
            function = compiled.state_partials_function(part.system)
            total += part._evaluate(function, states, times)
        return total.reshape(-1, 3, 6)

    def parameter_partials(self, points: Any, names: Sequence[str], times: Any = 0.0) -> Array:
        """Return d acceleration / d parameter, shape (n, 3, p), in the order of ``names``."""
        self._check_names(names)
        states = self._moving(points)
        out = np.zeros((len(states), 3, len(names)))
        for part in self._parts:
            known = {p.name for effect in part.effects for p in effect.parameters}
            if part.effects[0].axes == "body":
                known |= {p.name for p in ORIENTATION} & set(part.values)
            own = tuple(n for n in names if n in known)
            if own:
                function = compiled.parameter_partials_function(part.system, own)
                at = [names.index(n) for n in own]
                out[:, :, at] += part._evaluate(function, states, times).reshape(-1, 3, len(own))
        return out

    def potential(self, points: Any, times: Any = 0.0) -> Array:
        """Return the force function U (acceleration = +grad U), shape (n,)."""
        return self._evaluate(compiled.potential_function(self.system), points, times)[:, 0]

    # Orbits ----------------------------------------------------------------------------------

    def propagate(self, state: Any, times: Any) -> Array:
        """Propagate one orbit.

        Parameters
        ----------
        state : array_like (6,)
            Position and velocity, inertial, at ``times[0]``.
        times : array_like (n,)
            Times since the epoch, strictly increasing or strictly decreasing.

        Returns
        -------
        ndarray (n, 6)
            States at ``times``; the first is ``state``.

        Raises
        ------
        OrbitError
            If the orbit cannot be continued (it reaches a singularity of the field).
        """
        ta = compiled.integrator(self.system)
        return self._run(ta, as_array(state, (6,), "state"), self._grid(times))

    def fly(
        self, state: Any, epoch: float, start: float, end: float, most_steps: int | None = None
    ) -> ContinuousOrbit:
        """Propagate one orbit once, to be asked for its states at any time of an interval.

        Parameters
        ----------
        state : array_like (6,)
            Position and velocity, inertial, at ``epoch``.
        epoch : float
            Time since the epoch of the model, s; in the interval.
        start, end : float
            Interval, s.
        most_steps : int, optional
            Steps after which the orbit is given up; 100,000 if not given.

        Raises
        ------
        OrbitError
            If the orbit cannot be continued.
        """
        if not start <= epoch <= end:
            raise ConfigError(
                f"an orbit from {start:.6g} s to {end:.6g} s with its state at {epoch:.6g} s",
                allowed="start <= epoch <= end",
            )
        state = as_array(state, (6,), "state")
        self._grid([start, end] if end > start else [start])
        ta = compiled.integrator(self.system)
        compiled.STOPS.clear()
        before, after = (
            self._follow(ta, state, epoch, to, most_steps or _MOST_STEPS) if to != epoch else None
            for to in (start, end)
        )
        stops = tuple(sorted(compiled.STOPS))
        return ContinuousOrbit(epoch, state, start, end, before, after, stops)

    def propagate_variational(
        self, state: Any, times: Any, parameters: Sequence[str] = ()
    ) -> VariationalOrbit:
        """Propagate one orbit with its state-transition matrix and parameter sensitivities.

        Parameters
        ----------
        state, times
            As in `propagate`.
        parameters : sequence of str
            Names of the parameters to differentiate by.
        """
        self._check_names(parameters)
        names = tuple(parameters)
        ta = compiled.variational_integrator(self.system, names)
        start = as_array(state, (6,), "state")
        p = len(names)
        partials = np.hstack([np.eye(6), np.zeros((6, p))])
        out = self._run(ta, np.concatenate([start, partials.ravel()]), self._grid(times))
        block = out[:, 6:].reshape(-1, 6, 6 + p)
        return VariationalOrbit(out[:, :6], block[:, :, :6], block[:, :, 6:], names)

    def first_collision(self, states: Any, durations: Any, radius: float) -> Array:
        """Return when each orbit first enters a sphere.

        Orbits are integrated side by side, as many as the processor has lanes; a lane whose orbit
        has ended takes the next one, so a result does not depend on its neighbours.

        Parameters
        ----------
        states : array_like (b, 6)
            States at time zero.
        durations : array_like (b,)
            How long to follow each orbit, > 0.
        radius : float
            Radius of the sphere about the origin.

        Returns
        -------
        ndarray (b,)
            Time of entry; 0 for an orbit that starts inside; NaN for one that stays outside.

        Raises
        ------
        NumericalError
            If an integration breaks down outside the sphere.
        """
        states = as_array(states, ("b", 6), "states")
        durations = as_array(durations, (len(states),), "durations")
        if np.any(durations <= 0):
            raise ConfigError(f"duration is {durations.min()}", allowed="numbers > 0")
        if not radius > 0:
            raise ConfigError(f"collision radius is {radius}", allowed="a number > 0")
        return first_entry(self.system, self._pars, states, durations, radius)

    # Shared ----------------------------------------------------------------------------------

    def _check_names(self, names: Sequence[str]) -> None:
        known = [p.name for p in self._parameters]
        for name in names:
            if name not in known:
                raise ConfigError(f'unknown parameter "{name}"', do=nearest(name, known))
        if len(set(names)) < len(names):
            raise ConfigError(f"parameters {', '.join(names)}", allowed="each name once")

    @cached_property
    def _parts(self) -> tuple[Dynamics, ...]:
        """Models of one effect each, in the same surroundings; their accelerations add up."""
        return tuple(self.with_effects([effect], {}) for effect in self.effects)

    def _moving(self, points: Any) -> Array:
        """States (n, 6); positions are at rest where no effect looks at the velocity."""
        points = np.asarray(points, dtype=np.float64)
        if self.system.position_only and points.shape[-1:] != (6,):
            points = as_array(points, ("n", 3), "positions")
            points = np.hstack([points, np.zeros_like(points)])
        return as_array(points, ("n", 6), "states")

    def _evaluate(self, function: Any, points: Any, times: Any) -> Array:
        states = self._moving(points)
        n = len(states)
        if np.ndim(times):
            times = as_array(times, (n,), "times")
        inputs = np.ascontiguousarray(states.T)
        # heyoka counts parameters up to the last one that the expression uses.
        used = self._pars[: function.nparams, None]
        out: Array = function(
            inputs=inputs,
            pars=np.broadcast_to(used, (len(used), n)).copy() if len(used) else None,
            time=np.broadcast_to(np.asarray(times, dtype=np.float64), (n,)).copy(),
        )
        return np.ascontiguousarray(out.T)

    def _grid(self, times: Any) -> Array:
        grid = as_array(times, ("n",), "times")
        if not len(grid):
            raise DataError("no times", allowed="at least one")
        # Backwards in time is as good.
        check_increasing(grid if grid[-1] >= grid[0] else -grid, "times")
        if self.tracks is not None and self.system.bodies:
            self.tracks.check(grid)
        return grid

    def _run(self, ta: Any, state: Array, grid: Array) -> Array:
        compiled.STOPS.clear()
        self._set(ta, state, float(grid[0]))
        outcome, *_, states = ta.propagate_grid(grid, max_steps=4 * _MOST_STEPS)
        if len(states) < len(grid) or not np.all(np.isfinite(states)):
            raise _breakdown(ta, outcome, 4 * _MOST_STEPS)
        return np.array(states)

    def _follow(self, ta: Any, state: Array, epoch: float, to: float, most: int) -> Any:
        self._set(ta, state, epoch)
        outcome, *_, orbit, _ = ta.propagate_until(to, c_output=True, max_steps=most)
        if outcome != taylor_outcome.time_limit or not np.all(np.isfinite(ta.state)):
            raise _breakdown(ta, outcome, most)
        return orbit

    def _set(self, ta: Any, state: Array, time: float) -> None:
        ta.time = time
        ta.state[:] = state
        ta.pars[:] = self._pars[: len(ta.pars)]
        if ta.with_events:
            ta.reset_cooldowns()


def _breakdown(ta: Any, outcome: Any, most: int = _MOST_STEPS) -> OrbitError:
    if outcome == taylor_outcome.step_limit:
        return OrbitError(
            f"the orbit is not followed beyond t = {float(ta.time):.6g} after {most} steps",
            do="check that it does not circle a body at almost no distance; else cut it into arcs",
        )
    return OrbitError(
        f"the orbit breaks down at t = {float(ta.time):.6g} ({outcome})",
        do="check that it does not pass through the centre of the field",
    )
