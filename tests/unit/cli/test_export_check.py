"""``nlsdesign export check`` tells what belongs together, what was edited, and what cannot be read."""

from __future__ import annotations

import io
import json
import os
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import deck_digest, declare, write_deck
from nlsdesign.export import export_c, export_fmu, exported_files
from nlsdesign.export.fmi.fmu_documentation import ORIGIN_FILE
from nlsdesign.feedback.control import torque_controller
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests.command_line import Run, run
from tests.hand_built import observer as hand_built_observer

__all__ = ["run"]
SPRING = "austin2015_soft_spring"


def made(name: str = SPRING) -> Assembly:
    return declare(load_deck(name))


@pytest.fixture(scope="module")
def master(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as an export leaves it: deck, C of the controller, FMU of the plant."""
    folder = tmp_path_factory.mktemp("exported")
    plant = flatten(made())
    write_deck(made(), folder / "model.toml")
    export_c(torque_controller(plant), folder / "c", name="law")
    export_fmu(plant, folder / "plant.fmu")
    (folder / "main.c").write_text("int main(void) { return 0; }\n", encoding="utf-8")
    (folder / "records.toml").write_text('[time]\nname = "t"\n', encoding="utf-8")
    return folder


@pytest.fixture
def folder(master: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(master, tmp_path / "copy"))


def check(run: Run, folder: Path, *options: str) -> tuple[int, str, str]:
    return run("export", "check", str(folder), *options)


def states(content: str) -> dict[str, str]:
    return {row["path"]: row["why"] for row in json.loads(content)["files"]}


def test_what_was_exported_together_belongs_together(run: Run, folder: Path) -> None:
    status, output, _ = check(run, folder)
    assert status == 0, output
    assert f"All 5 files belong to one deck, {deck_digest(made())[:12]}." in output
    status, output, _ = check(run, folder, "--deck", SPRING, "--json")
    assert status == 0
    assert sorted(states(output)) == ["c/law.c", "c/law.h", "c/law_selftest.c", "model.toml", "plant.fmu"]
    assert json.loads(output)["deck"] == deck_digest(made())
    assert {row["deck"] for row in json.loads(output)["files"]} == {SPRING, ""}


def test_line_ends_of_another_system_are_no_edit(run: Run, folder: Path) -> None:
    for path in (folder / "c").iterdir():
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert check(run, folder)[0] == 0


def test_code_of_another_deck_is_found(run: Run, folder: Path) -> None:
    export_c(torque_controller(flatten(made("austin2015_stiff_spring"))), folder / "c2", name="law")
    status, output, _ = check(run, folder)
    assert status == 1
    assert "they are of 2 decks" in output
    status, output, _ = check(run, folder, "--deck", SPRING, "--json")
    assert status == 1
    assert {path for path, why in states(output).items() if why} == {
        f"c2/law{e}" for e in (".c", ".h", "_selftest.c")
    }
    status, output, _ = check(run, folder / "c2", "--deck", SPRING)
    assert status == 1


def test_the_same_machine_with_one_other_number_does_not_belong(run: Run, folder: Path) -> None:
    model = torque_controller(flatten(made()).with_values({"motor.inertia": 6e-4}))
    export_c(model, folder / "c", name="law")
    status, output, _ = check(run, folder, "--deck", str(folder / "model.toml"), "--json")
    assert status == 1
    assert {Path(p).parent.name for p, why in states(output).items() if why == "another deck"} == {"c"}


def edited(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def repacked(path: Path, change: Callable[[dict[str, bytes]], object]) -> None:
    with zipfile.ZipFile(path) as archive:
        contents = {name: archive.read(name) for name in archive.namelist()}
    change(contents)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in contents.items():
            archive.writestr(name, content)


def flipped(contents: dict[str, bytes]) -> None:
    name = next(name for name in contents if name.startswith("binaries/"))
    contents[name] = contents[name][:-1] + bytes([contents[name][-1] ^ 1])


def origin_with(**fields: object) -> Callable[[dict[str, bytes]], None]:
    def change(contents: dict[str, bytes]) -> None:
        contents[ORIGIN_FILE] = json.dumps(json.loads(contents[ORIGIN_FILE]) | fields).encode()

    return change


EDITED: dict[str, tuple[str, Callable[[Path], object], str]] = {
    "a number in the source": ("c/law.c", lambda p: edited(p, "0.", "1."), "its text is not"),
    "a comment in the header": ("c/law.h", lambda p: edited(p, "step reads", "it reads"), "its text"),
    "the digest in the header": (
        "c/law.h", lambda p: edited(p, f'"{deck_digest(made())}"', f'"{"0" * 64}"'), "its text",
    ),
    "the last comment": ("c/law.c", lambda p: edited(p, "/* Exported", "/* Made"), "its last comment"),
    "the deck of the last comment": (
        "c/law.c", lambda p: edited(p, f"; deck {deck_digest(made())[:12]}", f"; deck {'0' * 12}"), "2 decks",
    ),
    "one bit of the library": ("plant.fmu", lambda p: repacked(p, flipped), "changed: binaries/"),
    "a file more": ("plant.fmu", lambda p: repacked(p, lambda c: c.update({"x.so": b"1"})), "added: x.so"),
    "a file less": (
        "plant.fmu", lambda p: repacked(p, lambda c: c.pop("documentation/index.html")), "missing: doc",
    ),
    "no origin": ("plant.fmu", lambda p: repacked(p, lambda c: c.pop(ORIGIN_FILE)), "it has no"),
}  # fmt: skip


@pytest.mark.parametrize("what", EDITED)
def test_what_was_edited_after_the_export_is_found(what: str, run: Run, folder: Path) -> None:
    name, change, words = EDITED[what]
    change(folder / name)
    status, output, _ = check(run, folder, "--json")
    assert status == 1
    assert states(output)[name].startswith("edited: ")
    assert words in states(output)[name]


def test_code_without_a_deck_belongs_to_none(run: Run, folder: Path) -> None:
    export_c(hand_built_observer(), folder / "c", name="eye")
    status, output, _ = check(run, folder, "--deck", SPRING, "--json")
    assert status == 1
    assert states(output)["c/eye.h"] == "names no deck"


UNREADABLE: dict[str, tuple[Callable[[Path], object], str]] = {
    "cut archive": (lambda f: os.truncate(f / "plant.fmu", 9000), "damaged"),
    "no archive": (lambda f: (f / "plant.fmu").write_text("hello"), "damaged"),
    "other archive": (lambda f: repacked(f / "plant.fmu", lambda c: c.pop("modelDescription.xml")), "no FMU"),
    "origin is no JSON": (
        lambda f: repacked(f / "plant.fmu", lambda c: c.update({ORIGIN_FILE: b"{"})), "is no JSON",
    ),
    "origin is deep": (
        lambda f: repacked(f / "plant.fmu", lambda c: c.update({ORIGIN_FILE: b"[" * 100_000})), "is no JSON",
    ),
    "origin of another kind": (lambda f: repacked(f / "plant.fmu", origin_with(format=1)), "not of the"),
    "origin without files": (lambda f: repacked(f / "plant.fmu", origin_with(files=[])), "lacks the deck"),
    "origin with a false digest": (
        lambda f: repacked(f / "plant.fmu", origin_with(deck={"name": "a", "sha256": "../../etc"})),
        "lacks the deck",
    ),
    "C that is no text": (lambda f: (f / "c" / "law.c").write_bytes(b"\xff\xfe\x00"), "no text in UTF-8"),
    "deck that is no TOML": (lambda f: (f / "model.toml").write_text("[deck\n"), "cannot be read as a deck"),
    "deck that is deep": (lambda f: (f / "model.toml").write_text("a = " + "[" * 9000), "too deeply"),
    "deck with a false unit": (lambda f: edited(f / "model.toml", '"kg*m^2"', '"mm"'), "read as a deck"),
}  # fmt: skip


@pytest.mark.parametrize("what", UNREADABLE)
def test_what_cannot_be_read_is_named_with_the_reason(what: str, run: Run, folder: Path) -> None:
    change, words = UNREADABLE[what]
    change(folder)
    before = sorted(folder.rglob("*"))
    status, output, _ = check(run, folder)
    assert status == 2, output
    assert words in output
    assert "Traceback" not in output
    assert sorted(folder.rglob("*")) == before
    assert json.loads(check(run, folder, "--json")[1])["unreadable"]


def test_an_archive_that_unpacks_to_too_much_is_refused(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    repacked(folder / "plant.fmu", lambda c: c.update({"zeros": bytes(3 << 20)}))
    monkeypatch.setattr(exported_files, "LARGEST_ARCHIVE", 2 << 20)
    status, output, _ = check(run, folder)
    assert status == 2
    assert "unpacks to more than 2 MB" in output


def test_one_flipped_byte_of_an_archive_is_an_edit_or_an_error(folder: Path) -> None:
    whole = (folder / "plant.fmu").read_bytes()
    names = zipfile.ZipFile(io.BytesIO(whole)).namelist()
    assert len(names) > 5
    for place in range(0, len(whole), len(whole) // 60):
        path = folder / "flipped.fmu"
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x10]) + whole[place + 1 :])
        try:
            found = exported_files.exported_file(path)
        except exported_files.ExportError:
            continue
        # What is left are dates and access rights, which are no content.
        assert found is not None
        with zipfile.ZipFile(path) as archive:
            same = archive.namelist() == names
        assert found.edited or same


def test_pipes_links_and_foreign_files_are_passed_over(run: Run, folder: Path) -> None:
    os.mkfifo(folder / "pipe.c")
    (folder / "link.toml").symlink_to("/dev/zero")
    (folder / "round").symlink_to(folder, target_is_directory=True)
    status, output, _ = check(run, folder)
    assert status == 0
    assert "All 5 files" in output


@pytest.mark.parametrize("name", ["nowhere", "empty", "file.c"])
def test_a_folder_without_exports_is_an_error(name: str, run: Run, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file.c").write_text("")
    status, _, error = check(run, tmp_path / name)
    assert status == 2
    assert name in error


def test_a_folder_that_may_not_be_listed_is_an_error(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: object) -> object:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(os, "scandir", refuse)
    status, _, error = check(run, folder)
    assert status == 2
    assert "Permission denied" in error
