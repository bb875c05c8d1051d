"""Pages of the components of decks: law, figure, numbers, a deck that a test reads."""

from __future__ import annotations

import dataclasses
import math
import re
from concurrent.futures import ProcessPoolExecutor
from html import escape
from pathlib import Path

from nlsdesign.components import Part
from nlsdesign.components.assembly.deck_reader import component_classes
from nlsdesign.components.assembly.deck_writer import deck_text
from nlsdesign.components.core.part_numbers import readings, templates
from nlsdesign.foundation.errors import NlsError
from nlsdesign.foundation.quantity import Quantity, typeset_unit
from tests.parts import examples
from tests.parts.systems import around

from . import bibliography, formula, markup, part_figures
from .rooms import room_of

ROOMS = {
    "core": ("Springs, dampers, combinations", "What any network is made of."),
    "materials": ("Rubber and other materials", "Laws of stress and strain; they stand inside a `Specimen`."),
    "transmission": ("Cams and cables", "What turns an angle into an extension, and what guides the pull."),
    "mechanics": (
        "Bodies, friction, gears, drives, controllers",
        "What moves, what drives it, what resists.",
    ),
    "sensing": ("Sensors", "What is read, and what is wrong with the reading."),
}
"""Title and one sentence for each inner room of ``components``."""

_FOLDED_FROM = 16
"""Lines of a deck from which on it is folded."""


def pages(root: Path, folder: Path) -> dict[str, str]:
    """Return one page for each inner room of ``components`` and one that lists all parts.

    Parameters
    ----------
    root, folder
        Of the project and of the staged sources; not needed here.
    """
    by_class = instances()
    known = component_classes()
    with ProcessPoolExecutor(2) as pool:
        drawn = dict(
            zip(known, pool.map(drawing, known, [by_class[n] for n in known], chunksize=6), strict=True)
        )
    made: dict[str, str] = {}
    for room, (title, sentence) in ROOMS.items():
        names = [name for name, kind in known.items() if room_of(kind) == room]
        text = f"# {title}\n\n{sentence}\n\n"
        made[f"reference/parts/{room}.md"] = text + "".join(
            _part(name, known[name], by_class[name], drawn[name]) for name in names
        )
    return made | {"reference/parts/index.md": _list(known)}


def instances() -> dict[str, list[Part]]:
    """Return the examples of the conformance test by the name of their class."""
    found: dict[str, list[Part]] = {}
    for part in examples():
        found.setdefault(type(part).__name__, []).append(part)
    return found


def drawing(name: str, parts: list[Part]) -> str:
    """Return the figure of a part as SVG; empty where none can be drawn.

    Parameters
    ----------
    name
        Of its class.
    parts
        Examples; the first that answers a prescribed motion is drawn.
    """
    for part in parts:
        try:
            figure = part_figures.figure(part, name)
        except NlsError:  # for instance dry friction, which needs an inertia that it can hold
            continue
        if figure is not None:
            return markup.plot(markup.drawings(figure, name), escape(part.title()))
    return ""


def deck_example(part: Part) -> str:
    """Return the smallest deck in which a part does something, as the conformance test flattens it.

    Parameters
    ----------
    part
        An example of it.
    """
    text = deck_text(around(part)).replace('"not stated"', '"assumed: example"')
    return re.sub(r"\A\[deck\]\n.*?\n\n", "", text, flags=re.S).strip()


def _list(known: dict[str, type[Part]]) -> str:
    rows = [
        [
            f'<a href="{room_of(kind)}.html#part-{name}"><code>{name}</code></a>',
            ", ".join(sorted(kind.phenomena)),
            markup.inline(" ".join((kind.__doc__ or "").split("\n\n")[0].split())),
        ]
        for name, kind in known.items()
    ]
    entries = "\n".join(ROOMS)
    return (
        "# Parts of decks\n\nMade from the components, as `nlsdesign parts` lists them. Every table of a "
        "deck "
        'names one of these with `component = "…"`; `between` says which bodies an element ties, `of` which '
        "signal a sensor reads. Every number has `value`, `unit` and `source`, and may have a `spread`.\n\n"
        + markup.table(("part", "phenomena", "law"), rows, caption=f"All {len(known)} parts")
        + f"```{{toctree}}\n:hidden:\n\n{entries}\n```\n"
    )


