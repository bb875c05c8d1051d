"""Fixed C templates, and atomic writing of several files."""

from __future__ import annotations

import lzma
import re
import struct
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree

from ..foundation.errors import ExportError
from ..foundation.text_files import draft
from ..model import FlatModel

BROKEN_ARCHIVE = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, EOFError, NotImplementedError, RuntimeError,
    OverflowError, ValueError, MemoryError,
)  # fmt: skip
"""What the library for archives raises for a damaged or encrypted file, or one of an unknown packing."""

_PLACEHOLDER = re.compile(r"^(?P<indent> *)@(?P<row>\w+)@\n|@(?P<name>\w+)@", re.MULTILINE)


def template(name: str) -> str:
    """Return the text of a fixed template."""
    return (files("nlsdesign.export") / "templates" / name).read_text(encoding="utf-8")


def filled(name: str, values: Mapping[str, str | Sequence[str]]) -> str:
    """Return a template with its ``@name@`` placeholders replaced.

    ``values``: by name of the placeholder: a text, or rows where the placeholder is a line of its own. Rows
    get the indentation of that line; without rows the line is left out.
    """

    def replacement(match: re.Match[str]) -> str:
        key = match["row"] or match["name"]
        if key not in values:
            raise ExportError(f"template '{name}'", f"has a placeholder '{key}' without a value")
        value = values[key]
        if isinstance(value, str):
            return match[0].replace(f"@{key}@", value)
        return "".join(f"{match['indent']}{row}\n" if row else "\n" for row in value)

    return _PLACEHOLDER.sub(replacement, template(name))


def check_continuous(model: FlatModel, *, sampled: str, step: str, sharp: str) -> None:
    """Refuse a sampled model, with what to do instead, and one with sharp laws; the words say why."""
    if model.sample_time is not None or model.tables:
        raise ExportError(f"model '{model.name}'", sampled, next_step=step)
    if model.switching is not None and model.switching.jumps:
        raise ExportError(
            f"model '{model.name}': '{model.switching.jumps[0]}'", sharp,
            next_step="export the smooth form (--smooth, or flatten(smoothed(assembly))), or the plant as "
            "FMU, which holds the sharp form",
        )  # fmt: skip


def xml_text(root: ElementTree.Element) -> str:
    """Return a tree of elements as the text of a file."""
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def write_archive(path: Path, contents: Mapping[str, bytes]) -> None:
    """Write an archive: the same bytes for the same content, without time stamps and local permissions."""
    with draft(path) as file, zipfile.ZipFile(file, "w") as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            # An FMU is compressed already.
            entry.compress_type = zipfile.ZIP_STORED if name.endswith(".fmu") else zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)


def write_all(texts: Mapping[Path, str]) -> None:
    """Write several files; none is replaced before all of them are written as temporary files."""
    if not texts:
        return
    for each in texts:
        if each.is_dir():
            raise ExportError(
                str(each), "is a folder, where a file is to be written", next_step="name another folder"
            )
    (path, text), *rest = texts.items()
    with draft(path) as name:
        name.write_text(text, encoding="utf-8", newline="\n")
        write_all(dict(rest))
