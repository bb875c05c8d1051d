"""The server of the live page: what it answers, at one port of this machine, until it is interrupted."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import itertools
import json
import socket
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

from ..foundation.errors import NlsError, missing_library
from .access import PROTOCOL, Access, Application, gate, loopback
from .session_process import SessionProcess, content_of
from .sessions import DECK_BYTES, MOST, Session, Sessions, TooLargeError, too_large

# Starlette is optional, so its classes are named where they are used only.
Request = Any
Response = Any
WebSocket = Any

LONGEST_MESSAGE = 1 << 16
"""Most bytes of one message of a page."""
_READ_AWAY = 1 << 30
"""Most bytes that are read only to be dropped."""

_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}


def page_files() -> dict[str, tuple[bytes, str]]:
    """Return content and kind of each file of the page by its address; no other file is ever sent."""
    folder = Path(__file__).parent / "page"
    files = {
        f"/page/{file.name}": (file.read_bytes(), _KINDS[file.suffix])
        for file in sorted(folder.iterdir())
        if file.suffix in _KINDS
    }
    return {"/": files["/page/index.html"], **files}


def application(sessions: Sessions, access: Access) -> Application:
    """Return the application, behind its gate."""
    from starlette.applications import Starlette
    from starlette.responses import Response
    from starlette.routing import Route, WebSocketRoute

    files = page_files()
    answers = _Answers(sessions)

    async def file(request: Request) -> Response:
        content, kind = files[request.url.path]
        return Response(content, media_type=kind)

    routes = [Route(path, file, methods=["GET"]) for path in files]
    app = Starlette(
        routes=[
            *routes,
            WebSocketRoute("/api/design", answers.socket),
            Route("/api/records", answers.records, methods=["POST"]),
            Route("/api/open", answers.open, methods=["POST"]),
            Route("/api/file/{kind:str}", answers.file, methods=["POST"]),
        ]
    )
    return gate(app, access)


class _Answers:
    """Answers of one server."""

    def __init__(self, sessions: Sessions) -> None:
        self._sessions = sessions
        self._sockets = itertools.count(1)

    async def socket(self, socket: WebSocket) -> None:
        """Show a design in a tab for as long as it is open; the tab that came last shows it."""
        from starlette.websockets import WebSocketDisconnect

        await socket.accept(subprotocol=PROTOCOL)
        kept = socket.query_params.get("session", "")
        session = self._sessions.get(kept) or await self._sessions.new()
        if session is None:
            words = (
                f"{MOST} designs are open, which is the most: close one of their tabs, then load this again."
            )
            await socket.send_json({"what": "refused", "reason": words})
            await socket.close(4429)
            return
        number = session.shown = next(self._sockets)

        async def listener(text: str) -> None:
            await socket.send_text(text)

        if session.name == kept:
            await session.process.tell('{"what": "elsewhere"}')  # a tab that was copied
        session.process.listen(listener)
        try:
            # Before the design is computed, so that a tab that is loaded again at once comes back to it.
            await socket.send_json({"what": "session", "session": session.name, "back": session.name == kept})
            await session.process.from_page({"what": "show"})
            while True:
                await self._receive(socket, session)
        except (WebSocketDisconnect, RuntimeError, NlsError):
            pass
        finally:
            if session.shown == number:
                session.shown = 0
                session.process.listen(None)
                self._sessions.get(session.name)  # its time begins now
                if not session.process.alive:
                    self._sessions.end(session)
            with contextlib.suppress(Exception):
                await socket.close()

    async def _receive(self, socket: WebSocket, session: Session) -> None:
        text = await socket.receive_text()
        try:
            message = json.loads(text)
            if not isinstance(message, dict):
                raise ValueError("no table")
        except (ValueError, RecursionError):
            await socket.send_json({"what": "refused", "reason": "That was no message of this page."})
            return
        self._sessions.get(session.name)
        await session.process.from_page(message)

    async def records(self, request: Request) -> Response:
        """Keep one file of records."""
        return await self._answer(request, self._keep)

    async def open(self, request: Request) -> Response:
        """Hand a deck, a design that was saved, a task or a list of coils to the session."""
        return await self._answer(request, self._open)

    async def file(self, request: Request) -> Response:
        """Send a file that the session makes; its name is the session's choice."""
        return await self._answer(request, self._file)

    async def _answer(self, request: Request, work: Any) -> Response:
        from starlette.responses import PlainTextResponse

        session = self._sessions.get(request.headers.get("x-session", ""))
        if session is None:
            return PlainTextResponse("This session has ended: load the page again.", 410)
        try:
            answer: Response = await work(request, session)
        except TooLargeError as error:
            await _read_away(request)
            return PlainTextResponse(str(error), 413, {"connection": "close"})
        except NlsError as error:
            return PlainTextResponse(str(error), 422)
        return answer

    async def _keep(self, request: Request, session: Session) -> Response:
        from starlette.responses import JSONResponse

        uploads = session.uploads
        if request.query_params.get("first") == "1":
            uploads.clear()
        name = await uploads.keep(request.query_params.get("name", ""), request.stream(), _length(request))
        return JSONResponse({"name": name})

    async def _open(self, request: Request, session: Session) -> Response:
        from starlette.responses import JSONResponse

        announced, content = _length(request), bytearray()
        if announced is not None and announced > DECK_BYTES:
            raise too_large("deck", DECK_BYTES)
        async for part in request.stream():
            content += part
            if len(content) > DECK_BYTES:
                raise too_large("deck", DECK_BYTES)
        sent = base64.b64encode(content).decode()
        asked = {key: request.query_params.get(key, "") for key in ("kind", "name")}
        answer = await session.process.ask({"what": "open", "content": sent, **asked})
        if "refused" in answer:
            raise NlsError("not opened", str(answer["refused"]))
        return JSONResponse({"opened": True})

    async def _file(self, request: Request, session: Session) -> Response:
        from starlette.responses import Response

        name, content = content_of(
            await session.process.ask({"what": "file", "kind": request.path_params["kind"]})
        )
        headers = {"content-disposition": f'attachment; filename="{name}"'}
        return Response(content, media_type="application/octet-stream", headers=headers)


async def _read_away(request: Request) -> None:
    """Read the rest of what is not taken: a browser that is cut off in its sentence hears no answer."""
    from starlette.requests import ClientDisconnect

    size = 0
    with contextlib.suppress(ClientDisconnect):
        async for part in request.stream():
            size += len(part)
            if size > _READ_AWAY:
                return


def _length(request: Request) -> int | None:
    given = request.headers.get("content-length", "")
    return int(given) if given.isdigit() else None


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
            settings = uvicorn.Config(
                application(sessions, access), loop="asyncio", http="h11", ws="websockets-sansio",
                lifespan="off", log_level="critical", access_log=False, server_header=False,
                date_header=False, proxy_headers=False, ws_max_size=LONGEST_MESSAGE,
                ws_per_message_deflate=False, h11_max_incomplete_event_size=1 << 15,
                timeout_graceful_shutdown=0, limit_concurrency=200,
            )  # fmt: skip
            await Server(settings).serve(sockets=[listener])
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
