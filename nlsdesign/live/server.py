"""The server of the live page: one port of this machine, until it is interrupted."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Callable
from typing import Any

from ..foundation.errors import NlsError, missing_library
from .access import Access, loopback
from .application import LONGEST_MESSAGE, application
from .session_process import SessionProcess
from .sessions import Sessions

_PAUSE = 20.0
"""Seconds between two looks for sessions whose time is over."""
_PAGE_FIRST = 0.5
"""Seconds before the first session is prepared: its process would be in the way of the first paint."""


def serve(
    deck: str = "",
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    packages: tuple[str, ...] = (),
    ready: Callable[[str], None] = print,
) -> None:
    """Serve the live page to this machine until the program is interrupted.

    ``deck``: that each tab begins with; empty for the first of the gallery.
    """
    _require_libraries()
    import uvicorn

    host = loopback(host)
    listener = _listener(host, port)
    access = Access(host, listener.getsockname()[1])
    sessions = Sessions(lambda: SessionProcess(deck, packages))

    class Server(uvicorn.Server):
        """Says when it answers."""

        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready(access.address)

    async def run() -> None:
        async with _kept_in_bounds(sessions):
            await Server(_settings(application(sessions, access))).serve(sockets=[listener])
        # An interrupt that came when there was nothing to wait for cancels this task at its next pause.
        await asyncio.sleep(0)

    with contextlib.closing(listener):
        asyncio.run(run())


@contextlib.asynccontextmanager
async def _kept_in_bounds(sessions: Sessions) -> AsyncIterator[None]:
    async def look() -> None:
        await asyncio.sleep(_PAGE_FIRST)
        await sessions.prepare()
        while True:
            await asyncio.sleep(_PAUSE)
            sessions.end_the_idle()
            if sessions.quiet:
                await sessions.prepare()

    looking = asyncio.create_task(look())
    try:
        yield
    finally:
        looking.cancel()
        await asyncio.gather(*(process.gone() for process in sessions.end_all()))


def _require_libraries() -> None:
    """Refuse in words where a library of the server is not installed."""
    try:
        import starlette
        import uvicorn
        import websockets
    except ImportError as error:
        raise missing_library("the live page", error.name or "starlette", "live") from None
    del starlette, uvicorn, websockets


def _settings(app: Any) -> Any:
    import uvicorn

    return uvicorn.Config(
        app, loop="asyncio", http="h11", ws="websockets-sansio", lifespan="off", log_level="critical",
        access_log=False, server_header=False, date_header=False, proxy_headers=False,
        ws_max_size=LONGEST_MESSAGE, ws_per_message_deflate=False, h11_max_incomplete_event_size=1 << 15,
        timeout_graceful_shutdown=0, limit_concurrency=200,
    )  # fmt: skip


def _listener(host: str, port: int) -> socket.socket:
    """Return a socket that listens at a port."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # elsewhere two programs may share a port on Windows
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(64)
    except OSError as error:
        listener.close()
        words = (error.strerror or str(error)).lower()
        raise NlsError(
            f"port {port} of {host}", f"cannot be had: {words}",
            next_step="end what listens there, or leave --port out: a free one is taken then",
        ) from error  # fmt: skip
    return listener
