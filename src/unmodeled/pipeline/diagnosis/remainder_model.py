"""What remains outside the catalogue: its kind, a model learned of it, and how far that carries."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, NumericalError
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.pipeline.comparison.force_dependence import Dependence, dependence
from unmodeled.pipeline.comparison.force_inference import ForceData
from unmodeled.pipeline.comparison.force_kind import Explanation, explain
from unmodeled.pipeline.comparison.free_force import FreeForce, free_force
from unmodeled.pipeline.comparison.left_out import skill_and_error, stretches
from unmodeled.pipeline.comparison.orbit_geometry import revolution
from unmodeled.pipeline.diagnosis.learned_force import LearnedForce
from unmodeled.pipeline.diagnosis.remainder_learning import LearnerSkill, learn_force
from unmodeled.pipeline.diagnosis.remainder_words import kind_words, learned_words, most_like
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["MODEL_FILE", "RemainderModel", "learn_remainder"]

#: Of a run folder.
MODEL_FILE = "remainder-model.safetensors"
#: Standard errors by which a skill must exceed zero.
_ABOVE = 2.0


@dataclass(frozen=True)
class RemainderModel:
    """The rest that no effect of the catalogue explains.

    Parameters
    ----------
    kind : str
        In words.
    dependence : Dependence
        On which inputs it depends, the alternatives, curl.
    explanation : Explanation
        What it looks like among the known kinds.
    force : FreeForce
        Reconstructed acceleration with sigmas; no assumption about its inputs.
    model : LearnedForce or None
        Learned from all fitted arcs; None if no learner could be fitted.
    learners : tuple of LearnerSkill
        Those tried, with their skill on left-out stretches; the first was chosen.
    rms_before, rms_after : float
        Residual RMS of the fitted arcs without and with the learned force, sigmas; states and
        free parameters adjusted, one linear step.
    held_out_rms_before, held_out_rms_after : float or None
        The same of the held-out arcs: only their states are adjusted.
    held_out_skill, held_out_skill_error : float or None
        Share of the sum of squares there that it explains, and its standard error.
    learned_curve : DataFrame or None
        Learned acceleration at the nodes of ``force``: R, T, N, m/s2.
    """

    kind: str
    dependence: Dependence = field(repr=False)
    explanation: Explanation = field(repr=False)
    force: FreeForce = field(repr=False)
    model: LearnedForce | None
    learners: tuple[LearnerSkill, ...]
    rms_before: float
    rms_after: float
    held_out_rms_before: float | None = None
    held_out_rms_after: float | None = None
    held_out_skill: float | None = None
    held_out_skill_error: float | None = None
    learned_curve: pd.DataFrame | None = field(default=None, repr=False)

    @property
    def skill(self) -> tuple[float, float]:
        """Share of left-out stretches that the chosen learner predicts, and its standard error."""
        best = self.learners[0] if self.learners else None
        return (best.skill, best.skill_error) if best else (0.0, float("inf"))

    @property
    def learned(self) -> bool:
        """True if that skill is above zero by two standard errors."""
        skill, error = self.skill
        return self.model is not None and skill > _ABOVE * error

    @property
    def carries(self) -> bool:
        """True if the skill on the held-out arcs is; False without any."""
        if not self.learned or self.held_out_skill is None or self.held_out_skill_error is None:
            return False
        return self.held_out_skill > _ABOVE * self.held_out_skill_error

    @property
    def sentence(self) -> str:
        """Kind and model in two or three sentences."""
        held_out = None
        if self.held_out_rms_before is not None and self.held_out_rms_after is not None:
            held_out = (self.held_out_rms_before, self.held_out_rms_after)
        learned = learned_words(
            self.learners[0].name if self.learners else None,
            self.skill,
            (self.rms_before, self.rms_after),
            held_out,
            learned=self.learned,
            carries=self.carries,
        )
        return f"It is {self.kind}. {learned}"

    def accelerations(self) -> pd.DataFrame:
        """Return the reconstructed and the learned acceleration, a row a node.

        Columns: arc, t_s, R_m_s2, T_m_s2, N_m_s2, sigma_R_m_s2 ..., x_m_s2, y_m_s2, z_m_s2
        (inertial), then learned_R_m_s2 ... where there is a model.
        """
        names = [*"RTN", "sigma_R", "sigma_T", "sigma_N", *"xyz"]
        table = self.force.table[["arc", "t_s", *names]]
        table = table.rename(columns={n: f"{n}_m_s2" for n in names})
        if self.learned_curve is None:
            return table
        curve = self.learned_curve.add_prefix("learned_").add_suffix("_m_s2")
        return pd.concat([table, curve], axis=1)

    def as_json(self) -> dict[str, Any]:
        """Return plain data for ``Diagnosis.as_json``."""
        best = self.dependence.best
        skill, error = self.skill
        return {
            "kind": self.kind,
            "sentence": self.sentence,
            "depends_on": best.inputs.title,
            "inputs": list(best.inputs.names),
            "axes": best.inputs.axes,
            "alternatives": list(self.dependence.rivals),
            "period_s": best.inputs.period or None,
            "curl_free": self.dependence.curl_free,
            "most_like": most_like(self.dependence, self.explanation),
            "learner": self.learners[0].name if self.learners else None,
            "learned": self.learned,
            "carries": self.carries,
            "skill": skill if self.learners else None,
            "skill_error": error if self.learners and np.isfinite(error) else None,
            "possible_skill": self.dependence.possible_skill,
            "residual_rms_before": self.rms_before,
            "residual_rms_after": self.rms_after,
            "held_out_rms_before": self.held_out_rms_before,
            "held_out_rms_after": self.held_out_rms_after,
            "held_out_skill": self.held_out_skill,
            "held_out_skill_error": self.held_out_skill_error,
            "file": MODEL_FILE if self.model is not None else None,
        }


def learn_remainder(lin: Linearisation) -> RemainderModel:
    """Name the kind of what remains, learn a model of it and test that where it was not fitted.

    Parameters
    ----------
    lin : Linearisation
        Of the final case at its final fit. What its free parameters absorb is not learned.

    Notes
    -----
    Everything is linear in the remaining force (variation of constants): residuals of hundreds of
    sigmas are only roughly described.
    """
    turns = [revolution(a.partials.node_states, a.partials.nodes) for a in lin.arcs]
    period = float(np.median(turns))
    data = ForceData(lin, period)
    found, looks = dependence(data), explain(lin)
    force = free_force(lin, period)
    rate = abs(lin.model.values.get("spin_rate", 0.0))
    model, learners = learn_force(data, found.best)
    before = _rms(lin, data.residual)
    answer = RemainderModel(
        kind_words(found, looks, period, 2 * np.pi / rate if rate else np.inf),
        found,
        looks,
        force,
        model,
        learners,
        before,
        before,
    )
    if model is None:
        return answer
    after = lin.project(lin.residuals - _response(lin, model))
    answer = replace(answer, rms_after=_rms(lin, after), learned_curve=_curve(lin, model, force))
    return _examined(answer, lin, model)


def _examined(answer: RemainderModel, lin: Linearisation, model: LearnedForce) -> RemainderModel:
    """Add the exam on arcs that took no part; without one if they cannot be flown."""
    case = lin.case
    if not case.held_out:
        return answer
    alone = replace(case, arcs=case.held_out, held_out=(), estimate={}, dynamics=lin.model)
    try:
        there = Linearisation(alone, alone.fit())
    except (NumericalError, DataError):
        return answer
    residual = there.project(there.residuals)
    left = there.project(there.residuals - _response(there, model))
    parts = list(stretches(there))
    nothing, errors = (np.array([float(r[p] @ r[p]) for p in parts]) for r in (residual, left))
    skill, error = skill_and_error(errors, nothing)
    return replace(
        answer,
        held_out_rms_before=_rms(there, residual),
        held_out_rms_after=_rms(there, left),
        held_out_skill=skill,
        held_out_skill_error=error,
    )


def _response(lin: Linearisation, model: LearnedForce) -> Array:
    """Whitened rows (n,) of the learned force along the orbits."""
    pushes = [model.predict(a.partials.node_states, a.partials.nodes)[:, :, None] for a in lin.arcs]
    rows: Array = lin.force_columns(pushes)[:, 0]
    return rows


def _curve(lin: Linearisation, model: LearnedForce, force: FreeForce) -> pd.DataFrame:
    """Learned acceleration on R, T, N at the nodes of the reconstructed one, m/s2."""
    parts = []
    for a in lin.arcs:
        own = force.table[force.table["arc"] == a.arc.name]
        at = np.searchsorted(a.partials.nodes, own["t_s"].to_numpy())
        states = a.partials.node_states[at]
        inertial = model.predict(states, a.partials.nodes[at])
        parts.append(np.einsum("nij,nj->ni", rtn_from_inertial(states), inertial))
    return pd.DataFrame(np.concatenate(parts), columns=list("RTN"))


def _rms(lin: Linearisation, rows: Array) -> float:
    return float(np.sqrt(np.mean(rows[: lin.measured] ** 2)))
