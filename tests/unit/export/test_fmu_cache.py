"""Binaries of FMUs are compiled once; what changed or is damaged is compiled anew."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from nlsdesign.export import export_fmu
from nlsdesign.export.compilation import cross_compiler
from nlsdesign.export.fmi import fmu as compiled_binaries
from nlsdesign.foundation.errors import ExportError, UnknownNameError
from tests.hand_built import controller

PLATFORMS = ("x86_64-linux", "x86_64-windows")


@pytest.fixture
def compiled(tmp_path, monkeypatch) -> list[str]:
    """An empty cache, and what the compiler is called for."""
    monkeypatch.setenv("NLSDESIGN_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    calls: list[str] = []

    def instead(arguments, *, about):
        # The content tells apart what is compiled; a real binary is not needed here.
        calls.append(about)
        target = Path(arguments[arguments.index("-o") + 1])
        sources = [Path(a) for a in arguments if str(a).endswith(".c")]
        folder = sources[-1].parent
        target.write_bytes(
            b"\0".join([about.encode(), *[p.read_bytes() for p in sorted(folder.glob("*.[ch]"))]])
        )

    monkeypatch.setattr(cross_compiler, "run_compiler", instead)
    return calls


def test_an_unchanged_model_is_not_compiled_again(compiled, tmp_path):
    first = export_fmu(controller(), tmp_path / "a.fmu", platforms=PLATFORMS).read_bytes()
    assert len(compiled) == 2
    again = export_fmu(controller(), tmp_path / "b.fmu", platforms=PLATFORMS).read_bytes()
    assert len(compiled) == 2
    assert first == again
    export_fmu(controller(), tmp_path / "c.fmu", platforms=[*PLATFORMS, "aarch64-linux"])
    assert compiled[2:] == ["fmi3.c for aarch64-linux"]


def test_a_changed_model_version_or_compiler_is_compiled_anew(compiled, tmp_path, monkeypatch):
    export_fmu(controller(), tmp_path / "a.fmu", platforms=PLATFORMS[:1])
    export_fmu(controller().with_values({"gain.integral": 41.0}), tmp_path / "a.fmu", platforms=PLATFORMS[:1])
    assert len(compiled) == 2
    export_fmu(controller(), tmp_path / "a.fmu", version="2.0", platforms=PLATFORMS[:1])
    assert len(compiled) == 3
    monkeypatch.setattr("importlib.metadata.version", lambda _: "99.0")
    compiled_binaries._compiler.cache_clear()
    export_fmu(controller(), tmp_path / "a.fmu", platforms=PLATFORMS[:1])
    compiled_binaries._compiler.cache_clear()
    assert len(compiled) == 4


def test_flags_of_the_environment_come_last_and_are_compiled_anew(compiled, tmp_path, monkeypatch):
    given, instead = [], cross_compiler.run_compiler

    def noted(arguments, *, about):
        given.append(arguments)
        instead(arguments, about=about)

    monkeypatch.setattr(cross_compiler, "run_compiler", noted)
    for flags in ("", "-O1 -g", "-O1 -g"):
        monkeypatch.setenv("NLSDESIGN_CFLAGS", flags)
        export_fmu(controller(), tmp_path / "a.fmu", platforms=PLATFORMS[:1])
    assert len(compiled) == 2
    levels = [[word for word in words if str(word) in ("-O1", "-O2", "-g")] for words in given]
    assert levels == [["-O2"], ["-O2", "-O1", "-g"]]


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "folder"])
def test_a_damaged_entry_is_compiled_anew(compiled, tmp_path, damage):
    first = export_fmu(controller(), tmp_path / "a.fmu", platforms=PLATFORMS[:1]).read_bytes()
    (kept,) = (tmp_path / "cache" / "fmu").iterdir()
    content = kept.read_bytes()
    if damage == "folder":
        kept.unlink()
        kept.mkdir()
    else:
        middle = len(content) // 2
        changed = {
            "cut": content[:middle],
            "flipped": content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :],
            "empty": b"",
        }
        kept.write_bytes(changed[damage])
    assert export_fmu(controller(), tmp_path / "b.fmu", platforms=PLATFORMS[:1]).read_bytes() == first
    assert len(compiled) == 2


def test_the_cache_does_not_grow_without_end(compiled, tmp_path, monkeypatch):
    monkeypatch.setattr(compiled_binaries, "MOST_KEPT", 3)
    for k in range(6):
        model = controller().with_values({"gain.integral": 41.0 + k})
        export_fmu(model, tmp_path / "a.fmu", platforms=PLATFORMS[:1])
    assert len(list((tmp_path / "cache" / "fmu").iterdir())) == 3
    export_fmu(model, tmp_path / "a.fmu", platforms=PLATFORMS[:1])  # the last is among them
    assert len(compiled) == 6


def test_without_a_cache_there_is_an_fmu_all_the_same(compiled, tmp_path, monkeypatch):
    def refuse(path, content):
        raise ExportError(str(path), "cannot be written")

    monkeypatch.setattr(compiled_binaries, "write_bytes", refuse)
    for _ in range(2):
        unit = export_fmu(controller(), tmp_path / "a.fmu", platforms=PLATFORMS)
    with zipfile.ZipFile(unit) as archive:
        assert len([n for n in archive.namelist() if n.startswith("binaries/")]) == 2
    assert len(compiled) == 4


@pytest.mark.parametrize(
    ("named", "expected"), [("all", 5), ("x86_64-windows, aarch64-linux", 2), ("", 1), (None, 1)]
)
def test_the_environment_names_the_platforms_where_nobody_else_does(
    compiled, tmp_path, monkeypatch, named, expected
):
    if named is None:
        monkeypatch.delenv("NLSDESIGN_PLATFORMS", raising=False)
    else:
        monkeypatch.setenv("NLSDESIGN_PLATFORMS", named)
    export_fmu(controller(), tmp_path / "a.fmu")
    assert len(compiled) == expected
    export_fmu(controller().with_values({"gain.integral": 41.0}), tmp_path / "a.fmu", platforms=PLATFORMS)
    assert len(compiled) == expected + 2
    monkeypatch.setenv("NLSDESIGN_PLATFORMS", "amiga")
    with pytest.raises(UnknownNameError, match="amiga"):
        export_fmu(controller(), tmp_path / "b.fmu")
    assert not (tmp_path / "b.fmu").exists()
