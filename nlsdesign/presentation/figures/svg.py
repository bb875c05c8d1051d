"""Figures as SVG with colours that follow the page, and the numbers that a figure shows.

The same figure gives the same bytes. Lines are reduced to the points that a figure can show.
"""

from __future__ import annotations

import io
import math
import re
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import Collection, LineCollection, PathCollection, PolyCollection
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator
from numpy.typing import ArrayLike, NDArray

from ...foundation.arrays import Array, Indices
from ...foundation.errors import ExportError, nearest
from ...foundation.text_files import write_bytes
from .style import STYLE, TONES, alternative_text

_SVG = "{http://www.w3.org/2000/svg}"
_LINK = "{http://www.w3.org/1999/xlink}href"
_NUMBER = re.compile(r"-?\d+\.\d+")
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
_REFERENCE = re.compile(r"#([\w-]+)")
_FONT = re.compile(r"font-family:[^;]*; ")
"""The page gives the letters of its figures the font of its text."""
_STRAIGHT = re.compile(r"([ML]) (\S+) (\S+)|z")
_HASHED = re.compile(r'(?<=id=")([A-Za-z])[0-9a-f]{10}(?=")|(?<=#)([A-Za-z])[0-9a-f]{10}\b')
"""Identifiers that matplotlib makes of coordinates, whose last digits differ from processor to processor."""
_MARKS = (f"{_SVG}use", f"{_SVG}path")
_GEOMETRY = ("d", "x", "y", "points", "width", "height")
SUFFIXES = (".svg", ".png", ".pdf")

_VARIABLES = {tone.light: f"var(--{tone.name})" for tone in TONES}


_ON_NOTHING = re.compile(
    r'(<g id="patch_1">\s*<path d="M 0 [^L]*(?:L[^L]*){3})L [^z]*(z\s*" style="fill: )none'
)
"""The background of a figure: an outline without a face goes back to its first corner before it is closed."""
_NO_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
"""Control characters, as a name of somebody's may hold: no file of XML may."""
_drawn: WeakKeyDictionary[Figure, str] = WeakKeyDictionary()


def svg_text(figure: Figure) -> str:
    """Return a figure as a file of its own: light colours on white."""
    return _ON_NOTHING.sub(r"\1\2#ffffff", _svg_on_nothing(figure), count=1)


def _svg_on_nothing(figure: Figure) -> str:
    """Return what matplotlib draws, with numbered identifiers; once, until the figure changes."""
    if figure.stale or figure not in _drawn:
        stream = io.StringIO()
        metadata = {"Date": None, "Creator": None, "Description": _NO_XML.sub(" ", alternative_text(figure))}
        # ``savefig`` would draw a second time, to lay out what drawing itself lays out; the same bytes.
        with mpl.rc_context(STYLE), _drawing(figure):
            FigureCanvasSVG(figure).print_svg(stream, metadata=metadata)  # type: ignore[no-untyped-call]
        numbers: dict[str, int] = {}
        _drawn[figure] = _HASHED.sub(
            lambda match: f"{match[1] or match[2]}{numbers.setdefault(match[0], len(numbers))}",
            stream.getvalue(),
        )
        # Drawing changes colours and layout and puts them back, which matplotlib takes for a change.
        figure.stale = False
    return _drawn[figure]


def inline_svg(figure: Figure, key: str, *, alternative: str = "") -> str:
    """Return a figure as an SVG element to stand in an HTML page.

    Colours of the palette become CSS variables such as ``var(--blue)``, identifiers start with the key (they
    must be unique on the page), coordinates are rounded to a tenth of a point, text stays text.

    Parameters
    ----------
    figure
        Any figure.
    key
        Identifier that no other figure of the page uses.
    alternative
        Alternative text; by default the one attached to the figure.
    """
    root = ET.fromstring(_svg_on_nothing(figure))
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in (f"{_SVG}metadata", f"{_SVG}style"):
                parent.remove(child)
    kept = {
        name
        for element in root.iter()
        for attribute in (_LINK, "clip-path", "style")
        for name in _REFERENCE.findall(element.get(attribute, ""))
    }
    kept |= {str(artist.get_gid()) for artist in figure.findobj() if artist.get_gid()}
    for element in root.iter():
        _adapt(element, key, kept)
        # Blanks that only indent what matplotlib writes are a twentieth of a page.
        element.text, element.tail = (
            part and (part if part.strip() else None) for part in (element.text, element.tail)
        )
    for element in root.iter(f"{_SVG}g"):
        _share_looks(element)
    for name in ("width", "height", "version"):
        root.attrib.pop(name, None)
    # What an image holds is hidden from readers who hear the page, and links must not be.
    root.set("role", "img" if root.find(f".//{_SVG}a") is None else "group")
    root.set("aria-label", alternative or alternative_text(figure))
    ET.register_namespace("", _SVG[1:-1])
    return ET.tostring(root, encoding="unicode")


