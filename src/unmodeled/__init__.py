"""What does my force model lack, and can I trust what I learned about it?

The same names as on the command line, as plain functions on plain data:

>>> import unmodeled as um
>>> sorted(um.body_names())
['bennu', 'earth', 'eros', 'mars', 'moon', 'sun']
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from unmodeled.datasets.bodies import Body, body_names, load_body
    from unmodeled.datasets.readers import read_trajectory
    from unmodeled.datasets.trajectory import Trajectory
    from unmodeled.pipeline.cases.case import Case
    from unmodeled.pipeline.cases.load_case import load_case
    from unmodeled.pipeline.cases.simulate_case import HiddenEffect
    from unmodeled.pipeline.cases.simulated_files import simulate_case
    from unmodeled.pipeline.cases.write_case import write_case
    from unmodeled.pipeline.characterize import characterize
    from unmodeled.pipeline.comparison.compare import compare
    from unmodeled.pipeline.comparison.result import Comparison
    from unmodeled.pipeline.config import CharacterizationConfig, load_config
    from unmodeled.pipeline.diagnosis.add_effect import Addition, add
    from unmodeled.pipeline.diagnosis.diagnose import diagnose
    from unmodeled.pipeline.diagnosis.result import Diagnosis
    from unmodeled.pipeline.estimated_spin import SpinEstimate, estimate_spin
    from unmodeled.pipeline.learned_field import LearnedField
    from unmodeled.pipeline.navigation.navigate import navigate
    from unmodeled.pipeline.navigation.result import NavigationResult
    from unmodeled.pipeline.navigation.scenario_config import load_scenario
    from unmodeled.pipeline.results import CharacterizationResult
    from unmodeled.pipeline.select.select import Selection, select
    from unmodeled.pipeline.sweep.sweep import sweep
    from unmodeled.pipeline.trajectory_consistent import ConsistentFit, trajectory_consistent_fit
    from unmodeled.reports import write_report
    from unmodeled.reports.comparison_page import write_comparison_report
    from unmodeled.reports.diagnosis_page import write_addition_report, write_diagnosis_report
    from unmodeled.reports.navigation_page import write_navigation_report
    from unmodeled.reports.reproduction.reproduce import Reproduction, reproduce
    from unmodeled.reports.sweep_page import write_sweep_report

__all__ = [
    "Addition",
    "Body",
    "Case",
    "CharacterizationConfig",
    "CharacterizationResult",
    "Comparison",
    "ConsistentFit",
    "Diagnosis",
    "HiddenEffect",
    "LearnedField",
    "NavigationResult",
    "Reproduction",
    "Selection",
    "SpinEstimate",
    "Trajectory",
    "add",
    "body_names",
    "characterize",
    "compare",
    "diagnose",
    "estimate_spin",
    "load_body",
    "load_case",
    "load_config",
    "load_scenario",
    "navigate",
    "read_trajectory",
    "reproduce",
    "select",
    "simulate_case",
    "sweep",
    "trajectory_consistent_fit",
    "write_addition_report",
    "write_case",
    "write_comparison_report",
    "write_diagnosis_report",
    "write_navigation_report",
    "write_report",
    "write_sweep_report",
]

_HOME = {
    "Body": "datasets.bodies",
    "body_names": "datasets.bodies",
    "load_body": "datasets.bodies",
    "read_trajectory": "datasets.readers",
    "Trajectory": "datasets.trajectory",
    "characterize": "pipeline.characterize",
    "CharacterizationConfig": "pipeline.config",
    "load_config": "pipeline.config",
    "SpinEstimate": "pipeline.estimated_spin",
    "estimate_spin": "pipeline.estimated_spin",
    "LearnedField": "pipeline.learned_field",
    "CharacterizationResult": "pipeline.results",
    "write_report": "reports",
    "Addition": "pipeline.diagnosis.add_effect",
    "Case": "pipeline.cases.case",
    "Comparison": "pipeline.comparison.result",
    "Diagnosis": "pipeline.diagnosis.result",
    "HiddenEffect": "pipeline.cases.simulate_case",
    "add": "pipeline.diagnosis.add_effect",
    "compare": "pipeline.comparison.compare",
    "diagnose": "pipeline.diagnosis.diagnose",
    "load_case": "pipeline.cases.load_case",
    "simulate_case": "pipeline.cases.simulated_files",
    "write_case": "pipeline.cases.write_case",
    "write_comparison_report": "reports.comparison_page",
    "write_diagnosis_report": "reports.diagnosis_page",
    "write_addition_report": "reports.diagnosis_page",
    "sweep": "pipeline.sweep.sweep",
    "ConsistentFit": "pipeline.trajectory_consistent",
    "trajectory_consistent_fit": "pipeline.trajectory_consistent",
    "select": "pipeline.select.select",
    "Selection": "pipeline.select.select",
    "write_sweep_report": "reports.sweep_page",
    "navigate": "pipeline.navigation.navigate",
    "NavigationResult": "pipeline.navigation.result",
    "load_scenario": "pipeline.navigation.scenario_config",
    "write_navigation_report": "reports.navigation_page",
    "reproduce": "reports.reproduction.reproduce",
    "Reproduction": "reports.reproduction.reproduce",
}


def __getattr__(name: str) -> Any:
    """Import on first use: torch alone takes seconds, and a name may not need it."""
    if name not in _HOME:
        raise AttributeError(f"module 'unmodeled' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"unmodeled.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
