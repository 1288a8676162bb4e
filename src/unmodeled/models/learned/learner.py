"""The one contract of everything that learns an acceleration from samples.

Learners work in normalised units (`unmodeled.core.units`): positions of order 1-3, accelerations
of order 1-40.  They follow the manners of scikit-learn: ``__init__`` only stores, ``fit``
validates and returns self, fitted names end in ``_``, everything is float64.
"""

from __future__ import annotations

import inspect
import json
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self, TypeAlias

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, InputError, nearest
from unmodeled.core.threads import one_thread

__all__ = [
    "Learner",
    "NoiseLevel",
    "Progress",
    "learner_class",
    "learner_names",
    "load_learner",
    "read_context",
]

#: Called with the share of the fit that is done, 0 to 1.
Progress: TypeAlias = Callable[[float], None]

_FORMAT = "unmodeled-learner-1"
_REGISTRY: dict[str, type[Learner]] = {}


@dataclass(frozen=True, slots=True)
class NoiseLevel:
    """What is known of the noise in the samples, one standard deviation on each axis.

    Parameters
    ----------
    position, acceleration : float
        In the units of the samples.
    samples : ndarray (n, 3), optional
        Of each component of each acceleration, beside ``acceleration``, in the same units. Weighed
        by every learner but `NearestNeighbour` and those of a point mass.
    gradient : ndarray (n, 3, 3), optional
        Gravity gradient at the positions of what has been taken off the accelerations: through it
        too noise of the position reaches them. `Residual` gives it.
    """

    position: float = 0.0
    acceleration: float = 0.0
    samples: Array | None = field(default=None, compare=False)
    gradient: Array | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        for name, value in (("position", self.position), ("acceleration", self.acceleration)):
            if not (np.isfinite(value) and value >= 0):
                raise ConfigError(f"noise level of {name} is {value}", allowed="a number >= 0")
        if self.samples is not None:
            checked = as_array(self.samples, ("n", 3), "noise level of the samples")
            if np.any(checked < 0):
                raise ConfigError(
                    f"noise level of a sample is {checked.min()}", allowed="numbers >= 0"
                )


