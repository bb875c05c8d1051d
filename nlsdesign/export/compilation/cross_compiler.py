"""Compiling with the C cross-compiler of the ``ziglang`` wheel; no system compiler is used."""

from __future__ import annotations

import os
import platform as machine
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

from ...foundation.errors import ExportError, unknown_name
from ...foundation.processes import run_to_end, usual_temporary_folder
from ..files import template

STRICT = (
    "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wfloat-equal",
    "-Werror",
)  # fmt: skip
"""Flags that the generated code must pass."""

BASELINE = ("-mcpu=baseline",)
"""Only instructions that every processor of the platform has: what is built here runs elsewhere too, also in
emulators and under valgrind. Without it the compiler may take those of the machine it runs on."""

THIS_PROCESSOR = ("-mcpu=native",)
"""All instructions of the machine that it runs on, for code that stays here."""


@dataclass(frozen=True)
class Platform:
    """A machine that binaries are built for."""

    name: str  # name as FMI 3.0 writes it: architecture-system
    # target: target triple of the compiler; glibc 2.17 of 2012 and macOS 11 are the oldest that are served
    target: str
    extension: str
    fmi2: str  # folder in the binaries of an FMI 2.0 unit


PLATFORMS: Mapping[str, Platform] = MappingProxyType(
    {
        each.name: each
        for each in (
            Platform("x86_64-linux", "x86_64-linux-gnu.2.17", ".so", "linux64"),
            Platform("aarch64-linux", "aarch64-linux-gnu.2.17", ".so", "aarch64-linux"),
            Platform("x86_64-windows", "x86_64-windows-gnu", ".dll", "win64"),
            Platform("x86_64-darwin", "x86_64-macos.11.0", ".dylib", "darwin64"),
            Platform("aarch64-darwin", "aarch64-macos.11.0", ".dylib", "darwin64"),
        )
    }
)
ALL_PLATFORMS = tuple(PLATFORMS)
"""Names of all platforms; the first build for each adds some seconds."""


def host_platform() -> str:
    """Return the name of the platform this program runs on."""
    processor = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}.get(
        machine.machine().lower(), machine.machine()
    )
    name = f"{processor}-{machine.system().lower()}"
    if name not in PLATFORMS:
        raise ExportError(
            f"this machine, {name}",
            "is none of the platforms that binaries are built for",
            next_step=f"name one of: {', '.join(PLATFORMS)}",
        )
    return name


def chosen_platforms(names: Sequence[str] | None) -> list[Platform]:
    """Return platforms by name; only the host when nothing is chosen."""
    chosen = [host_platform()] if names is None else list(dict.fromkeys(names))
    for name in chosen:
        if name not in PLATFORMS:
            raise unknown_name("platform", name, PLATFORMS)
    return [PLATFORMS[name] for name in chosen]


def compiler() -> list[str]:
    """Return the command of the C compiler."""
    # The program itself: ``python -m ziglang`` would start Python only to find it.
    return [str(_compilers_folder() / ("zig.exe" if sys.platform == "win32" else "zig")), "cc"]


def _compilers_folder() -> Path:
    wheel = find_spec("ziglang")
    if wheel is None or wheel.origin is None:
        raise ExportError(
            "the C compiler",
            "is not installed",
            next_step="pip install 'nlsdesign[export]' (the wheel ziglang)",
        )
    return Path(wheel.origin).parent


def cache_folder() -> Path:
    """Return the folder where the compiler keeps its start-up objects; it can be deleted at any time.

    ``NLSDESIGN_CACHE`` names another one; a folder that cannot be written is replaced by a temporary one.
    """
    named = os.environ.get("NLSDESIGN_CACHE")
    try:
        folder = Path(named) if named else _users_caches() / "nlsdesign"
        (folder / "zig").mkdir(parents=True, exist_ok=True)
        if os.access(folder / "zig", os.W_OK):
            return folder
    except (OSError, RuntimeError):  # RuntimeError: there is no home folder
        pass
    owner = os.getuid() if hasattr(os, "getuid") else "user"
    return usual_temporary_folder() / f"nlsdesign-{owner}"


def _users_caches() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def run_compiler(arguments: Sequence[str | Path], *, about: str) -> None:
    """Run the compiler."""
    cache = str(cache_folder() / "zig")
    environment = os.environ | {"ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache}
    command = [*compiler(), *[str(each) for each in arguments]]
    done = run_to_end(command, environment=environment)
    if done.returncode != 0:
        first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip())
        raise ExportError(about, f"does not compile: {first}", next_step="report this as a bug of nlsdesign")


def flags_of_environment() -> tuple[str, ...]:
    """Return what ``NLSDESIGN_CFLAGS`` adds to the flags of FMUs and of steps of controllers."""
    return tuple(shlex.split(os.environ.get("NLSDESIGN_CFLAGS", "")))


def compile_library(
    sources: Sequence[Path],
    target: Path,
    *,
    platform: Platform | None = None,
    include: Sequence[Path] = (),
    flags: Sequence[str] = ("-std=c99",),
    processor: Sequence[str] = BASELINE,
) -> Path:
    """Compile C files to a shared library."""
    where = platform or PLATFORMS[host_platform()]
    arguments: list[str | Path] = ["-target", where.target, *processor, "-shared", "-O2", *flags]
    # Same numbers on every machine: no fused multiply-add, IEEE comparisons.
    arguments += ["-ffp-contract=off", "-fno-sanitize=undefined", "-fvisibility=hidden", "-s"]
    if where.extension == ".so":
        arguments += ["-fPIC", "-lm"]
    if where.extension == ".dylib":
        arguments.append(f"-Wl,-install_name,@rpath/{target.name}")
    if where.extension == ".dll":
        # Arguments that omit the start-up code of Windows libraries, see the template for the reason.
        start = target.parent / "windows.c"
        start.write_text(template("windows.c"), encoding="utf-8")
        headers = _compilers_folder() / "lib" / "libc" / "include" / "any-windows-any"
        arguments += ["-nostdlib", "-isystem", headers, start, "-lucrtbase", "-lkernel32"]
    for folder in include:
        arguments += ["-isystem", folder]
    run_compiler([*arguments, *sources, "-o", target], about=f"{sources[0].name} for {where.name}")
    return target
