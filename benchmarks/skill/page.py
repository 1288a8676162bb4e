"""The table as one HTML file that needs nothing else, and the figure beside it."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from html import escape
from pathlib import Path

import pandas as pd

from skill.fields import FIELDS, REGIONS
from skill.figure import error_map, styles_of
from skill.plan import NotRun, Settings
from skill.runner import NO_DATA
from skill.summary import SETS, check_use, is_candidate
from unmodeled.core.provenance import collect_provenance
from unmodeled.pipeline.use_check import DO_NOT_USE
from unmodeled.reports.numbers import number, seconds_text
from unmodeled.reports.style import render

__all__ = ["write_page"]

_STYLE = """
body{font:14px/1.45 system-ui,sans-serif;color:#1F2933;max-width:76rem;margin:2rem auto;
padding:0 1rem}
table{border-collapse:collapse;margin:.6rem 0 1.4rem;font-size:12.5px}
th,td{padding:.22rem .55rem;text-align:right;border-bottom:1px solid #D5DAE0;white-space:nowrap}
th:first-child,td:first-child{text-align:left}th{vertical-align:bottom;font-weight:600;white-space:normal;max-width:9em}
td.good{background:#DDEFE3}td.bad{background:#F6DDD6}td.off{color:#7B8794;text-align:left;
white-space:normal}
tr.reference{color:#52606D;font-style:italic}small,.note{color:#52606D}
.scroll{overflow-x:auto}img{max-width:100%}
i.key{display:inline-block;width:.75em;height:.75em;margin-right:.45em;border-radius:2px}
details{margin:.4rem 0}summary{cursor:pointer;font-weight:600}
"""
_MOST_LEVELS = 7


def write_page(
    runs: pd.DataFrame,
    cells: pd.DataFrame,
    not_run: Sequence[NotRun],
    settings: Settings,
    path: Path,
    planned: int,
) -> None:
    """Write the page and, beside it, one PNG a volume.

    Parameters
    ----------
    runs, cells : DataFrame
        Of `summarize_cells`.
    not_run : sequence of NotRun
        Shown in their place.
    settings : Settings
        Which were asked for.
    path : Path
        The page; figures take its name.
    planned : int
        Runs of the whole table: a part says that it is one.
    """
    parts = [
        "<h1>Skill of learned gravity</h1>",
        f"<p>{escape(check_use(runs, cells).sentence())}.</p>",
        ""
        if len(runs) >= planned
        else f"<p><b>Only {len(runs)} of {planned} runs are finished: "
        "fields, learners or pairs are missing.</b></p>",
        _how_to_read(runs, settings),
        _overview(cells),
    ]
    for volume in settings.volumes:
        if volume not in set(cells["volume"]):
            continue
        image = render(error_map(cells, volume), "png")
        path.with_name(f"{path.stem}-{volume}.png").write_bytes(image)
        data = base64.b64encode(image).decode()
        parts.append(f"<h2>{volume.capitalize()} volume</h2>")
        alt = "error on other orbits by learner, field and noise"
        parts.append(f'<p><img alt="{alt}" src="data:image/png;base64,{data}"></p>')
        for name in settings.fields:
            own = cells[(cells["volume"] == volume) & (cells["field"] == name)]
            if len(own):
                parts.append(f"<h3>{escape(FIELDS[name].title)}</h3>")
                parts += _field(own, [n for n in not_run if n.volume == volume], cells)
    parts.append(_footer(runs))
    page = f"<style>{_STYLE}</style>" + "\n".join(parts)
    head = '<!doctype html><html lang="en"><meta charset="utf-8"><title>Skill</title>'
    path.write_text(f"{head}{page}</html>\n", encoding="utf-8")


def _how_to_read(runs: pd.DataFrame, settings: Settings) -> str:
    none = int(runs["failure"].str.startswith(NO_DATA).sum())
    failed = int((runs["failure"] != "").sum()) - none
    regions = "; ".join(f"<b>{k}</b>: {escape(v)}" for k, v in REGIONS.items())
    sizes = "; ".join(
        f"{k}: up to {v.most} pairs of orbits, {v.flown} of them flown"
        for k, v in settings.volumes.items()
    )
    return f"""<p class="note">Fractional errors |a − â| / |a|: median over pairs of orbits of the
median over samples, and after the slash the mean of the means. Green: less than half the error of
the bare point mass on the same points and pairs; red: more than twice. ✗: most of the runs' own
reports say “{DO_NOT_USE}” (error on other orbits). {sizes}. {regions}. Flights: largest position
error of the other orbit after one and ten of its periods, Brillouin radii (∞: it left or fell
before). Noise in normalised units: σs in Brillouin radii, σa where accelerations are 1 to 40.
{failed} fits failed and count as infinite; {none} runs have no data.</p>"""


def _overview(cells: pd.DataFrame) -> str:
    body = []
    for volume, name in cells[["volume", "learner"]].drop_duplicates().itertuples(index=False):
        own = cells[(cells["volume"] == volume) & (cells["learner"] == name)]
        bad = (own["verdict"] == DO_NOT_USE).sum()
        ratio = (own["extrapolation_median"] / own["extrapolation_point_mass"]).quantile(
            0.5, interpolation="higher"
        )
        tell = own["worse_at"].str.contains
        body.append(
            [
                _name(name, cells),
                volume,
                f"{bad} of {len(own)}",
                number(float(ratio)),
                *(f"{int(tell(s).sum())}" for s in SETS),
                seconds_text(float(own["cost_train_s"].median())),
                seconds_text(float(own["cost_evaluate_one_s"].median())),
            ]
        )
    head = [
        "learner",
        "volume",
        f"cells that say “{DO_NOT_USE}”",
        "median error on other orbits over point mass",
        *(f"worse than twice point mass: {s}" for s in SETS),
        "fit",
        "one prediction",
    ]
    return "<h2>All cells</h2>" + _table(head, body)


def _field(own: pd.DataFrame, not_run: Sequence[NotRun], cells: pd.DataFrame) -> list[str]:
    levels = list(own[["sigma_s", "sigma_a"]].drop_duplicates().itertuples(index=False))
    names = list(dict.fromkeys(own["learner"]))
    body = []
    for name in names:
        row = [_name(name, cells)]
        for level in levels[:_MOST_LEVELS]:
            cell = _at(own, name, level)
            row.append("" if cell is None else _error(cell, "extrapolation", verdict=True))
        body.append(row)
    head = ["other orbits", *(_level(*level) for level in levels)]
    parts = [_table(head, body, [_off(n, len(levels)) for n in not_run])]
    for level in levels:
        parts.append(f"<details><summary>All measures, {_level(*level)}</summary>")
        rows = []
        for name in names:
            cell = _at(own, name, level)
            if cell is not None:
                rows.append(_measures(cell, cells))
        head = [
            "learner",
            "pairs",
            *SETS,
            "flight, 1 period",
            "10 periods",
            "68 % band holds",
            "95 % band holds",
            "NLL",
            "fit",
            "one prediction",
            "a point of many",
            "verdict",
        ]
        parts += [_table(head, rows), "</details>"]
    return parts


def _measures(cell: pd.Series, cells: pd.DataFrame) -> list[str]:
    def share(name: str) -> str:
        return number(100 * float(cell[name])) + " %" if pd.notna(cell[name]) else "–"

    failed = f", {cell['failures']} failed" if cell["failures"] else ""
    return [
        _name(str(cell["learner"]), cells),
        f"{cell['pairs']}{failed}",
        *(_error(cell, s) for s in SETS),
        *(_pair(cell, f"flight_{k}") for k in (1, 10)),
        share("extrapolation_coverage_68"),
        share("extrapolation_coverage_95"),
        number(float(cell["extrapolation_negative_log_likelihood"])),
        *_costs(cell),
        escape(str(cell["verdict"])),
    ]


def _costs(cell: pd.Series) -> list[str]:
    names = ("cost_train_s", "cost_evaluate_one_s", "cost_evaluate_batch_s_per_point")
    return [seconds_text(float(cell[name])) for name in names]


def _error(cell: pd.Series, name: str, *, verdict: bool = False) -> str:
    """Return median / mean, with a colour by the point mass."""
    median, reference = float(cell[f"{name}_median"]), float(cell[f"{name}_point_mass"])
    colour = "good" if median < reference / 2 else "bad" if not median <= 2 * reference else ""
    text = _pair(cell, name)
    if verdict and cell["verdict"] == DO_NOT_USE:
        text += " ✗"
    return f"{colour}|{text}"


def _pair(cell: pd.Series, name: str) -> str:
    median, mean = float(cell[f"{name}_median"]), float(cell[f"{name}_mean"])
    return "–" if math.isnan(median) else f"{number(median)} / {number(mean)}"


def _name(name: str, cells: pd.DataFrame) -> str:
    colour = styles_of(cells)[name].colour
    kind = cells.loc[cells["learner"] == name, "kind"].iloc[0]
    mark = "" if is_candidate(name, str(kind)) else "reference"
    note = " (zero residual)" if kind == "point_mass" else ""
    return f'{mark}|<i class="key" style="background:{colour}"></i>{escape(name)}{note}'


def _off(item: NotRun, columns: int) -> str:
    return (
        f"<tr><td>{escape(item.learner)}</td>"
        f'<td class="off" colspan="{columns}">not run: {escape(item.reason)}</td></tr>'
    )


def _table(head: Sequence[str], body: Sequence[Sequence[str]], extra: Sequence[str] = ()) -> str:
    """Return a table; a cell may begin with a class and a bar."""
    lines = ["<tr>" + "".join(f"<th>{h}</th>" for h in head) + "</tr>"]
    for row in body:
        made, reference = [], ""
        for text in row:
            mark, bar, rest = text.partition("|")
            if bar and mark == "reference":
                reference = ' class="reference"'
                mark = ""
            kind = f' class="{mark}"' if bar and mark else ""
            made.append(f"<td{kind}>{rest if bar else text}</td>")
        lines.append(f"<tr{reference}>{''.join(made)}</tr>")
    return f'<div class="scroll"><table>{"".join([*lines, *extra])}</table></div>'


def _level(state: float, acceleration: float) -> str:
    if not state and not acceleration:
        return "no noise"
    return f"σs {state:g}" if state else f"σa {acceleration:g}"


def _at(own: pd.DataFrame, name: str, level: tuple[float, float]) -> pd.Series | None:
    found = own[
        (own["learner"] == name) & (own["sigma_s"] == level[0]) & (own["sigma_a"] == level[1])
    ]
    return None if found.empty else found.iloc[0]


def _footer(runs: pd.DataFrame) -> str:
    made = collect_provenance("", 101)
    versions = ", ".join(f"{k} {v}" for k, v in made.versions.items())
    return (
        f'<p class="note">{len(runs)} runs, {runs["cost_cpu_s"].sum() / 60:.1f} min of processor '
        f"time, seeds from {runs['initial_condition'].min()}; commit {made.commit}; "
        f"{escape(versions)}; drawn {escape(made.finished)}. docs/skill.md says more.</p>"
    )
