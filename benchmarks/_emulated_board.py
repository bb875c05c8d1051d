"""A program on an emulated Cortex-M board whose peripherals are cells of memory, stopped at each interrupt.

The emulator's debug server (the remote protocol of GDB) holds the processor where the interrupt of the timer
begins. Its clock stands still meanwhile, so a slow partner is not noticed by the program.
"""

from __future__ import annotations

import socket
import struct
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final

from nlsdesign.export import Processor
from nlsdesign.export.compilation.target_run import EMULATOR

CELLS: Final = 0x20300000
_LAYOUT: Final = struct.Struct("<iIIIIIddfII")
_HANDLER: Final = 15 * 4
"""Where the table of vectors names the interrupt of the timer."""
_SECONDS: Final = 20.0


@dataclass(frozen=True)
class Cells:
    """What stands in the cells of the board; see ``firmware/board.h``."""

    encoder: int
    frame: int
    converter: int
    status: int
    faults: int
    starts: int
    current: float
    torque: float
    share: float
    clock: int
    samples: int


class EmulatedBoard:
    """A running image, 2**shift ns an instruction; the processor stands whenever a method has returned."""

    def __init__(self, image: Path, processor: Processor, shift: int = 5) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="nlsdesign-board-")
        path = Path(self._folder.name) / "gdb"
        self._emulator = subprocess.Popen(
            [
                *(
                    EMULATOR,
                    "-machine",
                    processor.machine,
                    "-icount",
                    f"shift={shift},sleep=off",
                    "-nographic",
                ),
                *("-monitor", "none", "-serial", "none", "-S", "-kernel", str(image)),
                *("-chardev", f"socket,path={path},server=on,wait=off,id=gdb", "-gdb", "chardev:gdb"),
            ],
            stdin=subprocess.DEVNULL,
        )
        self._socket = _connected(path)
        self._waiting = b""
        self._socket.sendall(b"+")
        self._ask("QStartNoAckMode")
        self._socket.sendall(b"+")
        self._ask("qXfer:features:read:target.xml:0,ffb")  # registers can be written from here on
        self._frame = 0
        (handler,) = struct.unpack("<I", bytes.fromhex(self._ask(f"m{_HANDLER:x},4")))
        self._ask(f"Z1,{handler & ~1:x},2")
        self._past = "Pf=" + struct.pack("<I", (handler & ~1) + 2).hex()
        self._run("c")

    def __enter__(self) -> EmulatedBoard:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._socket.close()
        self._emulator.kill()
        self._emulator.wait()
        self._folder.cleanup()

    def sample(self, encoder: int, converter: int, *, fresh: bool = True) -> Cells:
        """Let the program take counts of encoder and converter, and run until its next interrupt begins.

        Without a fresh frame the program sees no reading of the encoder.
        """
        self._frame += fresh
        content = struct.pack("<iII", encoder, self._frame, converter)
        self._send(f"M{CELLS:x},{len(content):x}:{content.hex()}")
        self._go(behind=1)
        return Cells(*_LAYOUT.unpack(bytes.fromhex(self._ask(f"m{CELLS:x},{_LAYOUT.size:x}"))))

    def brown_out(self, instructions: int) -> None:
        """Reset the processor within an interrupt, after so many instructions; it stands at the next one."""
        for _ in range(instructions):
            self._run("s")
        self._ask("qRcmd," + b"system_reset".hex())
        self._run("c")

    def _go(self, *, behind: int = 0) -> None:
        """Leave the instruction at which the interrupt is held; as many orders before wait for an answer."""
        self._send(self._past)
        self._run("c", behind=behind + 1)

    def _run(self, order: str, *, behind: int = 0) -> None:
        """Let the processor go until it stands again."""
        self._send(order)
        for _ in range(behind):
            self._accepted("")
        answer = self._accepted(order)
        if not answer.startswith(("T", "S")):
            raise RuntimeError(f"the emulator answers {answer!r} to {order!r}")

    def _ask(self, order: str) -> str:
        self._send(order)
        return self._accepted(order)

    def _send(self, order: str) -> None:
        content = order.encode()
        self._socket.sendall(b"$%b#%02x" % (content, sum(content) % 256))

    def _accepted(self, order: str) -> str:
        """Return the next answer; what a monitor command prints comes in front of its end."""
        answer = self._packet()
        while order.startswith("qRcmd") and answer.startswith("O") and answer != "OK":
            answer = self._packet()
        if answer.startswith("E") or (not answer and not order.startswith("Q")):
            raise RuntimeError(f"the emulator refuses {order!r}: {answer!r}")
        return answer

    def _packet(self) -> str:
        end = _SECONDS + time.monotonic()
        while True:
            begin = self._waiting.find(b"$")
            finish = self._waiting.find(b"#", begin + 1)
            if begin >= 0 and finish >= 0 and len(self._waiting) >= finish + 3:
                content, self._waiting = self._waiting[begin + 1 : finish], self._waiting[finish + 3 :]
                return content.decode()
            if time.monotonic() > end:
                raise RuntimeError(f"the program does not come to its next sample within {_SECONDS:g} s")
            self._waiting += self._socket.recv(65536)


def _connected(path: Path) -> socket.socket:
    end = time.monotonic() + _SECONDS
    while True:
        link = socket.socket(socket.AF_UNIX)
        link.settimeout(_SECONDS)
        try:
            link.connect(str(path))
        except OSError:  # the emulator makes its socket a moment after it has started
            link.close()
            if time.monotonic() > end:
                raise
            time.sleep(0.02)
        else:
            return link
