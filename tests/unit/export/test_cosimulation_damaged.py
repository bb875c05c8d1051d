"""Damaged and hostile FMUs: an error that names file and rule, no traceback, nothing left behind."""

from __future__ import annotations

import io
import os
import random
import signal
import stat
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from nlsdesign.export import Stepping, cosimulate, export_fmu
from nlsdesign.export.compilation.cross_compiler import compile_library
from nlsdesign.export.cosimulation import fmu_description as fmu_archive
from nlsdesign.export.fmi.fmu import fmi_headers
from nlsdesign.foundation.errors import ConvergenceError, ExportError, NlsError
from tests.child_processes import children
from tests.hand_built import controller
from tests.unit.cli.test_cli import Run, run

__all__ = ["run"]
FORKS = pytest.mark.skipif(not hasattr(os, "fork"), reason="without fork FMUs run in this process")
DESCRIPTION = "modelDescription.xml"


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(controller(), tmp_path_factory.mktemp("sound") / "controller.fmu")


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Every test has a temporary folder of its own, which must be empty in the end, and leaves no process."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    before = children()
    yield folder
    assert list(folder.iterdir()) == []
    assert children() <= before


def step(fmu: Path, patience: float = 20.0) -> None:
    here = os.getcwd()
    try:
        cosimulate(fmus={"c": fmu}, wires={}, inputs={}, stop=0.01, step=Stepping(patience=patience))
    finally:
        assert os.getcwd() == here


def rewritten(sound: Path, target: Path, change: Callable[[str, bytes], bytes]) -> Path:
    """Write a copy in which the content of entries is changed."""
    with zipfile.ZipFile(sound) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, change(name, old.read(name)))
    return target


# --- archives -------------------------------------------------------------------------------------


def flipped(data: bytes, sound: Path) -> bytes:
    """Flip a bit within the compressed library: its check sum is wrong, or it cannot be decompressed."""
    with zipfile.ZipFile(sound) as opened:
        entry = next(each for each in opened.infolist() if each.filename.endswith(".so"))
    at = entry.header_offset + 200 + entry.compress_size // 2
    return data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :]


