"""Answer to Table 4 of [Pesce2020]: filters whose tuning is wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.pipeline.navigation.navigate import simulate_flight
from unmodeled.pipeline.navigation.off_nominal import off_nominal
from unmodeled.pipeline.navigation.scenario_config import FormationConfig, load_scenario
from unmodeled.reports.figures.off_nominal import off_nominal_figure
from unmodeled.reports.reproduction.compared import Drawing, Found
from unmodeled.reports.reproduction.filter_tables import NEAR, scenario_file, settings
from unmodeled.reports.reproduction.published import PublishedFigure, Statement

__all__ = ["answer_off_nominal"]

#: The paper's filters, and beside them the linear filter that it does not fly.
FLOWN = {
    "observer": "observer",
    "adaptive": "rbf_adaptive",
    "rbf": "rbf",
    "nonlinear": "nonlinear",
    "linear": "kf",
}
_RUNS = {False: 100, True: 6}
#: With ``--small`` half an orbit.
_SHORT_S = 3600.0


def answer_off_nominal(
    figure: PublishedFigure, small: bool, tell: Callable[[int, int], None] | None
) -> Drawing:
    """Fly each filter with Q or gain wrong by up to ten, and compare with the printed errors.

    Parameters
    ----------
    figure : PublishedFigure
    small : bool
        Six runs of an hour.
    tell : callable, optional
        Told how much of a hundred is done.
    """
    changes: dict[str, Any] = {"runs": _RUNS[small]}
    if small:
        changes["duration_s"] = _SHORT_S
    config = load_scenario(scenario_file(figure.scenario), **changes)
    assert isinstance(config, FormationConfig)

    def told(_text: str, share: float) -> None:
        if tell is not None:
            tell(round(100 * share), 100)

    table = off_nominal(config, simulate_flight(config), tuple(FLOWN.values()), tell=told)
    shown = tuple(dict.fromkeys(table["filter"]))
    return Drawing(
        off_nominal_figure(table),
        "Position and velocity error of each run against the factor on its process noise",
        "One point a run: root mean square error after settling. Dashed: the nominal tuning. The "
        "factor is uniform in its logarithm from 0.1 to 10, the same for all filters.",
        answer_table4(table, figure.statements),
        f"Scenario {config.name}, {config.runs} runs of {config.duration_s:g} s, seed "
        f"{config.seed}; {'; '.join(settings(config, shown))}.",
        config.as_dict(),
    )


def answer_table4(table: pd.DataFrame, statements: Mapping[str, Statement]) -> dict[str, Found]:
    """Compare the errors over all runs; Table 4.

    Parameters
    ----------
    table : DataFrame
        As `off_nominal` returns it.
    statements : mapping of str to Statement
    """
    found = {}
    for key, name in FLOWN.items():
        rows = table[table["filter"] == name]
        lost = int(rows["position_rmse_m"].isna().sum())
        position, velocity = (
            float(np.sqrt((rows[column] ** 2).mean()))
            for column in ("position_rmse_m", "velocity_rmse_m_s")
        )
        worst = float(rows["position_rmse_m"].max())
        ours = f"{1e3 * position:.2f} mm, {velocity:.2e} m/s; worst run {1e3 * worst:.2f} mm"
        if lost:
            ours += f"; {lost} of {len(rows)} runs diverged"
        if key == "linear":
            paper = min(s.values["position"] for s in statements.values() if "position" in s.values)
            found[key] = Found(
                ours,
                bool(lost == 0 and position > paper),
                "Rule: agrees if a linear filter without a network, as badly tuned, is worse than "
                "the best printed error. The paper flies none.",
            )
            continue
        values = statements[key].values
        found[key] = Found(
            ours,
            bool(
                lost == 0
                and position <= values["position"] * (1 + NEAR)
                and velocity <= values["velocity"] * (1 + NEAR)
            ),
            "Rule: neither error more than 20 % above the printed one.",
        )
    return found