class Learner(ABC):
    """A map from position (n, 3) to acceleration (n, 3), learned from samples.

    A learner with ``takes_features`` also learns from inputs (n, d), d > 3, whose first three
    columns are the position (`InputFeatures`); its Jacobian is (n, 3, d).

    A subclass names itself, declares its hyperparameters in ``__init__`` (stored unchanged under
    the same names), and gives ``_fit``, ``_predict``, ``_jacobian`` and the array state that
    ``save`` writes.

    Attributes
    ----------
    n_samples_ : int
        Number of samples of the last fit; present after ``fit``.
    n_inputs_ : int
        Number of input columns of the last fit, 3 for positions alone.
    """

    #: Name in configurations, reports and saved files; registers the class.
    name: ClassVar[str] = ""
    #: True if ``predict_covariance`` is available; a wrapper sets it for each object.
    has_covariance: bool = False
    #: True if inputs beyond the position are taken; a wrapper sets it for each object.
    takes_features: bool = False
    #: True for a learner that contains the mass itself and is never put on a point mass.
    stands_alone: ClassVar[bool] = False
    #: Fewest samples that ``fit`` accepts.
    min_samples: ClassVar[int] = 4

    n_samples_: int
    n_inputs_: int = 3

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.name:
            _REGISTRY[cls.name] = cls

    @classmethod
    def default_params(cls) -> dict[str, Any]:
        """Return the hyperparameters with their defaults (``inspect.Parameter.empty``: none)."""
        return {name: p.default for name, p in inspect.signature(cls).parameters.items()}

    def get_params(self) -> dict[str, Any]:
        """Return the hyperparameters by name, as given to ``__init__``."""
        return {name: getattr(self, name) for name in inspect.signature(type(self)).parameters}

    def fit(
        self,
        X: Array,
        y: Array,
        noise: NoiseLevel | None = None,
        *,
        progress: Progress | None = None,
    ) -> Self:
        """Learn from samples.

        Parameters
        ----------
        X : ndarray (n, 3)
            Positions, normalised, in one frame; or (n, d) inputs, see ``takes_features``.
        y : ndarray (n, 3)
            Accelerations at ``X``, normalised, components in the same frame.
        noise : NoiseLevel, optional
            Known noise; a learner that estimates its own noise takes it as the start.
        progress : callable, optional
            Told the share done.

        Returns
        -------
        Self

        Raises
        ------
        DataError
            On wrong shapes, values that are not finite, or too few samples.
        NumericalError
            If the fit breaks down in spite of good data.
        """
        noise = noise or NoiseLevel()
        X, y = self._checked_samples(X, y, noise)
        with one_thread():  # as `fit_batch`: sums split over threads differ in their last bits
            self._fit(X, y, noise, progress or (lambda share: None))
        self.n_samples_, self.n_inputs_ = X.shape
        return self

    def _checked_samples(self, X: Array, y: Array, noise: NoiseLevel) -> tuple[Array, Array]:
        X = self._checked_inputs(X)
        y = as_array(y, ("n", 3), "y")
        if len(X) != len(y):
            raise DataError(
                f"X has {len(X)} samples and y has {len(y)}", allowed="one acceleration a position"
            )
        if len(X) < self.min_samples:
            raise DataError(
                f"{self.name} was given {len(X)} training samples",
                allowed=f"at least {self.min_samples}",
                do="use a longer trajectory or more samples a period",
            )
        if noise.samples is not None and len(noise.samples) != len(X):
            raise DataError(
                f"X has {len(X)} samples and their noise has {len(noise.samples)}",
                allowed="a noise level for each sample",
            )
        return X, y

    def _checked_inputs(self, X: Array) -> Array:
        columns = np.shape(X)[1] if np.ndim(X) == 2 else 3
        if columns > 3 and not self.takes_features:
            raise DataError(
                f"X has shape {np.shape(X)}, and {self.name} learns from the position alone",
                allowed="shape (n, 3)",
                do="use a general learner, e.g. exact_gp or elm, for inputs beyond the position",
            )
        return as_array(X, ("n", max(columns, 3)), "X")

    def predict(self, X: Array) -> Array:
        """Return accelerations (n, 3) at positions ``X`` (n, 3)."""
        return self._predict(self._checked(X))

    def predict_covariance(self, X: Array) -> Array:
        """Return the covariance (n, 3, 3) of the noise-free acceleration at each position.

        Raises
        ------
        InputError
            If the learner has none (``has_covariance`` is False).
        """
        if not self.has_covariance:
            raise InputError(
                f"{self.name} gives no covariance", do="use a Gaussian process, e.g. exact_gp"
            )
        return self._predict_covariance(self._checked(X))

    def jacobian(self, X: Array) -> Array:
        """Return d acceleration_i / d position_j, shape (n, 3, 3), at positions ``X`` (n, 3)."""
        return self._jacobian(self._checked(X))

    def save(self, path: Path | str, context: dict[str, Any] | None = None) -> None:
        """Write hyperparameters and fitted arrays to one ``.safetensors`` file (no code in it).

        Parameters
        ----------
        path : path
            File to write.
        context : dict, optional
            Plain data kept beside the learner, e.g. its units; see `read_context`.
        """
        self._require_fitted()
        header = {
            "format": _FORMAT,
            "name": self.name,
            "params": self._params_for_json(),
            "n_samples": self.n_samples_,
            "n_inputs": self.n_inputs_,
            "context": context or {},
        }
        arrays = {k: np.ascontiguousarray(v) for k, v in self._arrays().items()}
        # As bytes, so that a full or closed disk is the system's own error.
        content = save(arrays, metadata={"unmodeled": json.dumps(header, sort_keys=True)})
        Path(path).write_bytes(content)

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read a learner written by ``save``; runs no code from the file.

        Raises
        ------
        DataError
            If the file is missing, truncated, of another format or of another class.
        """
        learner = load_learner(path)
        if not isinstance(learner, cls):
            raise DataError(
                f"{path} holds a learner named {learner.name}", allowed=f"a {cls.name or cls}"
            )
        return learner

    # What a subclass gives -------------------------------------------------------------------

    @abstractmethod
    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None: ...

    @abstractmethod
    def _predict(self, X: Array) -> Array: ...

    @abstractmethod
    def _jacobian(self, X: Array) -> Array: ...

    @abstractmethod
    def _arrays(self) -> dict[str, Array]:
        """Return the fitted state as named arrays."""

    @abstractmethod
    def _restore(self, arrays: dict[str, Array]) -> None:
        """Take back what ``_arrays`` returned."""

    def _predict_covariance(self, X: Array) -> Array:
        raise AssertionError(f"{self.name} declares a covariance and does not compute it")

    def _params_for_json(self) -> dict[str, Any]:
        return self.get_params()

    @classmethod
    def _from_params(cls, params: dict[str, Any]) -> Self:
        return cls(**params)

    def facts(self) -> dict[str, float | str]:
        """Return what a report should say of the fitted model: bounds, hyperparameters, size."""
        return {}

    # Shared ----------------------------------------------------------------------------------

    def _require_fitted(self) -> None:
        if not hasattr(self, "n_samples_"):
            raise InputError(f"{self.name} is not fitted", do="call fit(X, y) first")

    def _checked(self, X: Array) -> Array:
        self._require_fitted()
        return as_array(X, ("n", self.n_inputs_), "X")

    def __repr__(self) -> str:
        inner = ", ".join(f"{k}={v!r}" for k, v in self.get_params().items())
        return f"{type(self).__name__}({inner})"


def learner_names() -> list[str]:
    """Return the names of all learners, sorted."""
    return sorted(_REGISTRY)


def learner_class(name: str) -> type[Learner]:
    """Return the class of a learner by name.

    Raises
    ------
    ConfigError
        For an unknown name, with the nearest known one.
    """
    if name not in _REGISTRY:
        raise ConfigError(f'unknown learner "{name}"', do=nearest(name, _REGISTRY))
    return _REGISTRY[name]


def load_learner(path: Path | str) -> Learner:
    """Read any learner written by ``Learner.save``.

    Raises
    ------
    DataError
        If the file is missing, truncated or not a saved learner.
    """
    header, arrays = _read(path)
    try:
        learner = learner_class(header["name"])._from_params(header["params"])
        learner._restore(arrays)
        learner.n_samples_ = int(header["n_samples"])
        learner.n_inputs_ = int(header.get("n_inputs", 3))  # files of before them have none
    except (KeyError, TypeError, ValueError, IndexError) as exc:
        raise DataError(
            f"{path} holds an incomplete learner ({type(exc).__name__}: {exc})",
            do="train again; the file is damaged or of another version",
        ) from exc
    return learner


def read_context(path: Path | str) -> dict[str, Any]:
    """Return the plain data that was saved beside a learner.

    Raises
    ------
    DataError
        As `load_learner`.
    """
    context = _read(path)[0].get("context")
    return dict(context) if isinstance(context, dict) else {}


def _read(path: Path | str) -> tuple[dict[str, Any], dict[str, Array]]:
    try:
        with safe_open(str(path), framework="numpy") as file:
            header = json.loads((file.metadata() or {}).get("unmodeled", "{}"))
            arrays = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    except FileNotFoundError as exc:
        raise DataError(f"no file {path}", do="give the path of a saved learner") from exc
    except (OSError, SafetensorError, json.JSONDecodeError) as exc:
        raise DataError(
            f"{path} cannot be read as a saved learner ({exc})",
            do="train again; the file is damaged or of another kind",
        ) from exc
    if not isinstance(header, dict) or header.get("format") != _FORMAT:
        raise DataError(f"{path} is not a saved learner", allowed=f"format {_FORMAT}")
    return header, arrays
