"""How figures look: one colour for each learner throughout, print-size fonts, stable files."""

from __future__ import annotations

import io
import textwrap
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, cast

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from unmodeled.core.errors import ConfigError
from unmodeled.models.learned import learner_class
from unmodeled.pipeline.config import LearnerConfig

__all__ = [
    "PAGE_WIDTH",
    "SET_STYLES",
    "LearnerStyle",
    "SetStyle",
    "figure_style",
    "learner_styles",
    "new_figure",
    "render",
    "short",
]

#: Width of every figure, inches: the text width of a printed A4 or letter page.
PAGE_WIDTH = 7.0
_DPI = 200
_INK = "#1F2933"
_GRID = "#D5DAE0"

# Okabe & Ito (2008), safe for the common colour-vision deficiencies, black and yellow left to
# others; three of Tol's "muted" scheme where eight are too few. Markers differ as well.
_KINDS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "exact_gp": ("#0072B2", "o"),
        "harmonic_gp": ("#332288", "h"),
        "harmonic_kernel_gp": ("#6699CC", "H"),
        "spectral_mlp": ("#D55E00", "s"),
        "potential_mlp": ("#882255", "p"),
        "rbf_network": ("#009E73", "^"),
        "nearest_neighbour": ("#CC79A7", "v"),
        "harmonic_least_squares": ("#E69F00", "D"),
        "zonal_oracle": ("#8A8A2B", "*"),
        "point_mass": ("#4B5563", "X"),
        "fitted_point_mass": ("#8D99A6", "P"),
        "curl_free_gp": ("#56B4E9", "8"),
        "sparse_gp": ("#117733", "<"),
        "elm": ("#661100", ">"),
        "mlp": ("#999933", "d"),
        "mascon_gp": ("#AA4499", "+"),
    }
)
# For kinds that this table does not know yet: by the name, so that it is the same on every page.
_SPARE = ("#44AA99", "#6B4C9A", "#7A5230")
_REPEAT_MARKERS = ("<", ">", "d", "8")


@dataclass(frozen=True, slots=True)
class LearnerStyle:
    """How one learner is drawn in every figure.

    Parameters
    ----------
    colour : str
        Hexadecimal.
    marker : str
        Matplotlib marker.
    line : str
        Matplotlib line style: dashed for a learner of the raw acceleration.
    hollow : bool
        Markers without filling, for the same case.
    """

    colour: str
    marker: str
    line: str
    hollow: bool

    @property
    def marker_options(self) -> dict[str, Any]:
        """Keywords for ``Axes.plot``."""
        return {
            "marker": self.marker,
            "markerfacecolor": "white" if self.hollow else self.colour,
            "markeredgecolor": self.colour,
        }


@dataclass(frozen=True, slots=True)
class SetStyle:
    """How one set of samples is drawn.

    Parameters
    ----------
    title : str
        Words for legends.
    colour, marker : str
        Hexadecimal colour, Matplotlib marker.
    """

    title: str
    colour: str
    marker: str


#: Train, interpolation (held out of the training orbit) and extrapolation (other orbits).
SET_STYLES: Mapping[str, SetStyle] = MappingProxyType(
    {
        "train": SetStyle("training", "#8794A1", "o"),
        "interpolation": SetStyle("interpolation", "#111111", "D"),
        "extrapolation": SetStyle("extrapolation", "#8E2A8B", "^"),
    }
)

_RC: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.labelsize": 8.5,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.edgecolor": "#7B8794",
    "axes.labelcolor": _INK,
    "text.color": _INK,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlelocation": "left",
    "axes.formatter.use_mathtext": False,
    "axes.unicode_minus": True,
    "grid.color": _GRID,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4,
    "figure.dpi": 100,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "unmodeled",
    # Labels are the user's words: a dollar sign in them is a dollar sign.
    "text.parse_math": False,
    "text.usetex": False,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Matplotlib settings for drawing and saving; the user's own come back at the end."""
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcdefaults()
        cast(dict[str, Any], mpl.rcParams).update(_RC)
        # A label in a script that the font lacks is drawn as boxes; the page itself shows it.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield


def new_figure(height: float, width: float = PAGE_WIDTH) -> Figure:
    """Return an empty figure (inches) that no global state knows of."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def render(figure: Figure, kind: str) -> bytes:
    """Return a figure as PNG (200 dpi) or SVG; the same figure gives the same bytes.

    Parameters
    ----------
    figure : Figure
        Drawn within `figure_style`.
    kind : {"png", "svg"}
        File format.
    """
    buffer = io.BytesIO()
    metadata: dict[str, Any] = {"Date": None} if kind == "svg" else {"Software": None}
    with figure_style():
        figure.savefig(buffer, format=kind, dpi=_DPI, metadata=metadata)
    return buffer.getvalue()


def learner_styles(learners: Sequence[LearnerConfig]) -> dict[str, LearnerStyle]:
    """Return the style of each learner by its label.

    The kind gives hue and marker; a learner of the raw acceleration is lighter, dashed and
    hollow beside the same kind on a point mass. A kind that is configured more than once gets
    darker shades and other markers in the order of the configuration.

    Parameters
    ----------
    learners : sequence of LearnerConfig
        As configured, failed ones included, so that a failure changes no colour.
    """
    styles: dict[str, LearnerStyle] = {}
    seen: dict[tuple[str, bool], int] = {}
    for learner in learners:
        colour, marker = _KINDS.get(learner.kind) or (_spare(learner.kind), "o")
        raw = learner.baseline == "none" and not _stands_alone(learner.kind)
        count = seen.get((learner.kind, raw), 0)
        seen[learner.kind, raw] = count + 1
        if raw:
            colour = _mix(colour, "#FFFFFF", 0.35)
        if count:
            colour = _mix(colour, "#000000", min(0.25 * count, 0.75))
            marker = _REPEAT_MARKERS[(count - 1) % len(_REPEAT_MARKERS)]
        line = ":" if learner.kind == "point_mass" else "--" if raw else "-"
        styles[learner.label] = LearnerStyle(colour, marker, line, raw)
    return styles


def short(label: str, width: int = 34) -> str:
    """Return a label on one line, cut with an ellipsis where a figure has no room for more.

    Examples
    --------
    >>> short("a label that goes on and on", 13)
    'a label that…'
    """
    text = " ".join(label.split())
    return text if len(text) <= width else textwrap.shorten(text, width, placeholder="…")


def _stands_alone(kind: str) -> bool:
    try:
        return learner_class(kind).stands_alone
    except ConfigError:
        return False


def _spare(kind: str) -> str:
    return _SPARE[sum(kind.encode()) % len(_SPARE)]


def _mix(colour: str, other: str, share: float) -> str:
    mixed = [
        (1 - share) * a + share * b for a, b in zip(to_rgb(colour), to_rgb(other), strict=True)
    ]
    return to_hex((mixed[0], mixed[1], mixed[2]), keep_alpha=False)
