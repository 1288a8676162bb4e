"""Commands that list what there is."""

from __future__ import annotations

import json
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from unmodeled.cli.tools import AsJson, DataFolder, app, data_folders
from unmodeled.core.errors import ConfigError, nearest

if TYPE_CHECKING:
    from unmodeled.pipeline.cases.case import Case

__all__ = ["bodies", "effects", "learners", "scenarios", "version"]


@app.command()
def bodies() -> None:
    """List the body cards."""
    from unmodeled.datasets.bodies import body_names, load_body

    table = Table("name", "GM [m3/s2]", "Brillouin radius [m]", "J2 (unnormalised)", "convention")
    for name in body_names():
        body = load_body(name)
        table.add_row(
            name,
            f"{body.gm:.10g}",
            f"{body.brillouin_radius:.10g}",
            f"{body.zonal_unnormalised().get(2, 0.0):.6g}",
            body.zonal_convention,
        )
    Console().print(table)


@app.command()
def learners(as_json: AsJson = False) -> None:
    """List the learners, their hyperparameters with defaults, and what they learn from."""
    from unmodeled.models.learned import learner_class, learner_names

    table = Table("kind", "hyperparameters (default)", "covariance", "inputs", "what it is")
    listed: dict[str, dict[str, Any]] = {}
    for name in learner_names():
        cls = learner_class(name)
        if name == "residual":  # written as `baseline: point_mass`, not as a kind
            continue
        shown = ", ".join(f"{k}={v}" for k, v in cls.default_params().items())
        first = (cls.__doc__ or "").strip().splitlines()[0]
        inputs = "any" if cls.takes_features else "position"
        table.add_row(name, shown, "yes" if cls.has_covariance else "no", inputs, first)
        listed[name] = {
            "hyperparameters": cls.default_params(),
            "covariance": cls.has_covariance,
            "inputs": inputs,
            "what": first,
        }
    if as_json:
        print(json.dumps(listed, indent=2))
    else:
        Console().print(table)


@app.command()
def scenarios() -> None:
    """List the scenarios of simulated cases."""
    from unmodeled.pipeline.cases.scenario_designs import DESIGNS
    from unmodeled.reports.diagnosis_text import columns

    rows = []
    for name, design in DESIGNS.items():
        d = design()
        body = d.content["body"]
        rows.append(
            (
                name,
                str(body["name"] if isinstance(body, dict) else body),
                "range, range rate" if d.tracked else "position",
                f"{d.sigma:g}",
                f"{d.step:g}",
                f"{d.days:g}",
                ", ".join(_entry(e) for e in d.content["known"]),
            )
        )
    heads = ("name", "body", "measured", "sigma [m]", "every [s]", "days", "known model")
    print("\n".join(columns(heads, rows)))


@app.command()
def effects(
    case: Annotated[
        str | None,
        typer.Argument(help="Case file or scenario: what could be missing there."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the list as JSON.")] = False,
    data: DataFolder = None,
) -> None:
    """List the catalogue: what `diagnose` looks for and what `add` can add.

    Without a case: everything that any scenario offers, with the size expected in the first that
    offers it.
    """
    from unmodeled.pipeline.cases.scenario_orbits import SCENARIOS
    from unmodeled.pipeline.cases.simulate_case import scenario_case
    from unmodeled.reports.diagnosis_text import columns

    if case is None:
        offered = [(name, scenario_case(name, 0)) for name in SCENARIOS]
    elif case in SCENARIOS:
        offered = [(case, scenario_case(case, 0))]
    elif case.endswith((".yaml", ".yml")):
        from unmodeled.pipeline.cases.load_case import load_case

        offered = [(case, load_case(Path(case), data_folders(data)))]
    else:
        raise ConfigError(
            f'there is no scenario "{case}"',
            allowed=f"{', '.join(SCENARIOS)}, or a case file",
            do=nearest(case, SCENARIOS),
        )
    rows = _catalogue(offered)
    if as_json:
        print(json.dumps(rows, indent=2))
        return
    lines = []
    for row in rows:
        for k, p in enumerate(row["parameters"]):
            own = (row["name"], row["title"], row["family"]) if k == 0 else ("", "", "")
            lines.append((*own, p["name"], f"{p['expected']:.2g}", p["unit"]))
    heads = ("name", "what it is", "family", "parameter", "expected size", "unit")
    print("\n".join(columns(heads, lines)))


def _catalogue(offered: list[tuple[str, Case]]) -> list[dict[str, Any]]:
    """Return one row a candidate; those of one data set or station once."""
    rows: dict[str, dict[str, Any]] = {}
    for source, case in offered:
        for c in case.candidates:
            rows.setdefault(
                c.name,
                {
                    "name": c.name,
                    "title": c.title,
                    "family": c.family,
                    "offered_in": source,
                    "parameters": [
                        {"name": p.name, "unit": p.unit, "expected": float(prior)}
                        for p, prior in zip(c.parameters, c.priors, strict=True)
                    ],
                },
            )
    return list(rows.values())


def _entry(entry: dict[str, Any]) -> str:
    """Return an entry of a known model in a few words."""
    name = str(entry["effect"])
    more = [entry[k] for k in ("body", "degrees", "degree") if k in entry]
    words = [" ".join(map(str, m)) if isinstance(m, list) else str(m) for m in more]
    return f"{name}({', '.join(words)})" if words else name


@app.command()
def version() -> None:
    """Print the version."""
    print(f"unmodeled {metadata.version('unmodeled')}")
