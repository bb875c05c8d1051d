"""What a session says, as lines of JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import IO, Any


class Outbox:
    """Lines to the server: ``P`` for the page, ``S`` for the server itself."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream

    def page(self, message: Mapping[str, Any]) -> None:
        """Say something to the page.

        ``message``: plain data; numbers are finite or ``None``.
        """
        self._write(b"P", message)

    def server(self, message: Mapping[str, Any]) -> None:
        """Answer a question of the server."""
        self._write(b"S", message)

    def _write(self, kind: bytes, message: Mapping[str, Any]) -> None:
        line = json.dumps(message, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
        self._stream.write(kind + line.encode() + b"\n")
        self._stream.flush()
