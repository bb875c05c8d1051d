"""A desk plays records through the program of a board, by UDP and a serial line, and compares each bit."""

from __future__ import annotations

import csv
import os
import select
import socket
import struct
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.export import CSource, export_c, write_examples
from nlsdesign.export.c.c_text import Real
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.export.c.programs import sample_inputs
from nlsdesign.export.compilation.cross_compiler import STRICT
from tests.compiling import compile_program
from tests.hand_built import observer

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the program of the board is for POSIX")


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> CSource:
    made = export_c(observer(), tmp_path_factory.mktemp("c"), name="loop", real="float")
    write_examples(made)
    return made


def built(source: CSource, target: Path) -> Path:
    """The program of the board as it was generated, under all warnings."""
    folder = source.header.parent
    flags = [*STRICT, f"-I{folder}"]
    return compile_program([source.source, folder / "loop_example_link.c"], target, flags=flags)


@pytest.fixture(scope="module")
def board(source: CSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(source, tmp_path_factory.mktemp("board") / "board")


@pytest.fixture
def record(source: CSource, tmp_path: Path) -> Path:
    """The vectors of the self-test as a record, with a time that nobody asks for."""
    file = tmp_path / "record.csv"
    rows = sample_inputs(source.model, Real.FLOAT)
    with file.open("w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(["time", *(v.name for v in source.model.inputs)])
        table.writerows([k, *("" if np.isnan(x) else x for x in row)] for k, row in enumerate(rows))
    return file


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def running(program: Path, *words: str) -> Iterator[None]:
    process = subprocess.Popen([program, *words], stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.kill()
        process.wait()


def play(source: CSource, *words: str | Path) -> subprocess.CompletedProcess[str]:
    script = source.header.parent / "loop_play.py"
    return subprocess.run([sys.executable, script, *map(str, words)], capture_output=True, text=True,
                          timeout=60, check=False)  # fmt: skip


def ask(port: int, *contents: bytes) -> list[bytes]:
    """Send datagrams and return the answers."""
    answers = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.connect(("127.0.0.1", port))
        for content in contents:
            wire.send(content)
            answers.append(wire.recv(4096) if select.select([wire], [], [], 0.2)[0] else b"")
    return answers


def request(sequence: int, *values: float) -> bytes:
    body = b"NLSI" + struct.pack(f"<I{len(values)}f", sequence, *values)
    return body + struct.pack("<I", zlib.crc32(body))


def test_a_record_over_udp_comes_back_with_all_bits(source: CSource, board: Path, record: Path) -> None:
    port = free_port()
    with running(board, str(port)):
        done = play(source, record, "--udp", f"127.0.0.1:{port}")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "120 samples, all bits the same\n"


def test_a_record_over_a_serial_line_comes_back_with_all_bits(
    source: CSource, board: Path, record: Path
) -> None:
    """Two pseudo-terminals and a wire between them that carries seven bytes at a time."""
    (desk, desk_line), (far, far_line) = os.openpty(), os.openpty()
    ended = threading.Event()

    def wire() -> None:
        while not ended.is_set():
            for ready in select.select([desk, far], [], [], 0.05)[0]:
                os.write(far if ready == desk else desk, os.read(ready, 7))

    with running(board, os.ttyname(far_line)):
        time.sleep(0.3)  # the board makes its line raw
        carrier = threading.Thread(target=wire)
        carrier.start()
        done = play(source, record, "--serial", os.ttyname(desk_line))
        ended.set()
        carrier.join()
    for end in (desk, desk_line, far, far_line):
        os.close(end)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "120 samples, all bits the same\n"


def test_a_board_that_computes_something_else_is_named(
    source: CSource, board: Path, record: Path, tmp_path: Path
) -> None:
    text = source.source.read_text()
    changed = text.replace("    outputs->", "    outputs->", 1)
    at = changed.index("    const float y0 = ")
    end = changed.index(";", at)
    changed = f"{changed[:end]} * 1.0001f{changed[end:]}"
    source.source.write_text(changed)
    try:
        other = built(source, tmp_path / "other")
    finally:
        source.source.write_text(text)
    port = free_port()
    with running(other, str(port)):
        done = play(source, record, "--udp", f"127.0.0.1:{port}")
    assert done.returncode == 1
    assert "samples differ" in done.stdout
    assert source.model.outputs[0].name in done.stdout


def test_frames_are_answered_once_and_hold_the_step(source: CSource, board: Path) -> None:
    """A frame that comes again is answered again without a step; damaged ones and gaps are not answered."""
    port, rows = free_port(), [[0.2, 0.0], [0.21, 0.5], [0.22, 0.5]]
    one, two, three = (request(k, *row) for k, row in enumerate(rows))
    twin = GuardedModel(source.model, Real.FLOAT)
    expected = [twin.step(row) for row in rows]
    with running(board, str(port)):
        time.sleep(0.1)
        damaged = two[:-1] + bytes([two[-1] ^ 1])
        answers = ask(port, one, b"xyNLS" + two, two, damaged, request(7, 0.3, 0.0), three)
    assert answers[1] == answers[2]
    assert answers[3] == answers[4] == b""
    for answer, (outputs, status), k in zip((*answers[:2], answers[5]), expected, range(3), strict=True):
        assert answer[:4] == b"NLSO"
        sequence, word, *values, checked = struct.unpack(f"<II{len(outputs)}fI", answer[4:])
        assert (sequence, word, checked) == (k, status, zlib.crc32(answer[:-4]))
        assert values == pytest.approx(outputs, rel=1e-4, abs=1e-6)


def test_a_log_of_frames_is_read_as_a_table(source: CSource, board: Path, tmp_path: Path) -> None:
    port, log = free_port(), tmp_path / "robot.log"
    with running(board, str(port)):
        time.sleep(0.1)
        answers = ask(port, request(0, 0.2, 0.0), request(1, float("nan"), 0.0))
    log.write_bytes(b"noise" + answers[0] + answers[1][:9] + answers[1])
    read = play(source, "--log", log)
    assert f"{len(b'noise' + answers[1][:9])} bytes are in no whole frame" in read.stderr
    rows = list(csv.reader(read.stdout.splitlines()))
    assert rows[0] == ["sequence", "status", "flags", *(v.name for v in source.model.outputs)]
    assert [row[0] for row in rows[1:]] == ["0", "1"]
    assert rows[1][2] == "clean"
    assert "INPUT_HELD" in rows[2][2]


def test_what_cannot_be_played_is_one_sentence(source: CSource, record: Path, tmp_path: Path) -> None:
    first = source.model.inputs[0].name
    misspelt, broken = tmp_path / "misspelt.csv", tmp_path / "broken.csv"
    misspelt.write_text(record.read_text().replace(first, first[:-1], 1))
    lines = record.read_text().splitlines()
    broken.write_text("\n".join([*lines[:3], lines[3].replace(",", ",x", 1)]))
    wire = ("--udp", f"127.0.0.1:{free_port()}")
    for words, message in (
        ((misspelt, *wire), f"did you mean '{first[:-1]}'"),
        ((broken, *wire), "line 4: a cell is missing or no number"),
        ((tmp_path / "none.csv", *wire), "cannot be read"),
        ((record,), "give a record and one wire"),
        ((record, "--udp", "nowhere"), "is no ADDRESS:PORT"),
        ((record, "--serial", str(tmp_path / "tty")), "cannot be opened"),
        ((record, *wire), "the board does not answer to sample 0"),
        (("--log", broken), "holds no whole frame of this code"),
    ):
        done = play(source, *words)
        assert done.returncode == 2, words
        assert message in done.stderr
        assert len(done.stderr.splitlines()) == 1
