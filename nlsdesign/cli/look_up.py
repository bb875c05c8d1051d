"""``nlsdesign parts``, ``materials`` and ``docs``: what comes with the package to be looked up.

The parts that a deck can name, read from their files: a list needs no numerical library.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..foundation import rubber_library as library
from ..foundation.bibliography import cited
from ..foundation.errors import unknown_name
from ..foundation.extensions import extension_names
from ..foundation.locations import folder
from ..foundation.quantity import typeset_unit
from .options import json_option
from .output import examples, show_json, show_table

if TYPE_CHECKING:
    from ..components import Part

_FOLDER = Path(__file__).parents[1] / "components"
_KINDS = {
    "Element": "element", "Body": "body", "Transmission": "gear", "Cam": "cam", "Sensor": "sensor",
    "DrivePart": "drive",
}  # fmt: skip
"""Kind of a part by the class that it descends from."""
_CLASS = re.compile(r"^class .*?(?=^[^\s)]|\Z)", re.MULTILINE | re.DOTALL)
"""The definition of a class; to read all that stands around it takes twice as long."""
_BEGINNINGS = {"Part", "Tie"}
"""From which parts descend, and which are none themselves."""


@dataclass(frozen=True)
class _Written:
    """A class as it is written: what it descends from, what it leaves open, and what it gives."""

    bases: tuple[str, ...]
    text: str
    abstract: frozenset[str]
    given: frozenset[str]

    @classmethod
    def of(cls, node: ast.ClassDef) -> _Written:
        """Return what a definition says."""
        methods = [each for each in node.body if isinstance(each, ast.FunctionDef)]
        abstract = {each.name for each in methods if "abstractmethod" in map(_name, each.decorator_list)}
        given = {each.name for each in methods} - abstract
        for each in node.body:
            if isinstance(each, ast.Assign):
                given |= set(map(_name, each.targets))
            elif isinstance(each, ast.AnnAssign) and each.value is not None:
                given.add(_name(each.target))
        text = ast.get_docstring(node, clean=False) or ""
        return cls(tuple(map(_name, node.bases)), text, frozenset(abstract), frozenset(given))


def listed_parts() -> dict[str, tuple[str, str]]:
    """Return kind and law of each part of the package that can be declared, by name."""
    files = (file.read_text(encoding="utf-8") for file in sorted(_FOLDER.rglob("*.py")))
    nodes = (node for text in files for node in ast.parse("".join(_CLASS.findall(text))).body)
    classes = {node.name: _Written.of(node) for node in nodes if isinstance(node, ast.ClassDef)}
    kinds = {}
    for name in sorted(classes):
        line = _line(name, classes)
        left_open: frozenset[str] = frozenset()
        for each in (classes[base] for base in reversed(line) if base in classes):
            left_open = left_open - each.given | each.abstract
        if name[0] == "_" or name in _BEGINNINGS or "Part" not in line or left_open:
            continue
        text = next((classes[base].text for base in line if base in classes and classes[base].text), "")
        kinds[name] = kind_of(line), first_paragraph(text)
    return kinds


def kind_of(line: tuple[str, ...]) -> str:
    """Return the kind of a part by the names of all classes that it descends from."""
    return next(kind for base, kind in _KINDS.items() if base in line)


def first_paragraph(text: str) -> str:
    """Return the first paragraph of a docstring in one line."""
    return inspect.cleandoc(text).split("\n\n")[0].replace("\n", " ")


def _name(node: ast.expr) -> str:
    """Return the last name of an expression: of ``a.B[c]`` it is ``B``."""
    while isinstance(node, ast.Subscript | ast.Call):
        node = node.value if isinstance(node, ast.Subscript) else node.func
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def _line(name: str, classes: Mapping[str, _Written]) -> tuple[str, ...]:
    """Return a class and all that it descends from, each before its own bases."""
    below = [
        each for base in (classes[name].bases if name in classes else ()) for each in _line(base, classes)
    ]
    # A base that several share stands where it comes last.
    return (name, *reversed(dict.fromkeys(reversed(below))))


@click.command(
    epilog=examples(
        "nlsdesign parts", "nlsdesign parts TwoSidedCam", "nlsdesign parts CoulombFriction --json"
    )
)
@click.argument("name", metavar="[PART]", required=False)
@json_option
def parts(name: str | None, as_json: bool) -> None:
    """List the parts that a deck can name, or show one. Law, source and numbers are shown."""
    if name is None:
        listed = listed_parts()
        if extension_names():  # what other packages bring is loaded already
            from ..components import component_classes

            brought = component_classes().items()
            listed = {n: (_kind(c), first_paragraph(inspect.getdoc(c) or "")) for n, c in brought}
        rows = sorted((kind, n, law) for n, (kind, law) in listed.items())
        if as_json:
            show_json({n: {"kind": kind, "law": law} for kind, n, law in rows})
        else:
            show_table("Parts", ("kind", "part", "law"), rows)
        return
    from ..components import component_classes, renamed

    known = component_classes()
    if name not in known:
        raise renamed(name) or unknown_name("part", name, known)
    infos, law = known[name].parameter_infos(), inspect.getdoc(known[name]) or ""
    publications = [str(reference) for reference in cited(law)]
    if as_json:
        numbers = {
            n: {
                "unit": i.unit,
                "minimum": i.minimum if math.isfinite(i.minimum) else None,  # JSON has no infinity
                "maximum": i.maximum if math.isfinite(i.maximum) else None,
                "meaning": i.description,
                "row": i.row,
            }
            for n, i in infos.items()
        }
        content = {"law": law, "references": publications, "numbers": numbers}
        show_json({"kind": _kind(known[name]), **content})
        return
    click.echo("\n".join([f"{name} ({_kind(known[name])})", "", law, "", *publications, ""]))
    columns = ("name", "unit", "from", "to", "meaning")
    row = " (a row)"
    limits = [
        (n, typeset_unit(i.unit), f"{i.minimum:g}", f"{i.maximum:g}", i.description + (row if i.row else ""))
        for n, i in infos.items()
    ]
    show_table("Numbers", columns, limits)


def _kind(part: type[Part]) -> str:
    return kind_of(tuple(each.__name__ for each in part.__mro__))


@click.command(
    epilog=examples("nlsdesign materials", "nlsdesign materials natural_rubber", "nlsdesign materials --json")
)
@click.argument("name", metavar="[MATERIAL]", required=False)
@json_option
def materials(name: str | None, as_json: bool) -> None:
    """List the rubbers of the library, or show one. Values, conditions, grade of evidence and source."""
    if name is None:
        known = library.materials()
        if as_json:
            show_json({m.name: {"family": m.family, "grade": m.grade} for m in known.values()})
            return
        rows = []
        for m in known.values():
            loss = "not known"
            if "loss_tangent" in m:
                loss = f"{m['loss_tangent'].shown} ({m['loss_tangent'].evidence})"
            rows.append((m.name, m.family, m.grade, loss))
        show_table("Materials", ("material", "family", "grade", "loss tangent"), rows)
        return
    chosen = library.material(name)
    columns = ("property", "value", *library.CONDITIONS, "evidence", "source")
    if as_json:
        rows_by_name = {row[0]: dict(zip(columns[1:], row[1:], strict=True)) for row in chosen.rows()}
        show_json({"family": chosen.family, "grade": chosen.grade, "properties": rows_by_name})
        return
    show_table(f"{chosen.name} ({chosen.family}): {chosen.grade}", columns, chosen.rows())
    if chosen.remark:
        click.echo(chosen.remark)


_SITE = "site"
"""Folder of what the pages on the web are built from."""


@click.command(
    epilog=examples("nlsdesign docs", "nlsdesign docs design_a_cam", "nlsdesign docs conventions --print"),
)
@click.argument("page", required=False)
@click.option("--print", "whole", is_flag=True, help="Print the page.")
@json_option
def docs(page: str | None, whole: bool, as_json: bool) -> None:
    """Say where the documentation is. Its pages are listed, or the file of one PAGE is named.

    Pages are Markdown, which is read in any editor.
    """
    pages = dict(_pages(folder("docs")))
    if page is None:
        if whole:
            raise click.UsageError("--print needs a PAGE, for instance: nlsdesign docs conventions --print")
        if as_json:
            show_json(
                {"folder": folder("docs"), "pages": {name: title for name, (_, title) in pages.items()}}
            )
            return
        click.echo(f"{folder('docs')}\n")
        width = max(map(len, pages))
        for name, (_, title) in pages.items():
            click.echo(f"{name:<{width}}  {title}")
        return
    name = page.removesuffix(".md")
    matches = [each for each in pages if each == name or each.rpartition("/")[2] == name]
    if len(matches) != 1:
        raise unknown_name("page", page, pages)
    file, title = pages[matches[0]]
    if as_json:
        text = {"text": file.read_text(encoding="utf-8")} if whole else {}
        show_json({"page": matches[0], "title": title, "file": file, **text})
    else:
        click.echo(file.read_text(encoding="utf-8") if whole else str(file))


def _pages(place: Path) -> Iterator[tuple[str, tuple[Path, str]]]:
    """Yield name, file and title of each page, folder by folder; what a site is made of is no page."""
    files = sorted(place.rglob("*.md"), key=lambda each: (len(each.parts), each.parent, each.name))
    for file in files:
        if file.relative_to(place).parts[0] == _SITE:
            continue
        with file.open(encoding="utf-8") as stream:
            title = stream.readline().removeprefix("#").strip()
        yield file.relative_to(place).with_suffix("").as_posix(), (file, title)
