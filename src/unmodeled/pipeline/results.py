"""What a characterisation returns, as plain data, and how it is stored in a run folder."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.provenance import Provenance
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import Learner
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.flight import Flight
from unmodeled.pipeline.learned_field import LearnedField
from unmodeled.pipeline.metrics import Calibration, ErrorSummary
from unmodeled.pipeline.training_check import TrainingCheck
from unmodeled.pipeline.use_check import UseCheck
from unmodeled.pipeline.yaml12 import write_yaml

__all__ = ["CharacterizationResult", "LearnerResult", "OrbitFlight", "file_name"]


@dataclass(frozen=True)
class OrbitFlight:
    """A flight with a learned model along one of the orbits.

    Parameters
    ----------
    orbit : int
        Index into `LearningData.orbits`; 0 is the training orbit.
    period : float
        Kepler period, s.
    flight : Flight
        Predicted against true positions.
    """

    orbit: int
    period: float
    flight: Flight


@dataclass(frozen=True)
class LearnerResult:
    """Everything measured of one learner.

    Parameters
    ----------
    label, kind, baseline : str
        As configured.
    learner : Learner or None
        The fitted learner; None if the fit failed.
    predictions : dict of str to ndarray (n, 3)
        Predicted acceleration at the true positions of each set, normalised.
    errors : dict of str to ndarray (n,)
        Fractional errors of each set (test point A).
    summaries : dict of str to ErrorSummary
        The same, summarised.
    calibrations : dict of str to Calibration
        Of each set; empty for learners without covariance.
    flights : tuple of OrbitFlight
        Test point B.
    train_seconds, train_bytes : float, int
        Wall time and growth of resident memory during the fit.
    single_seconds, batch_seconds : float
        Time of one evaluation alone, and of one point within a large call.
    model_bytes : int
        Size of the fitted arrays.
    facts : dict
        What the learner says of itself.
    failure : str
        Why the fit failed; empty if it did not.
    largest_observed : float
        Largest observed acceleration of the training samples over the largest true one. Far above
        1, noise put a position so deep that one sample rules the fit.
    use : UseCheck or None
        The learner beside the bare point mass on the extrapolation set; None if the fit failed.
    training_check : TrainingCheck or None
        The same on training data that were held back; None where that was not tried.
    """

    label: str
    kind: str
    baseline: str
    learner: Learner | None = None
    predictions: dict[str, Array] = field(default_factory=dict)
    errors: dict[str, Array] = field(default_factory=dict)
    summaries: dict[str, ErrorSummary] = field(default_factory=dict)
    calibrations: dict[str, Calibration] = field(default_factory=dict)
    flights: tuple[OrbitFlight, ...] = ()
    train_seconds: float = float("nan")
    train_bytes: int = 0
    single_seconds: float = float("nan")
    batch_seconds: float = float("nan")
    model_bytes: int = 0
    facts: dict[str, float | str] = field(default_factory=dict)
    failure: str = ""
    largest_observed: float = float("nan")
    use: UseCheck | None = None
    training_check: TrainingCheck | None = None


@dataclass(frozen=True)
class CharacterizationResult:
    """Configuration, data, one result a learner, and provenance.

    Parameters
    ----------
    config : CharacterizationConfig
        Resolved configuration.
    data : LearningData
        What was learned from and tested on.
    learners : tuple of LearnerResult
        In the order of the configuration.
    flight_floor : float
        Largest position error (m) when the *true* field is flown by the same solver; NaN for
        measured data.
    provenance : Provenance
        Seed, versions, host.
    """

    config: CharacterizationConfig
    data: LearningData
    learners: tuple[LearnerResult, ...]
    flight_floor: float
    provenance: Provenance

    def __getitem__(self, label: str) -> LearnerResult:
        """Return the result of a learner by its label."""
        for result in self.learners:
            if result.label == label:
                return result
        raise KeyError(label)

    def summary(self) -> pd.DataFrame:
        """Fractional errors, one row a learner and set; reproducible to the last digit.

        ``over_point_mass`` is the extrapolation median over that of the bare point mass, ``use``
        what follows from it: ``do not use`` above 2, else ``passes``.
        """
        rows = [
            {"learner": r.label, "set": name}
            | s.as_dict()
            | ({} if r.use is None else {"over_point_mass": r.use.ratio, "use": r.use.advice})
            for r in self.learners
            for name, s in r.summaries.items()
        ]
        return pd.DataFrame(rows)

    def use_checks(self) -> pd.DataFrame:
        """Both comparisons with the bare point mass, one row a learner and check."""
        data = self.config.data
        other = data.simulated or data.extrapolation_trajectory is not None
        elsewhere = "other orbits" if other else "later revolutions"
        rows = []
        for r in self.learners:
            for name, c in (("extrapolation", r.use), ("training", r.training_check)):
                if c is not None:
                    what = c.held_out if isinstance(c, TrainingCheck) else elsewhere
                    rows.append(
                        {
                            "learner": r.label,
                            "check": name,
                            "held_out": what,
                            "median": c.median,
                            "point_mass_median": c.point_mass,
                            "over_point_mass": c.ratio,
                            "use": c.advice,
                        }
                    )
        return pd.DataFrame(rows)

    def calibration(self) -> pd.DataFrame:
        """Calibration, one row a learner and set, of those that give a covariance."""
        rows = [
            {"learner": r.label, "set": name} | c.as_dict()
            for r in self.learners
            for name, c in r.calibrations.items()
        ]
        return pd.DataFrame(rows)

    def flights(self) -> pd.DataFrame:
        """Largest position error (m) within each number of periods, a row a learner and orbit."""
        rows = []
        for r in self.learners:
            for f in r.flights:
                row: dict[str, Any] = {
                    "learner": r.label,
                    "orbit": f.orbit,
                    "set": "train" if f.orbit == 0 else "extrapolation",
                }
                for p in self.config.flight.periods:
                    row[f"position_error_m_{p:g}_periods"] = f.flight.largest_error(p * f.period)
                rows.append(row | {"status": f.flight.status})
        return pd.DataFrame(rows)

    def costs(self) -> pd.DataFrame:
        """Time and memory, one row a learner; differs from run to run."""
        return pd.DataFrame(
            [
                {
                    "learner": r.label,
                    "train_s": r.train_seconds,
                    "train_MB": r.train_bytes / 1e6,
                    "evaluate_one_us": r.single_seconds * 1e6,
                    "evaluate_batch_us_per_point": r.batch_seconds * 1e6,
                    "model_kB": r.model_bytes / 1e3,
                }
                for r in self.learners
            ]
        )

    def samples(self) -> pd.DataFrame:
        """Every sample of every set with its fractional error by each learner."""
        units = self.data.units
        frames = []
        for s in self.data.sets:
            columns: dict[str, Any] = {"set": s.name, "orbit": s.orbit, "t_s": s.times}
            for k, axis in enumerate("xyz"):
                columns[f"{axis}_m"] = s.positions[:, k] * units.length
                columns[f"a{axis}_m_s2"] = s.accelerations[:, k] * units.acceleration
            for r in self.learners:
                if r.errors:
                    columns[f"error {r.label}"] = r.errors[s.name]
            frames.append(pd.DataFrame(columns))
        return pd.concat(frames, ignore_index=True)

    def as_json(self) -> dict[str, Any]:
        """Return the numbers as plain data for JSON (infinite values as null)."""

        def rows(table: pd.DataFrame) -> list[dict[str, Any]]:
            records: list[dict[str, Any]] = json.loads(table.to_json(orient="records"))
            return records

        return {
            "name": self.config.name,
            "summary": rows(self.summary()),
            "flights": rows(self.flights()),
            "calibration": rows(self.calibration()),
            "use_checks": rows(self.use_checks()),
            "flight_floor_m": None if math.isnan(self.flight_floor) else self.flight_floor,
            "costs": rows(self.costs()),
            "failures": {r.label: r.failure for r in self.learners if r.failure},
            "provenance": self.provenance.as_dict(),
        }

    def field(self, label: str) -> LearnedField:
        """Return a learned acceleration field in SI, ready to fly.

        Raises
        ------
        KeyError
            Unknown label.
        ValueError
            If that fit failed.
        """
        learner = self[label].learner
        if learner is None:
            raise ValueError(f"{label} has no fitted model: {self[label].failure}")
        spec = next(spec for spec in self.config.learners if spec.label == label)
        units = self.data.units
        return LearnedField(learner, units, self.data.frame, spec.features(units))

    def save(self, folder: Path) -> None:
        """Write configuration, provenance, tables and models into a folder."""
        write_yaml(self.config.as_dict(), folder / "config.yaml")
        (folder / "provenance.json").write_text(
            json.dumps(self.provenance.as_dict(), indent=2) + "\n"
        )
        for name, table in self._tables():
            table.to_csv(folder / f"{name}.csv", index=False)
        self.samples().to_parquet(folder / "samples.parquet", index=False)
        models = folder / "models"
        models.mkdir(exist_ok=True)
        for r in self.learners:
            if r.learner is not None:
                self.field(r.label).save(models / f"{file_name(r.label)}.safetensors")

    def _tables(self) -> Iterator[tuple[str, pd.DataFrame]]:
        yield "summary", self.summary()
        yield "use-checks", self.use_checks()
        yield "flights", self.flights()
        yield "costs", self.costs()
        if any(r.calibrations for r in self.learners):
            yield "calibration", self.calibration()


def file_name(label: str) -> str:
    """Return a label as a file name.

    Examples
    --------
    >>> file_name("exact gp on point mass")
    'exact-gp-on-point-mass'
    """
    return re.sub(r"[^a-z0-9]+", "-", label.lower()).strip("-")
