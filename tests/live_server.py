"""A server of the live page as somebody starts it: a process of its own that has ended on leaving."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

ROOT = Path(__file__).resolve().parents[1]


@dataclass
class Server:
    """A running server.

    Parameters
    ----------
    process
        Of the command.
    address
        With the token, as it was printed.
    """

    process: subprocess.Popen[str]
    address: str

    @property
    def origin(self) -> str:
        return self.address.partition("/#")[0]

    @property
    def token(self) -> str:
        return self.address.partition("#token=")[2]

    @property
    def port(self) -> int:
        return int(urlsplit(self.origin).port or 0)

    def ask(
        self, method: str, path: str, headers: Mapping[str, str] | None = None, body: bytes | None = None
    ) -> tuple[int, dict[str, str], str]:
        """Send a request with exactly these headers; returns status, headers and body."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        try:
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            sent = {"Host": f"127.0.0.1:{self.port}", **(headers or {})}
            if body is not None:
                sent.setdefault("Content-Length", str(len(body)))
            for name, value in sent.items():
                connection.putheader(name, value)
            connection.endheaders(body)
            answer = connection.getresponse()
            text = answer.read().decode("utf-8", errors="replace")
            return answer.status, {k.lower(): v for k, v in answer.getheaders()}, text
        finally:
            connection.close()

    def end(self, number: int = signal.SIGINT) -> int:
        """Interrupt the server and return its exit status."""
        self.process.send_signal(number)
        return self.process.wait(20)


def start(*words: str, before: tuple[str, ...] = (), folder: Path | None = None) -> subprocess.Popen[str]:
    """Start the command, with words before its name, in a folder."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "nlsdesign", *before, "serve", "--no-browser", "--json", *words],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        # Who runs tests in the background has interrupts ignored, which processes inherit.
        preexec_fn=None if sys.platform == "win32" else _as_in_a_terminal,
    )  # fmt: skip


def _as_in_a_terminal() -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def running(*words: str, before: tuple[str, ...] = (), folder: Path | None = None) -> Iterator[Server]:
    """Start a server and wait until it answers."""
    process = start(*words, before=before, folder=folder)
    try:
        assert process.stdout is not None
        shown = ""
        while "}" not in shown:
            line = process.stdout.readline()
            assert line, f"the server has ended: {process.stderr.read() if process.stderr else ''}"
            shown += line
        yield Server(process, json.loads(shown)["address"])
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(10)
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


def processes_of(number: int) -> set[int]:
    """Return the processes that descend from one, where the system lists them."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except OSError:
                continue
    below, grown = {number}, True
    while grown:
        more = {child for child, parent in parents.items() if parent in below} - below
        below, grown = below | more, bool(more)
    return below - {number}
