"""One style for all figures: colours, sizes, legends, alternative texts, and numbers as text.

Colours are those of Okabe and Ito (Color Universal Design, 2008), purple and orange darkened to a contrast
of 3:1 with white. Each has a second value for dark pages. A figure is drawn once, in the light colours;
inline in a report each of them becomes a CSS variable (see :mod:`nlsdesign.presentation.figures.svg`), so
one rendering serves light, dark and print. Colour never carries meaning alone: lines differ in dashes,
points in shape.

A colour means the same on every page: ``AFTER``, ``BEFORE``, ``HOLDS``, ``LIMIT``. Only pictures of the
mechanism give the colours to parts, and say so beside them.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, ParamSpec

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator
from numpy.typing import ArrayLike

from ...foundation.arrays import Array
from ...foundation.quantity import superscript, typeset_number


def root_mean_square(values: ArrayLike) -> float:
    """Return the root of the mean square of all finite values."""
    return float(np.sqrt(np.nanmean(np.square(np.asarray(values, dtype=float)))))


def compact(value: float, digits: int = 4) -> str:
    """Return a number as :func:`typeset_number` does, without zeros at its end.

    Parameters
    ----------
    value
        Any number.
    digits
        Largest number of significant digits.

    Examples
    --------
    >>> compact(0.25), compact(12.0), compact(2e-9), compact(1200.0)
    ('0.25', '12', '2·10⁻⁹', '1200')
    """
    mantissa, dot, power = typeset_number(value, digits).partition("·")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return mantissa + dot + power


P = ParamSpec("P")


@dataclass(frozen=True)
class Tone:
    """One colour of the figures."""

    name: str  # name of its CSS variable, without the leading dashes
    # light, dark: as #rrggbb, on light and on dark pages
    light: str
    dark: str

    def __str__(self) -> str:
        return self.light


INK = Tone("ink", "#1c2127", "#e4e8ee")
MUTED = Tone("muted", "#59636e", "#9da7b3")
GRID = Tone("grid", "#dde2e7", "#303943")
SURFACE = Tone("surface", "#fefefe", "#171c23")
BLUE = Tone("blue", "#0072b2", "#5ab4f0")
VERMILLION = Tone("vermillion", "#d55e00", "#ff8b4a")
GREEN = Tone("green", "#008f68", "#2fd0a2")
PURPLE = Tone("purple", "#b5588c", "#e79cc6")
ORANGE = Tone("orange", "#b07700", "#f5bd3d")

TONES = (INK, MUTED, GRID, SURFACE, BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
AFTER = BLUE
"""What a figure is about: the model, the design, the observer; of two states the later one."""
BEFORE = VERMILLION
"""What that is compared with: the state before, the published or the simpler form."""
HOLDS = GREEN
"""What holds or was chosen: a stable loop, an effect that was added; the third of several lines."""
LIMIT = ORANGE
"""A limit, and what sits on it or beyond."""

SERIES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
DASHES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.6)),
    (0, (1.2, 1.2)),
    (0, (6, 1.4, 1.2, 1.4)),
    (0, (3, 1, 1, 1, 1, 1)),
)
POINTS = ("o", "s", "^", "D", "v")

WIDTH = 8.6
"""Width of a figure in inches; 9 pt letters are then about 13 px high in a report 900 px wide."""

STYLE: Any = {
    "figure.facecolor": "none",
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.h_pad": 0.06,
    "figure.constrained_layout.w_pad": 0.06,
    "figure.constrained_layout.wspace": 0.03,
    "savefig.facecolor": "none",
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 9.0,
    "axes.facecolor": "none",
    "axes.edgecolor": MUTED.light,
    "axes.labelcolor": INK.light,
    "axes.titlecolor": INK.light,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    # Where a title stands; else each drawing measures all labels three times over to find out.
    "axes.titley": 1.0,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,
    # A power of ten beside an axis reads as a second unit.
    "axes.formatter.limits": (-6, 6),
    "axes.xmargin": 0.0,
    "grid.color": GRID.light,
    "grid.linewidth": 0.7,
    "text.color": INK.light,
    # A dollar sign in somebody's name is no formula.
    "text.parse_math": False,
    "xtick.color": MUTED.light,
    "ytick.color": MUTED.light,
    "xtick.labelcolor": INK.light,
    "ytick.labelcolor": INK.light,
    "lines.linewidth": 1.6,
    "lines.markersize": 4.5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 2.6,
    "patch.linewidth": 0.0,
    "hatch.linewidth": 0.6,
    "svg.fonttype": "none",
    "svg.hashsalt": "nlsdesign",
    "path.simplify": True,
}


class Look(NamedTuple):
    """Colour, dashes and points of one of several lines."""

    color: str
    linestyle: Any
    marker: str


def look(number: int) -> Look:
    """Return how a line is drawn; the first 25 differ in colour or dashes."""
    shift = number + number // len(SERIES)
    return Look(SERIES[number % len(SERIES)].light, DASHES[shift % len(DASHES)], POINTS[number % len(POINTS)])


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Let a function draw in the common style, independent of the user's settings of matplotlib."""

    @functools.wraps(draw)
    def wrapped(*arguments: P.args, **named: P.kwargs) -> Figure:
        with mpl.rc_context():
            mpl.rcdefaults()
            mpl.rcParams.update(STYLE)
            return draw(*arguments, **named)

    return wrapped