def write_figures(folder: Path, figures: Mapping[str, Figure], *, suffix: str = ".svg") -> list[Path]:
    """Write figures as files of their own; each appears whole or not at all.

    Parameters
    ----------
    folder
        Is made where it does not exist.
    figures
        By name of the file without suffix.
    suffix
        ``".svg"``, ``".png"`` (200 dots per inch) or ``".pdf"``.

    Raises
    ------
    ExportError
        If the suffix is another, or a file cannot be written.
    """
    if suffix not in SUFFIXES:
        raise ExportError(
            f"figures as '{suffix}'", "is not a format of figures", did_you_mean=nearest(suffix, SUFFIXES),
            next_step=f"use one of {', '.join(SUFFIXES)}",
        )  # fmt: skip
    paths = {Path(folder) / f"{name}{suffix}": figure for name, figure in figures.items()}
    for path, figure in paths.items():
        write_bytes(path, _content(figure, suffix))
    return list(paths)


@contextmanager
def _drawing(figure: Figure) -> Iterator[None]:
    """Take the background away while a figure is drawn, and accept letters that matplotlib's font lacks.

    Text stays text, and who shows it has fonts of its own.
    """
    face, edge = figure.get_facecolor(), figure.get_edgecolor()
    figure.set(facecolor="none", edgecolor="none")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"Glyph \d+ .* missing from font")
        try:
            yield
        finally:
            figure.set(facecolor=face, edgecolor=edge)


def _content(figure: Figure, suffix: str) -> bytes:
    if suffix == ".svg":
        return svg_text(figure).encode()
    stream = io.BytesIO()
    # No date and no version, so that the same figure gives the same file; letters as fonts, not as drawings.
    with mpl.rc_context({**STYLE, "pdf.fonttype": 42}):
        if suffix == ".pdf":
            metadata = {"CreationDate": None, "Creator": None, "Producer": None}
            figure.savefig(stream, format="pdf", facecolor="white", metadata=metadata)
        else:
            figure.savefig(stream, format="png", dpi=200, facecolor="white", metadata={"Software": None})
    return stream.getvalue()


def _adapt(element: ET.Element, key: str, kept: set[str]) -> None:
    name = element.get("id")
    if name is not None:
        del element.attrib["id"]
        if name in kept:
            element.set("id", f"{key}-{name}")
    if _LINK in element.attrib:
        # Links of a figure lead out of it; all other references stay within.
        link = element.attrib.pop(_LINK)
        if element.tag == f"{_SVG}a":
            element.set("href", link)
            element.attrib.pop("target", None)
        else:
            element.set("href", link.replace("#", f"#{key}-"))
    if "clip-path" in element.attrib:
        element.set("clip-path", element.get("clip-path", "").replace("url(#", f"url(#{key}-"))
    if "style" in element.attrib:
        style = _FONT.sub("", element.get("style", "")).replace("url(#", f"url(#{key}-")
        element.set("style", _COLOUR.sub(lambda m: _VARIABLES.get(m[0].lower(), m[0]), style))
    for attribute in ("fill", "stroke"):
        # CSS variables work in styles, not in attributes.
        if element.get(attribute, "").lower() in _VARIABLES:
            colour = _VARIABLES[element.attrib.pop(attribute).lower()]
            element.set("style", f"{attribute}: {colour}; {element.get('style', '')}")
    for attribute in _GEOMETRY:
        if attribute in element.attrib:
            numbers = _NUMBER.sub(_rounded, " ".join(element.get(attribute, "").split()))
            element.set(
                attribute, numbers if attribute != "d" or set("QC") & set(numbers) else _steps(numbers)
            )
    if element.get("transform", "").startswith("rotate(-0 "):
        del element.attrib["transform"]


