"""The bundled compiler: found or asked for, its complaints passed on, its cache where it belongs."""

from __future__ import annotations

import ctypes
import platform
from pathlib import Path

import pytest

from nlsdesign.export.compilation import cross_compiler as compiling
from nlsdesign.export.compilation.cross_compiler import (
    ALL_PLATFORMS,
    PLATFORMS,
    cache_folder,
    chosen_platforms,
    compile_library,
    host_platform,
)
from nlsdesign.foundation.errors import ExportError, UnknownNameError

MAGIC = {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xcf\xfa\xed\xfe"}
# Of the file formats: e_machine of ELF, Machine of PE, cputype of Mach-O.
PROCESSOR = {
    "x86_64-linux": (18, 62),
    "aarch64-linux": (18, 183),
    "x86_64-windows": (None, 0x8664),
    "x86_64-darwin": (4, 0x0007),
    "aarch64-darwin": (4, 0x000C),
}


@pytest.fixture
def source(tmp_path) -> Path:
    file = tmp_path / "one.c"
    file.write_text(
        "#include <math.h>\n#ifdef _WIN32\n__declspec(dllexport)\n#else\n"
        '__attribute__((visibility("default")))\n#endif\n'
        "double one(double x);\ndouble one(double x) { return sin(x) * sin(x) + cos(x) * cos(x) + x; }\n"
    )
    return file


def test_a_library_for_this_machine_runs(source, tmp_path):
    library = ctypes.CDLL(str(compile_library([source], tmp_path / "one.so")))
    library.one.restype = ctypes.c_double
    assert library.one(ctypes.c_double(0.5)) == pytest.approx(1.5, rel=1e-15)


# The first library for a platform takes as long as its C library takes to build.
@pytest.mark.long_cases("aarch64-linux", "x86_64-darwin", "aarch64-darwin")
@pytest.mark.parametrize("name", ALL_PLATFORMS)
def test_a_library_is_built_for_each_platform(name, source, tmp_path):
    where = PLATFORMS[name]
    data = compile_library([source], tmp_path / f"one{where.extension}", platform=where).read_bytes()
    assert data.startswith(MAGIC[where.extension])
    at, processor = PROCESSOR[name]
    place = data.index(b"PE\0\0") + 4 if at is None else at
    assert int.from_bytes(data[place : place + 2], "little") == processor
    assert b"one" in data
    assert str(tmp_path).encode() not in data


def test_without_the_wheel_the_next_step_is_named(source, tmp_path, monkeypatch):
    monkeypatch.setattr(compiling, "find_spec", lambda name: None)
    with pytest.raises(ExportError, match=r"pip install 'nlsdesign\[export\]'"):
        compile_library([source], tmp_path / "one.so")
    assert not (tmp_path / "one.so").exists()


def test_a_mistake_in_c_is_passed_on(tmp_path):
    (tmp_path / "bad.c").write_text("int f(void) { return missing; }\n")
    with pytest.raises(ExportError, match=r"bad\.c for .*missing"):
        compile_library([tmp_path / "bad.c"], tmp_path / "bad.so")


def test_platforms_are_chosen_by_name():
    assert [each.name for each in chosen_platforms(None)] == [host_platform()]
    assert [each.name for each in chosen_platforms(["x86_64-windows", "x86_64-windows"])] == [
        "x86_64-windows"
    ]
    with pytest.raises(UnknownNameError, match="did you mean 'x86_64-linux'"):
        chosen_platforms(["x64-linux"])


def test_an_unknown_machine_is_named(monkeypatch):
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    monkeypatch.setattr(platform, "system", lambda: "Linux")
    with pytest.raises(ExportError, match="riscv64-linux"):
        host_platform()


def test_the_cache_is_in_the_users_folder_or_where_it_is_told(tmp_path, monkeypatch):
    monkeypatch.setenv("NLSDESIGN_CACHE", str(tmp_path / "here"))
    assert cache_folder() == tmp_path / "here"
    monkeypatch.delenv("NLSDESIGN_CACHE")
    if platform.system() == "Linux":
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
        assert cache_folder() == tmp_path / "cache" / "nlsdesign"
        (tmp_path / "file").write_text("in the way")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
        fallback = cache_folder()
        assert fallback.name.startswith("nlsdesign-")
        assert tmp_path not in fallback.parents
