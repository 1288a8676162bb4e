"""A case file made ready to compute with: effects, surroundings, arcs, candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unmodeled.core.errors import ConfigError, nearest
from unmodeled.core.time import parse_epoch
from unmodeled.datasets.bodies import Body, load_body
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.cases.accepted_values import Surveyed
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.cases.case_config import CaseConfig, ExcludeConfig
from unmodeled.pipeline.cases.catalogue import default_candidates
from unmodeled.pipeline.cases.cut_arcs import cut
from unmodeled.pipeline.cases.first_guess import first_guess
from unmodeled.pipeline.cases.known_effects import Known, read_known
from unmodeled.pipeline.cases.listed_candidates import listed_candidate
from unmodeled.pipeline.cases.quantities import parse_quantity
from unmodeled.pipeline.cases.read_data import read_data
from unmodeled.pipeline.cases.spacecraft import Spacecraft
from unmodeled.pipeline.cases.surroundings import Surroundings
from unmodeled.pipeline.fit_problem import Arc
from unmodeled.pipeline.yaml12 import read_yaml

__all__ = ["Ground", "case_from_mapping", "load_case"]

#: Tracks and orientation reach beyond the data: times may be wrong by leap seconds.
_MARGIN = 100.0
#: Units of the keys of a body that is written out in the case file.
_BODY_UNITS = {
    "gm": "m3 s-2",
    "brillouin_radius": "m",
    "reference_radius": "m",
    "spin_rate": "rad s-1",
}


@dataclass(frozen=True)
class Ground:
    """What a case is built on, before any measurement.

    Parameters
    ----------
    body : Body
        Central body.
    craft : Spacecraft or None
        The spacecraft.
    around : Surroundings
        Axes, other bodies, rotation.
    known : Known
        The known model.
    """

    body: Body
    craft: Spacecraft | None
    around: Surroundings
    known: Known

    @classmethod
    def of(cls, config: CaseConfig, folder: Path) -> Ground:
        """Return the ground of a case file; paths are relative to its folder."""
        parse_epoch(config.epoch)
        body = _body(config.body, folder)
        craft = config.spacecraft.made() if config.spacecraft else None
        kernel = _kernel(config.ephemeris, folder)
        around = Surroundings(body, config.epoch, config.frame, kernel)
        return cls(
            body,
            craft,
            around,
            read_known(config.known, Surveyed(body, craft, config.epoch), folder),
        )

    def dynamics(self, start: float, end: float) -> Dynamics:
        """Return the known model in surroundings that hold a little beyond start and end, s."""
        margin = 1e-3 * (end - start) + _MARGIN
        interval = (start - margin, end + margin)
        effects = self.known.effects
        needed = tuple(sorted({name for effect in effects for name in effect.bodies}))
        return Dynamics(
            effects,
            self.known.values,
            tracks=self.around.tracks(*interval, needed),
            orientation=self.around.orientation(*interval),
        )


def load_case(path: Path | str, data_folders: Sequence[Path | str] = ()) -> Case:
    """Read a case file and the measurements it names.

    Parameters
    ----------
    path : path
        YAML file; see docs/cases.md for its keys.
    data_folders : sequence of path
        Where measurement files are looked for, after the folder of the case file.

    Raises
    ------
    ConfigError
        If a key, effect, frame or unit is wrong.
    DataError
        If a measurement file is missing or wrong, or an arc has no data.
    """
    path = Path(path)
    return case_from_mapping(read_yaml(path), path.parent, data_folders, source=str(path))


def case_from_mapping(
    mapping: Mapping[str, Any],
    folder: Path | str = ".",
    data_folders: Sequence[Path | str] = (),
    *,
    source: str = "case",
    data: Sequence[Measurements] | None = None,
) -> Case:
    """Return the case that a mapping describes, as `load_case` does for a file.

    Parameters
    ----------
    mapping : mapping
        Content of a case file; ``Case.source`` keeps it.
    folder : path
        Relative file names start here.
    data_folders : sequence of path
        As in `load_case`.
    source : str
        For error texts.
    data : sequence of Measurements, optional
        Measurements in memory, along the axes of the case's frame; no file is read then.

    Raises
    ------
    ConfigError, DataError
        As in `load_case`.
    """
    config = CaseConfig.resolve(dict(mapping), source)
    folder = Path(folder)
    ground = Ground.of(config, folder)
    known = ground.known
    folders = [folder, *(Path(f) for f in data_folders)]
    sets = tuple(data) if data is not None else read_data(config, ground.around, folders)
    pieces = cut(config, sets)
    last = max(float(m.times[-1]) for p in pieces for m in p.measurements)
    dynamics = ground.dynamics(min(p.start for p in pieces), last)
    arcs = [
        Arc(piece.start, first_guess(dynamics, piece, known), piece.measurements, piece.name)
        for piece in pieces
    ]
    fit = tuple(a for a, p in zip(arcs, pieces, strict=True) if not p.held_out)
    held = tuple(a for a, p in zip(arcs, pieces, strict=True) if p.held_out)
    return Case(
        name=config.name,
        body=ground.body,
        epoch=config.epoch,
        dynamics=dynamics,
        arcs=fit,
        held_out=held,
        estimate=known.estimate,
        instruments=known.instruments,
        instrument_values=known.instrument_values or {},
        candidates=_candidates(config, ground, dynamics, fit, folder),
        spacecraft=ground.craft,
        false_alarm=config.false_alarm,
        seed=config.seed,
        source=dict(mapping),
    )


def _body(given: str | Mapping[str, Any], folder: Path) -> Body:
    if isinstance(given, str):
        local = folder / given
        is_file = given.endswith((".yaml", ".yml"))
        return load_body(local if is_file and local.exists() else given)
    values: dict[str, Any] = {
        k: parse_quantity(v, _BODY_UNITS[k], f"body.{k}") if k in _BODY_UNITS else v
        for k, v in given.items()
    }
    for key in ("name", "gm", "brillouin_radius"):
        if key not in values:
            raise ConfigError(f'body lacks the key "{key}"', do="add it")
    allowed = ("name", "title", "zonals", "zonal_convention", *_BODY_UNITS)
    for key in values:
        if key not in allowed:
            raise ConfigError(
                f'body has an unknown key "{key}"',
                allowed=", ".join(allowed),
                do="write a card and name its path for more",
            )
    filled = {"title": values["name"], "reference_radius": values["brillouin_radius"], **values}
    return Body(**filled)


def _kernel(given: str, folder: Path) -> str:
    if given == "analytic" or not (folder / given).exists():
        return given
    return str(folder / given)


def _candidates(
    config: CaseConfig, ground: Ground, dynamics: Dynamics, arcs: tuple[Arc, ...], folder: Path
) -> tuple[Candidate, ...]:
    wanted = config.candidates
    if isinstance(wanted, tuple) and not wanted:
        return ()
    described: list[Candidate] = []
    if isinstance(wanted, tuple):
        surveyed = Surveyed(ground.body, ground.craft, config.epoch)
        shapes = [
            listed_candidate(entry, surveyed, folder, dynamics)
            for entry in wanted
            if not isinstance(entry, str)
        ]
        described = [c for c in shapes if c is not None]
        wanted = tuple(name for name in wanted if isinstance(name, str))
        if not wanted:
            return tuple(described)
    every = default_candidates(
        ground.body, dynamics, arcs, ground.craft, ground.known.instruments, config.epoch
    )
    names = [c.name for c in every]
    listed = wanted.exclude if isinstance(wanted, ExcludeConfig) else wanted
    if listed == "default":
        return tuple(every)
    for name in listed:
        if name not in names:
            raise ConfigError(
                f'there is no candidate "{name}" here',
                allowed=", ".join(names),
                do=nearest(name, names),
            )
    keep = isinstance(wanted, tuple)
    return (*(c for c in every if (c.name in listed) == keep), *described)
