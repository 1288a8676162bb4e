"""A learned force that can be asked along any orbit, in SI."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError
from unmodeled.datasets.bodies import Body
from unmodeled.models.learned import Learner, load_learner, read_context
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.comparison.force_inputs import ForceInputs

__all__ = ["LearnedForce"]


@dataclass(frozen=True)
class LearnedForce:
    """An acceleration beside a force model, learned as a function of three inputs.

    Parameters
    ----------
    learner : Learner
        Fitted; takes dimensionless inputs, returns components in units of ``unit``.
    inputs : ForceInputs
        Makes inputs from a state and a time, and names the axes of the components.
    unit : float
        m/s2.
    dynamics, body : Dynamics, Body
        Know how the body is turned and where the Sun is.

    Notes
    -----
    It gives no sigma: a learner's own covariance takes the errors of neighbouring samples for
    independent, and knows nothing of what the measurements cannot resolve (about Bennu it was
    fifty times too small at the peak of a pulse). `RemainderModel.force` has sigmas.
    """

    learner: Learner
    inputs: ForceInputs
    unit: float
    dynamics: Dynamics = field(repr=False)
    body: Body = field(repr=False)

    def predict(self, states: Array, times: Array) -> Array:
        """Return accelerations (n, 3), m/s2, inertial components.

        Parameters
        ----------
        states : array_like (n, 6)
            Inertial, m and m/s.
        times : array_like (n,)
            s since the epoch of the case.
        """
        states, times = self._checked(states, times)
        x = self.inputs.values(self.dynamics, self.body, states, times)
        own = self.unit * self.learner.predict(x)
        turn = self.inputs.turn(self.dynamics, self.body, states, times)
        inertial: Array = np.einsum("nji,nj->ni", turn, own)
        return inertial

    def save(self, path: Path | str) -> None:
        """Write one ``.safetensors`` file with the learner, its inputs and its unit; no code."""
        context = {"inputs": self.inputs.as_plain(), "unit_m_s2": self.unit}
        self.learner.save(path, context)

    @classmethod
    def load(cls, path: Path | str, case: Case) -> LearnedForce:
        """Read what `save` wrote.

        Parameters
        ----------
        path : path
            The file.
        case : Case
            The case it was learned from, or another about the same body with the same epoch.

        Raises
        ------
        DataError
            If the file is missing, damaged, or holds another kind of learner.
        """
        learner, context = load_learner(path), read_context(path)
        try:
            plain = dict(context["inputs"])
            plain |= {k: tuple(float(v) for v in plain[k]) for k in ("centre", "scale")}
            inputs, unit = ForceInputs(**plain), float(context["unit_m_s2"])
        except (KeyError, TypeError, ValueError) as exc:
            raise DataError(
                f"{path} holds a learner without the inputs of a force",
                do="give the remainder-model.safetensors of a diagnosis",
            ) from exc
        return cls(learner, inputs, unit, case.dynamics, case.body)

    @staticmethod
    def _checked(states: Array, times: Array) -> tuple[Array, Array]:
        states, times = as_array(states, ("n", 6), "states"), as_array(times, ("n",), "times")
        if len(states) != len(times):
            raise DataError(
                f"{len(states)} states and {len(times)} times", allowed="a time for each state"
            )
        return states, times
