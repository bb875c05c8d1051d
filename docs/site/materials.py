"""The page of the library of rubbers."""

from __future__ import annotations

from html import escape
from pathlib import Path

from nlsdesign.foundation import rubber_library as library

from . import bibliography, markup


def pages(root: Path, folder: Path) -> dict[str, str]:
    """Return the page of all materials with value, conditions, evidence and source.

    Parameters
    ----------
    root, folder
        Of the project and of the staged sources; not needed here.
    """
    text = (
        "# Materials\n\nRubbers of the library (`models/materials.toml`), as `nlsdesign materials` lists "
        "them. Each value has the conditions that its source states; a dash where it states none. "
        "How to take one: [Choose a rubber](../how_to/choose_a_rubber.md).\n\n"
    )
    return {"reference/materials.md": text + "".join(_material(m) for m in library.materials().values())}


def _material(material: library.Material) -> str:
    columns = ("property", "value", *(c.replace("_", " ") for c in library.CONDITIONS), "evidence", "source")
    rows = [[escape(str(cell)) for cell in row] for row in material.rows()]
    said = [any(row[i].strip("–") for row in rows) for i in range(len(columns))]
    columns = tuple(c for c, kept in zip(columns, said, strict=True) if kept)
    rows = [[cell for cell, kept in zip(row, said, strict=True) if kept] for row in rows]
    remark = f"<p>{markup.inline(material.remark)}</p>\n\n" if material.remark else ""
    every = " ".join(row[-1] for row in material.rows())
    return (
        f"## {material.name}\n\n<p>{escape(material.family)}: {escape(material.grade)}</p>\n\n{remark}"
        + markup.table(columns, rows, caption=f"What is known of {escape(material.name)}")
        + bibliography.sources(every, up="../")
    )
