"""A fitted case, linearised: whitened residuals, and columns of anything that might act."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.datasets.measurement_effects import MeasurementEffect
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics, Effect, ImpulsiveManoeuvre
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.fit_problem import Arc, FitProblem, Point
from unmodeled.pipeline.orbit_fit import OrbitFit
from unmodeled.pipeline.partials import ArcPartials
from unmodeled.pipeline.transition import Indices

__all__ = ["ArcRows", "Linearisation"]

#: Columns whose part outside the known ones is below this share of themselves carry rounding only.
_EMPTY = 1e-9


@dataclass(frozen=True)
class ArcRows:
    """The rows of one arc in a `Linearisation`.

    Parameters
    ----------
    arc : Arc
        The arc.
    rows : slice
        Where its rows are.
    partials : ArcPartials
        How its orbit answers.
    sets : list of (Measurements, index, used)
        Measurements as the instruments make them, where their times are among those of
        ``partials``, and which of their components are used.
    """

    arc: Arc
    rows: slice
    partials: ArcPartials
    sets: list[tuple[Measurements, Indices, Array]]


class Linearisation:
    """Everything about a fitted case that is linear in small effects.

    Rows are measured components in sigmas, arc after arc, then one for each prior. The columns of
    the arcs' states and of the free parameters are the *known* columns: what they can absorb is
    projected out of residuals and candidates alike.

    Parameters
    ----------
    case : Case
        With its fit: `Case.at` of it, or the case that was fitted.
    fit : OrbitFit
        Its result.

    Attributes
    ----------
    residuals : ndarray (n,)
        Whitened, measured minus predicted.
    arcs : list of ArcRows
    model : Dynamics
        The fitted model.
    """

    def __init__(self, case: Case, fit: OrbitFit) -> None:
        self.case, self.fit = case, fit
        problem = FitProblem(
            case.dynamics, case.arcs, case.estimate, case.instruments, case.instrument_values
        )
        values = np.array([fit.values[n] for n in problem.names])
        point = Point(fit.states, values)
        self.model: Dynamics = problem.model(point)
        self.instrument_values = problem.instrument_values(point)
        used = iter(_masks(fit, case.arcs))
        self.arcs: list[ArcRows] = []
        residuals, states, shared, first = [], [], [], 0
        for a, partials, blocks in problem.linearised(point):
            sets, block_r, block_c = [], [], []
            for m, r, columns in blocks:
                mask = next(used)
                index = np.searchsorted(partials.times, m.times)
                sets.append((m, index, mask))
                block_r.append(r[mask])
                block_c.append(columns[mask])
            r, columns = np.concatenate(block_r), np.concatenate(block_c)
            self.arcs.append(ArcRows(case.arcs[a], slice(first, first + len(r)), partials, sets))
            first += len(r)
            residuals.append(r)
            states.append(columns[:, :6])
            shared.append(columns[:, 6:])
        # Priors are rows like any other: what the parameter should be, in sigmas.
        prior = np.sqrt(problem.prior)
        held = prior > 0
        residuals.append(((problem.first - values) * prior)[held])
        shared.append(np.diag(prior)[held])
        self.residuals = np.concatenate(residuals)
        self.measured = first
        self._blocks = states
        self._states = [_orthonormal(block) for block in states]
        known = np.concatenate(shared)
        self._shared = _orthonormal(self._without_states(known), known)
        self.freedom = len(self.residuals) - 6 * len(self.arcs) - len(problem.names)

    # Columns ---------------------------------------------------------------------------------

    def columns(
        self,
        effect: Effect | MeasurementEffect,
        values: Mapping[str, float],
        names: Sequence[str],
        *,
        elsewhere: bool = False,
    ) -> Array:
        """Return d whitened prediction / d parameter of an effect that is not in the model, (n, p).

        Parameters
        ----------
        effect : Effect or MeasurementEffect
            Its effect is linearised at ``values``.
        values : mapping of str to float
            Parameters of the effect; those of the model (GM, R_ref ...) are filled in.
        names : sequence of str
            The parameters to differentiate by.
        elsewhere : bool
            An effect that is in the model already is taken at ``values`` all the same: what it
            would do at another place.
        """
        if isinstance(effect, ImpulsiveManoeuvre):
            return self._kick(effect, values)
        if isinstance(effect, Effect):
            # A parameter of the model itself may stand in several of its effects.
            own = effect in self.model.effects and set(names) <= set(self.model.values)
            own = own and not elsewhere
            model = self.model if own else self.model.with_effects([effect], values)
            return self.force_columns(
                [
                    model.parameter_partials(a.partials.node_states, names, a.partials.nodes)
                    for a in self.arcs
                ]
            )
        wanted = [[p.name for p in effect.parameters].index(n) for n in names]
        merged = {p.name: p.value for p in effect.parameters} | dict(values)
        out = np.zeros((len(self.residuals), len(names)))
        for a in self.arcs:
            parts = []
            for m, index, mask in a.sets:
                part = np.zeros((*m.values.shape, len(names)))
                if effect.concerns(m):
                    states = a.partials.states[index]
                    push = self.model.acceleration(states, m.times)
                    # Linear about the null: the instrument does nothing yet.
                    at = effect.applied(m, merged)
                    part = effect.partials(at, states, push)[:, :, wanted]
                part = part / m.sigmas[:, :, None]
                parts.append(part.reshape(-1, len(names))[mask])
            out[a.rows] = np.concatenate(parts)
        return out

    def _kick(self, effect: ImpulsiveManoeuvre, values: Mapping[str, float]) -> Array:
        """Columns of a velocity change: exact, where a short pulse would need many nodes."""
        epoch = np.array([values[f"manoeuvre{effect.index}_t0"]])
        return self._measured([a.partials.kicks(epoch, effect.frame)[0] for a in self.arcs])

    def force_columns(self, accelerations: Sequence[Array]) -> Array:
        """Return d whitened prediction / d parameter for accelerations along the orbits, (n, p).

        Parameters
        ----------
        accelerations : sequence of ndarray (k, 3, p)
            Of each arc, at its ``partials.nodes``, inertial components.
        """
        pairs = zip(self.arcs, accelerations, strict=True)
        return self._measured([a.partials.response(push) for a, push in pairs])

    def _measured(self, responses: Sequence[Array]) -> Array:
        """Whitened measurements of changes (n, 6, p) of the states of each arc."""
        p = responses[0].shape[2]
        out = np.zeros((len(self.residuals), p))
        for a, response in zip(self.arcs, responses, strict=True):
            parts = []
            for m, index, mask in a.sets:
                part = m.partials(a.partials.states[index]) @ response[index]
                part /= m.sigmas[:, :, None]
                parts.append(part.reshape(-1, p)[mask])
            out[a.rows] = np.concatenate(parts)
        return out

    def candidate_columns(self, candidate: Candidate) -> list[Array]:
        """Return the columns (n, k) of a candidate, one array for each place searched."""
        places, effect = candidate.places or ({},), candidate.effect
        return [
            self.columns(
                effect,
                {**candidate.values, **place},
                candidate.estimate,
                elsewhere=bool(candidate.places),
            )
            for place in places
        ]

    # Projection ------------------------------------------------------------------------------

    def project(self, columns: Array) -> Array:
        """Return the part of columns (n,) or (n, p) that the known columns cannot absorb."""
        flat = columns[:, None] if columns.ndim == 1 else columns
        left = self._without_states(flat)
        left = left - self._shared @ (self._shared.T @ left)
        # A second pass: what is left may be 1e-6 of what came in.
        left = self._without_states(left)
        left = left - self._shared @ (self._shared.T @ left)
        size = np.linalg.norm(flat, axis=0)
        left[:, np.linalg.norm(left, axis=0) < _EMPTY * size] = 0.0
        return left[:, 0] if columns.ndim == 1 else left

    def state_steps(self, residuals: Array) -> Array:
        """Return the changes of the initial states (a, 6) that fit residuals best."""
        steps = []
        for a, block in zip(self.arcs, self._blocks, strict=True):
            size = np.linalg.norm(block, axis=0)
            scale = np.where(size > 0, size, 1.0)
            steps.append(np.linalg.lstsq(block / scale, residuals[a.rows], rcond=1e-13)[0] / scale)
        return np.array(steps)

    def rows(self) -> pd.DataFrame:
        """Describe the measured rows: arc, label, component, t_s, in the order of the residuals."""
        frames = []
        for a in self.arcs:
            for m, index, mask in a.sets:
                k = len(m.components)
                frames.append(
                    pd.DataFrame(
                        {
                            "arc": a.arc.name,
                            "label": m.label,
                            "component": np.tile(m.components, len(m.times)),
                            "t_s": np.repeat(m.times, k),
                            "orbit_row": np.repeat(index, k),
                        }
                    )[mask]
                )
        return pd.concat(frames, ignore_index=True)

    def _without_states(self, columns: Array) -> Array:
        left = columns.copy()
        for a, basis in zip(self.arcs, self._states, strict=True):
            part = left[a.rows]
            left[a.rows] = part - basis @ (basis.T @ part)
        return left


def _orthonormal(columns: Array, full: Array | None = None) -> Array:
    """Orthonormal basis of the columns without those that are rounding, judged by ``full``."""
    size = np.linalg.norm(columns if full is None else full, axis=0)
    scaled = columns / np.where(size > 0, size, 1.0)
    basis, r, _ = scipy.linalg.qr(scaled, mode="economic", pivoting=True)
    rank = int(np.sum(np.abs(np.diag(r)) > 1e-13))
    return np.asarray(basis[:, :rank], dtype=float)


def _masks(fit: OrbitFit, arcs: Sequence[Arc]) -> list[Array]:
    used = fit.residuals["used"].to_numpy(dtype=bool)
    masks, first = [], 0
    for arc in arcs:
        for m in arc.measurements:
            masks.append(used[first : first + m.values.size])
            first += m.values.size
    return masks
