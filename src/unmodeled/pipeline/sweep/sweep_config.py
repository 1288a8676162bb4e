"""The sweep file: a base configuration, axes, and a shared list of initial conditions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.config_errors import translate
from unmodeled.pipeline.config_types import Section
from unmodeled.pipeline.sweep.axes import parse_axes
from unmodeled.pipeline.yaml12 import read_yaml

__all__ = ["InitialConditions", "SweepConfig", "load_sweep"]


class InitialConditions(Section):
    """Where the shared initial conditions come from.

    ``count`` of them are drawn with their own ``seed``, each with ``others`` extrapolation
    orbits; or they are read from ``file``, a list that a sweep stored or one of your own.
    """

    count: Annotated[int, Field(ge=1)] | None = None
    seed: Annotated[int, Field(ge=0, lt=2**63, strict=True)] = 1
    others: Annotated[int, Field(ge=1)] = 1
    file: str | None = None


class SweepConfig(Section):
    """Everything that decides a sweep.

    Parameters
    ----------
    name : str
        Name of the store under ``runs/``.
    base : dict
        A configuration as for ``characterize``; what the axes do not change.
    axes : tuple of dict
        One mapping of keys to values for each grid; the sweep is the union of the grids.
    initial_conditions : InitialConditions or None
        None: the orbit that each configuration names or draws.
    flights : bool
        Whether orbits are flown with each learned model too (test point B); slow.
    """

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9._-]+$")] = "sweep"
    base: dict[str, Any] = Field(default_factory=dict)
    axes: tuple[dict[str, tuple[Any, ...]], ...] = ({},)
    initial_conditions: InitialConditions | None = None
    flights: bool = False

    @classmethod
    def resolve(
        cls, content: dict[str, Any], source: str = "sweep", folder: Path | None = None
    ) -> SweepConfig:
        """Validate plain data.

        Parameters
        ----------
        content : dict
            ``base`` may be the name of a configuration file; ``axes`` a mapping or a list of them.
        source : str
            Name for errors.
        folder : Path, optional
            Where files that the content names are looked for.

        Raises
        ------
        ConfigError
            Unknown keys, wrong values, an empty grid.
        """
        folder = folder or Path()
        content = dict(content)
        if isinstance(content.get("base"), str):
            content["base"] = read_yaml(folder / content["base"])
        grids = content.get("axes") or {}
        grids = grids if isinstance(grids, list | tuple) else [grids]
        content["axes"] = tuple(parse_axes(grid, source) for grid in grids)
        try:
            config = cls.model_validate(content)
        except ValidationError as error:
            raise translate(error, cls, source) from error
        given = config.initial_conditions
        if given is not None:
            if (given.count is None) == (given.file is None):
                raise ConfigError(
                    f"{source}: initial_conditions", allowed="count and seed, or file; one of both"
                )
            if given.file is not None:
                path = folder / Path(given.file).expanduser()
                changed = given.model_copy(update={"file": str(path.resolve())})
                config = config.model_copy(update={"initial_conditions": changed})
        return config

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for YAML; `resolve` gives the same sweep back."""
        content: dict[str, Any] = self.model_dump(mode="json")
        return content


def load_sweep(path: Path | str) -> SweepConfig:
    """Read a sweep file.

    Raises
    ------
    ConfigError
        As `SweepConfig.resolve`.
    """
    path = Path(path)
    return SweepConfig.resolve(read_yaml(path), str(path), path.parent)
