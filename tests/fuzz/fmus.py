"""Mutated FMUs in a co-simulation: archives, descriptions, binaries; a crash ends no other process."""

from __future__ import annotations

import io
import random
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import Stepping, cosimulate, export_fmu
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten

from ..child_processes import children
from ..hand_built import controller
from .cases import ACCEPTED, Case, Outcome, judged_by
from .mutators import EVIL_NUMBERS, EVIL_TEXTS, damaged_bytes, damaged_tokens

DESCRIPTION = "modelDescription.xml"
FILE = "one.fmu"
_ODD_NAMES = (
    "../out.txt", "/tmp/out.txt", "a\\..\\b", "C:/x", "x" * 300, "a/" * 200, "nul\x01",
    "resources/../../x", "", ".",
    "..", "a//b", "binaries", "ü/ß", "resources", "modelDescription.xml/x",
)  # fmt: skip


class Fmus:
    """Sampled and continuous FMUs, damaged in each of their parts."""

    limit = 60.0

    def __init__(
        self, *, models: tuple[str, ...] = ("controller", "plant"), versions: tuple[str, ...] = ("2.0", "3.0")
    ) -> None:
        with tempfile.TemporaryDirectory() as name:
            self._sound = [
                export_fmu(
                    _model(model), Path(name) / f"{model}{version[0]}.fmu", version=version
                ).read_bytes()
                for model in models
                for version in versions
            ]

    def undamaged(self) -> list[Case]:
        """Return the FMUs as they should be, which are accepted."""
        return [Case({FILE: content}, how="undamaged") for content in self._sound]

    def made(self, random: random.Random, number: int) -> Case:
        sound = random.choice(self._sound)
        kind = number % 6
        if kind == 0:
            return Case({FILE: damaged_bytes(random, sound)}, how="bytes of the archive")
        if kind == 1:
            at = len(sound) - 3000
            return Case(
                {FILE: sound[:at] + damaged_bytes(random, sound[at:])}, how="directory of the archive"
            )
        if kind == 2:
            return Case({FILE: _other_entries(random, sound)}, how="entries")
        if kind == 3:
            return self._changed(
                sound, _is_description, lambda c: _other_xml(random, c), "tokens of the description"
            )
        if kind == 4:
            return self._changed(
                sound, _is_description, lambda c: damaged_bytes(random, c), "bytes of the description"
            )
        return self._changed(sound, _is_binary, lambda c: damaged_bytes(random, c), "machine code")

    @staticmethod
    def _changed(
        sound: bytes, chosen: Callable[[str], bool], change: Callable[[bytes], bytes], how: str
    ) -> Case:
        entries = {n: change(c) if chosen(n) else c for n, c in _entries(sound).items()}
        return Case({FILE: _archive(entries)}, how=how)

    def judged(self, case: Case, folder: Path) -> Outcome:
        before, others = tempfile.tempdir, children()
        place = folder / "temporary"
        place.mkdir()
        tempfile.tempdir = str(place)
        try:
            outcome = judged_by(lambda: _run(folder / FILE))
        finally:
            tempfile.tempdir = before
        left = sorted(each.name for each in place.iterdir())
        if left:
            return Outcome("left over", left[0].rpartition("-")[0])
        return Outcome("left over", "a process") if children() - others else outcome


def _run(file: Path) -> Outcome:
    cosimulate(fmus={"one": file}, wires={}, inputs={}, stop=0.01, step=Stepping(1e-3, patience=3.0))
    return Outcome(ACCEPTED)


def _model(name: str) -> FlatModel:
    return controller() if name == "controller" else flatten(declare(load_deck("dfki_pendulum")))


def _is_description(name: str) -> bool:
    return name == DESCRIPTION


def _is_binary(name: str) -> bool:
    return name.startswith("binaries/") and not name.endswith("/")


def _entries(archive: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(archive)) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


def _archive(entries: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as written:
        for name, content in entries.items():
            written.writestr(name, content)
    return stream.getvalue()


def _other_entries(chance: random.Random, archive: bytes) -> bytes:
    """Return an archive with entries that are missing, renamed, doubled, links, or far larger than stated."""
    entries = list(_entries(archive).items())
    kind = chance.randrange(7)
    at = chance.randrange(len(entries))
    if kind == 0:
        del entries[at]
    elif kind == 1:
        entries.append((chance.choice(_ODD_NAMES), b"x"))
    elif kind == 2:
        entries[at] = (chance.choice(_ODD_NAMES), entries[at][1])
    elif kind == 3:
        entries.append(entries[at])
    elif kind == 4:
        entries.append(("resources/zeros", b"\x00" * 3_000_000))
    elif kind == 5:
        entries[at] = (entries[at][0], b"")
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as written:
        for name, content in entries:
            information = zipfile.ZipInfo(name or "x")
            if kind == 6 and name == entries[at][0]:
                information.external_attr = 0o120777 << 16
                content = b"/etc/passwd"
            information.compress_type = zipfile.ZIP_DEFLATED
            written.writestr(information, content)
    content = stream.getvalue()
    if kind == 4:
        stated = chance.choice((10, 2**31, 2**32 - 1)).to_bytes(4, "little")
        content = content.replace((3_000_000).to_bytes(4, "little"), stated)
    return content


def _other_xml(chance: random.Random, content: bytes) -> bytes:
    """Return a description with other values, or elements that are moved, doubled or left out."""
    text = content.decode()
    kind = chance.randrange(4)
    if kind == 0:
        return damaged_tokens(chance, text).encode("utf-8", "surrogatepass")
    if kind == 1:
        lines = text.split("\n")
        at = chance.randrange(len(lines))
        lines[at : at + 1] = chance.choice(([], [lines[at]] * 2, [lines[at], chance.choice(lines)]))
        return "\n".join(lines).encode()
    if kind == 2:
        pieces = text.split('"')
        at = 2 * chance.randrange(len(pieces) // 2) + 1
        pieces[at] = chance.choice((*EVIL_NUMBERS, *EVIL_TEXTS, "1.0", "independent", "output", "String"))
        return '"'.join(pieces).encode("utf-8", "surrogatepass")
    entity = (
        '<!DOCTYPE x [<!ENTITY a "'
        + "b" * 1000
        + '">'
        + "".join(f'<!ENTITY a{k} "{("&a" + (str(k - 1) if k else "") + ";") * 10}">' for k in range(9))
        + '<!ENTITY f SYSTEM "file:///etc/passwd">]>'
    )
    head, _, rest = text.partition("?>")
    used = chance.choice(("&a8;", "&f;", "&unknown;"))
    rest = rest.replace('description="', f'description="{used}', 1)
    return f"{head}?>{entity}{rest}".encode()