def panels(
    rows: int = 1, columns: int = 1, *, height: float = 3.2, width: float = WIDTH, **options: Any
) -> tuple[Figure, list[Axes]]:
    """Return an empty figure and its panels, row by row."""
    # At 72 dots per inch a dot is a point, so the SVG has the requested layout.
    figure = Figure(figsize=(width, height), dpi=72)
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    return figure, list(axes.flat)


def legend(axes: Axes, *, columns: int = 4) -> None:
    """Put the legend above a panel, where it covers no data; none without labelled lines.

    It stands beside the title where both fit into one line, else below it.
    """
    handles, labels = axes.get_legend_handles_labels()
    if not handles:
        return
    title = axes.get_title(loc="left")
    side_by_side = min(columns, len(labels))
    # Widths in points: a letter of 8.5 pt takes about 4.9, sample and gaps of an entry about 45.
    needed = sum(4.9 * len(label) + 45.0 for label in labels) + 6.6 * len(title) + 20.0
    spec = axes.get_subplotspec()
    share = 1.0 if spec is None else (spec.colspan.stop - spec.colspan.start) / spec.get_gridspec().ncols
    beside = (
        side_by_side == len(labels) and "\n" not in title and needed <= share * axes.figure.bbox.width - 50.0
    )
    axes.legend(
        handles,
        labels,
        ncols=side_by_side,
        borderaxespad=0.2,
        columnspacing=1.6,
        loc="lower right" if beside else "lower left",
        bbox_to_anchor=(1.0, 1.0) if beside else (0.0, 1.0),
    )
    if not beside:
        rows = -(-len(labels) // side_by_side)
        axes.set_title(title, pad=9.0 + 13.5 * rows)


def label_panel(axes: Axes, ordinate: str, title: str, *, columns: int = 4) -> None:
    """Give a panel its ordinate, title and legend."""
    axes.set(title=title, ylabel=ordinate)
    legend(axes, columns=columns)


def crosses(axes: Axes, at: Array | list[float], height: float, color: str) -> None:
    """Mark abscissae by crosses at a height, a share of that of the panel."""
    axes.plot(
        at, [height] * len(at), transform=axes.get_xaxis_transform(), color=color, linestyle="none",
        marker="x", markeredgewidth=1.6,
    )  # fmt: skip


def log_axis(axes: Axes, *, abscissa: bool = False) -> None:
    """Make an axis logarithmic with plain numbers: ``200``, ``5000``, ``10⁻⁶``.

    ``abscissa``: whether it is the abscissa; else the ordinate.
    """
    axis: Axis = axes.xaxis if abscissa else axes.yaxis
    (axes.set_xscale if abscissa else axes.set_yscale)("log")
    axis.set_major_locator(LogLocator(10.0))
    axis.set_minor_locator(LogLocator(10.0, subs=(2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _plain(value)))

    def minor(value: float, _: int) -> str:
        low, high = axis.get_view_interval()
        return _plain(value) if low > 0.0 and high / low < 100.0 else ""

    axis.set_minor_formatter(FuncFormatter(minor))
    axis.set_tick_params(which="minor", labelsize=8.0, labelcolor=INK.light)


def symmetric_log_axis(axes: Axes, linear: float) -> None:
    """Make the ordinate logarithmic to both sides of zero, straight up to ``linear``, with plain numbers."""
    axes.set_yscale("symlog", linthresh=linear)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _plain(value)))


def _plain(value: float) -> str:
    exponent = math.floor(math.log10(abs(value)) + 1e-9) if value else 0
    text = f"{abs(value):g}" if -3 <= exponent <= 4 else f"10{superscript(exponent)}"
    return f"−{text}" if value < 0.0 else text


def described(figure: Figure, text: str) -> Figure:
    """Attach the alternative text of a figure, for readers who cannot see it.

    ``text``: what it shows, in one or two sentences; not empty.
    """
    figure.set_label(" ".join(text.split()))
    return figure


def alternative_text(figure: Figure) -> str:
    """Return the text attached by :func:`described`, or an empty text."""
    return str(figure.get_label() or "")