def _part(name: str, kind: type[Part], parts: list[Part], drawn: str) -> str:
    written = markup.sections(kind)
    text = written[""]
    laws = [markup_of(each) for each in _laws(text)]
    shown = "".join(f'<div class="equation">{each}</div>\n' for each in laws)
    domains = ", ".join(each.name.replace("_", " ") for each in kind.domains())
    facts = f'<p class="facts">Domains: {domains}</p>\n\n' if domains else ""
    return (
        markup.anchor(f"part-{name}")
        + f"## {name}\n\n"
        + (f"{shown}\n\n" if shown else "")
        + markup.prose(text)
        + facts
        + bibliography.sources(text, up="../../")
        + drawn
        + _numbers(name, kind)
        + "".join(_deck(each) for each in _different(parts))
    )


def _laws(text: str) -> list[str]:
    """Return the formulas of the first paragraph that are definitions, else the first one after it."""
    paragraphs = [" ".join(p.split()) for p in text.split("\n\n")]
    found = [f for f in formula.formulas(paragraphs[0]) if " = " in f and not f.endswith("= 0")]
    later = [f for p in paragraphs[1:] for f in formula.formulas(p) if " = " in f and not f.endswith("= 0")]
    return found or later[:1]


def markup_of(law: str) -> str:
    """Return a law on a line of its own.

    Parameters
    ----------
    law
        In the notation of docstrings.
    """
    return formula.mathml(law, block=True)


def _different(parts: list[Part]) -> list[Part]:
    """Return one example for each choice of readings."""
    chosen: dict[tuple[str, ...], Part] = {}
    for part in parts:
        chosen.setdefault(tuple(type(getattr(part, f)).__name__ for f in readings(type(part))), part)
    return list(chosen.values())


def _deck(part: Part) -> str:
    text = deck_example(part)
    held = [type(getattr(part, field)).__name__ for field in readings(type(part))]
    chosen = [name for name in held if name != "NotDeclared"]
    title = "In a deck" + (f", read as {' and '.join(chosen)}" if chosen else "")
    block = markup.code(text, "toml")
    if text.count("\n") >= _FOLDED_FROM or chosen:
        return markup.folded(title, block)
    return f"<p>{title}</p>\n\n{block}"


def _numbers(name: str, kind: type[Part]) -> str:
    rows = [_row(n, kind, kind) for n in templates(kind)]
    for field, several in readings(kind).items():
        for each in several:
            rows += [_row(n, kind, each, f"{field} = {each.__name__}") for n in templates(each)]
    if not rows:
        return ""
    columns = ("number", "unit", "range", "default", "meaning")
    return markup.table(columns, rows, caption=f"Numbers of {name}")


def _row(number: str, kind: type[Part], holder: type, where: str = "") -> list[str]:
    info = kind.parameter_infos()[number]
    field = next(f for f in dataclasses.fields(holder) if f.name == number)
    default = field.default
    shown = escape(str(default)) if isinstance(default, Quantity) else "required"
    meaning = info.description + (", a row" if info.row else "")
    meaning += f" (with <code>{where}</code>)" if where else ""
    return [f"<code>{number}</code>", units(number, kind), _range(info.minimum, info.maximum), shown, meaning]


def units(number: str, kind: type[Part]) -> str:
    """Return the units of a number in all domains of a part.

    Parameters
    ----------
    number
        Name of the field.
    kind
        The component.
    """
    every = [kind.parameter_infos(domain)[number].unit for domain in kind.domains() or (None,)]
    return " or ".join(escape(typeset_unit(unit) or "1") for unit in dict.fromkeys(every))


def _range(low: float, high: float) -> str:
    if math.isinf(low) and math.isinf(high):
        return "any"
    if math.isinf(high):
        return f"≥ {_number(low)}"
    return f"≤ {_number(high)}" if math.isinf(low) else f"{_number(low)} to {_number(high)}"


def _number(value: float) -> str:
    text = f"{value:g}"
    match = re.fullmatch(r"(-?[\d.]+)e([+-])0*(\d+)", text)
    if not match:
        return text.replace("-", "−")
    sign = "−" if match[2] == "-" else ""
    factor = "" if match[1] == "1" else f"{match[1]}·"
    return f"{factor}10<sup>{sign}{match[3]}</sup>"