def cut(data: bytes, sound: Path) -> bytes:
    return data[: len(data) // 2]


def with_entry(name: str, content: bytes = b"x", mode: int = 0o644) -> Callable[[bytes, Path], bytes]:
    def add(data: bytes, sound: Path) -> bytes:
        written = io.BytesIO(data)
        with zipfile.ZipFile(written, "a", zipfile.ZIP_DEFLATED) as opened:
            entry = zipfile.ZipInfo(name)
            entry.external_attr = mode << 16
            opened.writestr(entry, content, zipfile.ZIP_DEFLATED)
        return written.getvalue()

    return add


def without_description(data: bytes, sound: Path) -> bytes:
    written = io.BytesIO()
    with zipfile.ZipFile(sound) as old, zipfile.ZipFile(written, "w") as new:
        for name in old.namelist():
            if name != DESCRIPTION:
                new.writestr(name, old.read(name))
    return written.getvalue()


ARCHIVES: dict[str, tuple[Callable[[bytes, Path], bytes], str]] = {
    "a flipped bit": (flipped, "is not a valid archive, or damaged: "),
    "cut": (cut, "is not a valid archive, or damaged: File is not a zip file"),
    "empty": (lambda data, sound: b"", "is not a valid archive, or damaged"),
    "a path out of the folder": (with_entry("../../outside.txt"), "leads out of the folder"),
    "an absolute path": (with_entry("/outside.txt"), "'/outside.txt': leads out of the folder"),
    "a path of Windows": (with_entry("..\\outside.txt"), "leads out of the folder"),
    "a link": (with_entry("link", b"/etc/passwd", stat.S_IFLNK | 0o777), "'link': is a link"),
    "an entry twice": (with_entry(DESCRIPTION), f"'{DESCRIPTION}': appears twice"),
    "a file that is also a folder": (with_entry(f"{DESCRIPTION}/x"), "cannot be read"),
    "a bomb": (with_entry("zeros", bytes(8 * 2**20)), "would unpack to 8 MiB, at most 4 MiB are taken"),
    "no description": (without_description, f"has no {DESCRIPTION}"),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("case", ARCHIVES)
def test_a_damaged_archive_is_named(
    case: str, sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    change, words = ARCHIVES[case]
    monkeypatch.setattr(fmu_archive, "MOST_BYTES", 4 * 2**20)
    bad = tmp_path / "bad.fmu"
    bad.write_bytes(change(sound.read_bytes(), sound))
    with pytest.raises(ExportError, match=r"^instance 'c' \(.*bad\.fmu\)") as caught:
        step(bad)
    assert words in str(caught.value)
    assert not list(tmp_path.rglob("outside.txt"))


def test_too_many_entries_are_refused(sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fmu_archive, "MOST_ENTRIES", 5)
    with pytest.raises(ExportError, match="entries, at most 5"):
        step(sound)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "missing.fmu", tmp_path):
        with pytest.raises(ExportError, match="cannot be read"):
            step(path)


DESCRIPTIONS = {
    "no XML": (b"<?xml", b"<xml", "is not a valid FMU"),
    "unknown version": (b'fmiVersion="3.0"', b'fmiVersion="9.0"', "is not a valid FMU"),
    "a sample time of zero": (b'start="0.001"', b'start="0"', "a sample time of 0.0 s"),
    "a sample time that is no number": (b'start="0.001"', b'start="NaN"', "a sample time of nan s"),
    "another library": (b'modelIdentifier="torque_controller"', b'modelIdentifier="../x"', "not a valid FMU"),
    "another token": (b'instantiationToken="', b'instantiationToken="0', "token is that of another model"),
}


@pytest.mark.parametrize("case", DESCRIPTIONS)
def test_a_damaged_description_is_named(case: str, sound: Path, tmp_path: Path) -> None:
    old, new, words = DESCRIPTIONS[case]

    def change(name: str, content: bytes) -> bytes:
        assert name != DESCRIPTION or old in content
        return content.replace(old, new) if name == DESCRIPTION else content

    with pytest.raises(ExportError, match="instance 'c'") as caught:
        step(rewritten(sound, tmp_path / "bad.fmu", change))
    assert words in str(caught.value)


def test_the_command_says_it_in_one_line(run: Run, sound: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.fmu").write_bytes(flipped(sound.read_bytes(), sound))
    status, _, err = run("cosimulate", "--fmu", "c=bad.fmu", "--stop", "0.1 s", "--out", "y.csv")
    assert status == 2
    assert err.startswith("error: instance 'c' (bad.fmu)")
    assert "Traceback" not in err
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "y.csv").exists()


# --- libraries ------------------------------------------------------------------------------------

HOSTILE = """
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>
#include "fmi3.c"

static void fault(const char *place)
{
    const char *wanted = getenv("FAULT");
    if (wanted == NULL || strncmp(wanted, place, strlen(place)) != 0) {
        return;
    }
    const char *kind = wanted + strlen(place) + 1;
    if (strcmp(kind, "SIGSEGV") == 0) *(volatile int *)8 = 1;
    if (strcmp(kind, "SIGBUS") == 0) raise(SIGBUS);
    if (strcmp(kind, "SIGILL") == 0) __builtin_trap();
    if (strcmp(kind, "SIGABRT") == 0) { fprintf(stderr, "assertion of the maker\\n"); abort(); }
    if (strcmp(kind, "exit") == 0) exit(3);
    if (strcmp(kind, "hang") == 0) for (;;) sleep(1);
    if (strcmp(kind, "fork") == 0 && fork() == 0) {
        FILE *note = fopen(getenv("NOTE"), "w");
        fprintf(note, "%d", (int)getpid());
        fclose(note);
        for (;;) sleep(1);
    }
}

__attribute__((constructor)) static void loaded(void) { fault("load"); }

__attribute__((visibility("default")))
fmi3Status fmi3DoStep(fmi3Instance me, fmi3Float64 from, fmi3Float64 length, fmi3Boolean keeps,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last_time)
{
    if (from > 0.0045) fault("step");
    return sound_step(me, from, length, keeps, event, terminate, early, last_time);
}

__attribute__((visibility("default")))
fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference between[], size_t count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    fault("instantiate");
    return sound_instantiate(name, token, resources, visible, logging, events, early, between, count,
                             environment, log, update);
}
"""


def with_library(sound: Path, folder: Path, code: str, renamed: dict[str, str]) -> Path:
    """Write a copy of an FMU whose library has other functions; its own ones get the names in ``renamed``."""
    with zipfile.ZipFile(sound) as opened:
        opened.extractall(folder)
    original = folder / "sources" / "fmi3.c"
    text = original.read_text(encoding="utf-8")
    for old, new in renamed.items():
        assert text.count(f" {old}(") == 1
        text = text.replace(f" {old}(", f" {new}(")
    original.write_text(text, encoding="utf-8")
    source = folder / "sources" / "changed.c"
    source.write_text(code, encoding="utf-8")
    library = compile_library([source], folder / "changed.so", include=[fmi_headers()], flags=["-std=gnu99"])

    def change(name: str, content: bytes) -> bytes:
        return library.read_bytes() if name.startswith("binaries/") else content

    return rewritten(sound, folder / "changed.fmu", change)


@pytest.fixture(scope="module")
def hostile(sound: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sound FMU with a library that does what the environment variable FAULT says."""
    renamed = {"fmi3DoStep": "sound_step", "fmi3InstantiateCoSimulation": "sound_instantiate"}
    return with_library(sound, tmp_path_factory.mktemp("hostile"), HOSTILE, renamed)


@FORKS
@pytest.mark.long_cases(
    "instantiate SIGABRT-its library crashed (SIGABRT) while it was instantiated",
    "step SIGBUS-its library crashed (SIGBUS) during a step from 0.005 s",
    "step SIGILL-its library crashed (SIG",
)
@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("load SIGSEGV", "its library crashed (SIGSEGV) while its library was loaded"),
        ("instantiate SIGABRT", "its library crashed (SIGABRT) while it was instantiated"),
        ("instantiate exit", "its library ended the process (exit status 3) while it was instantiated"),
        ("step SIGSEGV", "its library crashed (SIGSEGV) during a step from 0.005 s"),
        ("step SIGBUS", "its library crashed (SIGBUS) during a step from 0.005 s"),
        ("step SIGILL", "its library crashed (SIG"),
        ("step SIGABRT", "during a step from 0.005 s; it printed: assertion of the maker"),
        ("step exit", "its library ended the process (exit status 3) during a step from 0.005 s"),
        ("step hang", "did not return within 0.3 s during a step from 0.005 s"),
    ],
)
def test_a_library_that_crashes_or_hangs_is_named(
    fault: str, words: str, hostile: Path, sound: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step(hostile)
    monkeypatch.setenv("FAULT", fault)
    fmus = {"good": sound, "bad": hostile}
    patience = Stepping(patience=0.3 if "hang" in fault else 20.0)
    with pytest.raises(ExportError, match="instance 'bad'") as caught:
        cosimulate(fmus=fmus, wires={}, inputs={}, stop=0.01, step=patience)
    assert words in str(caught.value)


@FORKS
def test_a_process_that_a_library_started_is_ended(
    hostile: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FAULT", "load fork")
    monkeypatch.setenv("NOTE", str(tmp_path / "note"))
    step(hostile)
    note = tmp_path / "note"
    deadline = time.monotonic() + 5.0
    while note.exists() and note.read_text() and _runs(int(note.read_text())):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def _runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().split()[2] not in ("Z", "X")
    except OSError:
        return False


INTERRUPTED = """
import signal, sys, tempfile
tempfile.tempdir = sys.argv[2]
from nlsdesign.export import cosimulate
signal.signal(signal.SIGINT, signal.default_int_handler)
print("begins", flush=True)
try:
    cosimulate(fmus={"c": sys.argv[1]}, wires={}, inputs={}, stop=0.01)
except KeyboardInterrupt:
    sys.exit(130)
"""


@FORKS
def test_an_interrupt_leaves_nothing_behind(hostile: Path, place: Path, root: Path) -> None:
    environment = os.environ | {"FAULT": "step hang", "PYTHONPATH": str(root)}
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, str(hostile), str(place)], stdout=subprocess.PIPE, env=environment
    )
    assert process.stdout is not None
    process.stdout.readline()
    deadline = time.monotonic() + 30.0
    while not list(place.rglob("output.txt")):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    worker = int(Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()[0])
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 130
    process.stdout.close()
    assert not _runs(worker)
    assert list(place.iterdir()) == []


CARELESS = """
#include "fmi3.c"
__attribute__((visibility("default")))
fmi3Status fmi3GetFloat64(fmi3Instance me, const fmi3ValueReference references[], size_t count,
                          fmi3Float64 values[], size_t value_count)
{
    const fmi3Status status = sound_get(me, references, count, values, value_count);
    for (size_t i = 0; i < count && ((instance *)me)->now.time > 0.0035; ++i) values[i] = NAN;
    return status;
}
"""


def test_an_output_that_is_no_number_is_no_result(tmp_path: Path, sound: Path) -> None:
    """A foreign library need not check what it gives."""
    careless = with_library(sound, tmp_path / "open", CARELESS, {"fmi3GetFloat64": "sound_get"})
    with pytest.raises(ConvergenceError, match=r"instance 'c' at 0\.003 s: its output motor\.current is no"):
        step(careless)


# --- at random ------------------------------------------------------------------------------------


def spoilt_archive(generator: random.Random, sound: Path, target: Path) -> None:
    data = bytearray(sound.read_bytes())
    kind = generator.randrange(4)
    if kind == 0:
        for _ in range(generator.randrange(1, 4)):
            data[generator.randrange(len(data))] ^= 1 << generator.randrange(8)
    elif kind == 1:
        del data[generator.randrange(len(data)) :]
    elif kind == 2:
        first, count = generator.randrange(len(data)), generator.randrange(1, 64)
        data[first : first + count] = generator.randbytes(count)
    else:  # in the directory at the end
        data[len(data) - generator.randrange(1, 1500)] = generator.randrange(256)
    target.write_bytes(bytes(data))


def spoilt_entry(generator: random.Random, sound: Path, target: Path, ending: str) -> None:
    def change(name: str, content: bytes) -> bytes:
        if not name.endswith(ending):
            return content
        data = bytearray(content)
        kind = generator.randrange(4)
        if kind == 0:
            for _ in range(generator.randrange(1, 200)):
                data[generator.randrange(len(data))] ^= 1 << generator.randrange(8)
        elif kind == 1:
            del data[generator.randrange(len(data)) :]
        elif kind == 2:
            first, count = generator.randrange(len(data)), generator.randrange(1, 4000)
            data[first : first + count] = generator.randbytes(count)
        else:
            for _ in range(generator.randrange(1, 10)):
                data[generator.randrange(min(6000, len(data)))] = generator.randrange(256)
        return bytes(data)

    rewritten(sound, target, change)


def spoilt(kind: str, generator: random.Random, sound: Path, target: Path) -> None:
    if kind == "archive":
        spoilt_archive(generator, sound, target)
    else:
        spoilt_entry(generator, sound, target, ".so" if kind == "library" else DESCRIPTION)


def refusal(bad: Path) -> str | None:
    try:
        step(bad, patience=3.0)
    except NlsError as error:
        return str(error)
    return None


@FORKS
@pytest.mark.parametrize(
    ("kind", "count"),
    [
        ("archive", 40),
        ("description", 15),
        ("library", 8),
        pytest.param("library", 20, marks=pytest.mark.slow),
        pytest.param("archive", 350, marks=pytest.mark.slow),
        pytest.param("description", 150, marks=pytest.mark.slow),
        pytest.param("library", 150, marks=pytest.mark.slow),
    ],
)
def test_mutants_run_or_are_named(kind: str, count: int, sound: Path, place: Path, tmp_path: Path) -> None:
    generator = random.Random(count)
    refused = 0
    for number in range(count):
        bad = tmp_path / "bad.fmu"
        spoilt(kind, generator, sound, bad)
        begin = time.monotonic()
        words = refusal(bad)
        refused += words is not None
        assert words is None or words.isprintable(), number
        assert words is None or words.startswith(("instance 'c'", "stop=")), number
        assert time.monotonic() - begin < 30.0, number
        assert list(place.iterdir()) == [], number
    assert refused > count / 3