def _steps(path: str) -> str:
    """Return a path of straight lines as steps from point to point, which take half the letters."""
    text, at = "", (0, 0)
    for letter, *place in _STRAIGHT.findall(path):
        if not letter:
            text += "z"
            continue
        x, y = (round(10 * float(number)) for number in place)
        step = (x, y) if letter == "M" else (x - at[0], y - at[1])
        text += f"{letter if letter == 'M' else 'l'}{step[0] / 10:g} {step[1] / 10:g}".replace(" -", "-")
        at = (x, y)
    return text


def _share_looks(group: ET.Element) -> None:
    """Give a group of links the style and clip of its marks, where it is the same for all, in place of each.

    Thousands of points of one kind then take a third of the room.
    """
    links = [each for each in group if each.tag == f"{_SVG}a"]
    marks = [_mark_of(link) for link in links]
    if not links or any(mark is None for mark, _ in marks):
        return
    looks = {(mark.get("style"), clip) for mark, clip in marks if mark is not None}
    if len(looks) > 1 or len(group) > len(links) + 1 or {"style", "clip-path"} & set(group.attrib):
        return
    for name, value in zip(("style", "clip-path"), looks.pop(), strict=True):
        if value is not None:
            group.set(name, value)
    for link, (mark, _) in zip(links, marks, strict=True):
        if mark is not None:
            for name in ("style", "clip-path"):
                mark.attrib.pop(name, None)
            mark.tail = link.text = None
            link[:] = [mark]
            link.tail = "\n"


def _mark_of(link: ET.Element) -> tuple[ET.Element | None, str | None]:
    """Return the one mark that a link holds and the clip around it."""
    inner: ET.Element | None = link
    while inner is not None and inner.tag not in _MARKS:
        clip = inner.get("clip-path")
        inner = inner[0] if len(inner) == 1 else None
    if inner is None:
        return None, None
    return inner, inner.get("clip-path") or clip


def _rounded(match: re.Match[str]) -> str:
    return f"{float(match[0]):.1f}".rstrip("0").rstrip(".") or "0"


_DIGITS = 5


def figure_data(figure: Figure) -> dict[str, Any]:
    """Return what a figure shows as numbers, for a file of JSON.

    The numbers are those that are drawn: long records are thinned as they are in the figure.

    Result: ``panels``: each with ``title``, ``x`` and ``y`` (labels of the axes, with units) and ``series``.
    A series has a ``label``, and ``x`` and ``y`` of equal length; a value that is not a number is ``None``.
    Lines across a panel have ``x`` or ``y`` alone.
    """
    panels = []
    for axes in figure.axes:
        series = [*_bars(axes), *_lines(axes), *_areas(axes)]
        if series:
            # The label of the abscissa; panels that share it have it below the last one only.
            shared = axes.get_shared_x_axes().get_siblings(axes)
            across = next((each.get_xlabel() for each in (axes, *shared) if each.get_xlabel()), "")
            panels.append(
                {"title": axes.get_title(loc="left") or axes.get_title(), "x": across,
                 "y": axes.get_ylabel(), "series": series}
            )  # fmt: skip
    return {"panels": panels}


def _lines(axes: Axes) -> list[dict[str, Any]]:
    result = []
    for line in axes.lines:
        name = _name(line.get_label())
        x, y = (_column(values) for values in (line.get_xdata(), line.get_ydata()))
        if line.get_transform() == axes.transData:
            result.append({"label": name, "x": x, "y": y})
        elif name and line.get_transform() == axes.get_yaxis_transform(which="grid"):
            result.append({"label": name, "y": y[:1]})
        elif name and line.get_transform() == axes.get_xaxis_transform(which="grid"):
            result.append({"label": name, "x": x[:1]})
    return result


def _bars(axes: Axes) -> list[dict[str, Any]]:
    result = []
    for bars in axes.containers:
        if not isinstance(bars, BarContainer):
            continue
        name = _name(bars.get_label())
        if bars.orientation == "horizontal":
            middles = [bar.get_y() + 0.5 * bar.get_height() for bar in bars.patches]
            sizes = _column([bar.get_x() + bar.get_width() for bar in bars.patches])
            result.append({"label": name, "x": sizes, "y": _ticks(axes.yaxis, middles)})
        else:
            middles = [bar.get_x() + 0.5 * bar.get_width() for bar in bars.patches]
            sizes = _column([bar.get_y() + bar.get_height() for bar in bars.patches])
            result.append({"label": name, "x": _ticks(axes.xaxis, middles), "y": sizes})
    return result


def _ticks(axis: Axis, places: list[float]) -> list[Any]:
    """Return what stands at the ticks nearest to places; the places themselves where these are numbers."""
    if not isinstance(axis.get_major_locator(), FixedLocator):
        return _column(places)
    ticks = np.asarray(axis.get_majorticklocs())
    words = [text.get_text() for text in axis.get_majorticklabels()]
    return [words[int(np.argmin(np.abs(ticks - place)))] for place in places]


def _areas(axes: Axes) -> list[dict[str, Any]]:
    result = []
    for each in axes.collections:
        name = _name(each.get_label())
        for points in _outlines(each):
            if len(points):
                result.append({"label": name, "x": _column(points[:, 0]), "y": _column(points[:, 1])})
    return result


def _outlines(collection: Collection) -> list[np.ndarray]:
    """Return the points of an area, of points, or the ends of short lines, all in one."""
    if isinstance(collection, PathCollection):
        return [np.asarray(collection.get_offsets(), dtype=float)]
    if isinstance(collection, LineCollection):
        segments = [np.asarray(each, dtype=float) for each in collection.get_segments()]
        return [np.concatenate(segments)] if segments else []
    if isinstance(collection, PolyCollection):
        return [np.asarray(path.vertices, dtype=float) for path in collection.get_paths()]
    return []


def _name(label: object) -> str:
    text = str(label or "")
    return "" if text.startswith("_") else text


def _column(values: Any) -> list[float | None]:
    numbers: Any = np.ravel(np.ma.filled(np.ma.asarray(values, dtype=float), np.nan))
    return [float(f"{v:.{_DIGITS}g}") if math.isfinite(v) else None for v in numbers.tolist()]


COLUMNS, ROWS = 400, 400
"""Grid of a full-width panel whose cells are as fine as its lines are thick, some two pixels of a screen."""


def thinned(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Return a line with fewer points that looks the same.

    Over an ascending x each of ``COLUMNS`` intervals keeps its first, last, lowest and highest point, so no
    peak is lost. Otherwise (a loop) points are left out that fall into the same cell of the figure as the one
    before. Short lines come back as they are.

    ``x``, ``y``: shape (n,); NaN in y interrupts the line. Result: x and y of shape (m,), m ≤ n, points of
    the given line in the given order.
    """
    abscissa, ordinate = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if len(abscissa) <= 2 * COLUMNS:
        return abscissa, ordinate
    keep = _envelope(abscissa, ordinate) if np.all(np.diff(abscissa) > 0.0) else _cells(abscissa, ordinate)
    return abscissa[keep], ordinate[keep]


def _envelope(x: Array, y: Array) -> Indices:
    edges = np.searchsorted(x, np.linspace(x[0], x[-1], COLUMNS + 1)[1:-1])
    parts = [part for part in np.split(np.arange(len(x)), edges) if len(part)]
    kept: set[int] = set()
    for part in parts:
        kept |= {int(part[0]), int(part[-1])}
        if np.all(np.isnan(y[part])):
            continue
        kept |= {int(part[np.nanargmin(y[part])]), int(part[np.nanargmax(y[part])])}
        kept |= {int(item) for item in part[np.isnan(y[part])][:1]}
    return np.array(sorted(kept), dtype=np.intp)


def _cells(x: Array, y: Array) -> Indices:
    columns = [_cell(x, COLUMNS), _cell(y, ROWS)]
    moved = np.any(np.diff(np.array(columns), axis=1) != 0, axis=0)
    return np.flatnonzero(np.concatenate([[True], moved]))


def _cell(values: Array, count: int) -> NDArray[np.int64]:
    low, span = np.nanmin(values), np.ptp(values[np.isfinite(values)]) or 1.0
    share = np.nan_to_num((values - low) / span, nan=-1.0)
    return np.asarray(np.round(share * count), dtype=np.int64)
