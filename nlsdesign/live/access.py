"""Who may talk to the live page: this machine, by the address that was printed, from the page itself.

Any page in a browser can send requests to a port of the machine that it runs on. Four checks keep such a page
out: the ``Host`` must be the loopback address (a name that was rebound to it is refused), the ``Origin`` of
everything that changes or opens something must be this page, a random token must be shown that only the
printed address holds, and what the page may load is said by its content security policy.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass, field
from typing import Any

from ..foundation.errors import ValueRangeError

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Addresses at which the page may be served."""
PROTOCOL = "nlsdesign"
"""Name of the protocol on the socket; the token follows it as the second one that is offered."""

_HEADERS = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


def loopback(host: str) -> str:
    """Return the address of this machine that a host stands for."""
    if host not in LOOPBACK:
        raise ValueRangeError(
            f"host '{host}'",
            "the live page is served to this machine only: whoever reaches it can read decks and start work",
            next_step="leave --host out; from another machine take a tunnel: ssh -L 8000:127.0.0.1:8000 NAME",
        )
    return "127.0.0.1" if host == "localhost" else host


@dataclass(frozen=True)
class Refusal:
    """Why a request is not answered."""

    status: int
    words: str  # one sentence for whoever reads it


@dataclass(frozen=True)
class Access:
    """What a request must show."""

    # host, port: where the server listens; the host is a loopback address
    host: str
    port: int
    # token: random; part of the printed address only
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24), repr=False)

    @property
    def origins(self) -> tuple[str, ...]:
        """Return the origins of the page itself, the first as it is printed."""
        names = ("[::1]", "localhost") if self.host == "::1" else (self.host, "localhost")
        return tuple(f"http://{name}:{self.port}" for name in names)

    @property
    def address(self) -> str:
        """Return the address of the page with its token, in the part that a browser keeps for itself."""
        return f"{self.origins[0]}/#token={self.token}"

    def refusal(self, scope: Scope) -> Refusal | None:
        """Return why a request is refused; ``None`` where it is not."""
        headers: dict[str, str] = {}  # one that comes twice is of no value
        for name, value in scope["headers"]:
            key = name.decode("latin-1").lower()
            headers[key] = "" if key in headers else value.decode("latin-1")
        if f"http://{headers.get('host', '').lower()}" not in self.origins:
            return Refusal(421, "The live page answers at its loopback address only.")
        socket = scope["type"] == "websocket"
        method = "GET" if socket else scope["method"]
        if method not in ("GET", "HEAD", "POST"):
            return Refusal(405, "The live page knows GET and POST only.")
        if (socket or method == "POST") and headers.get("origin") not in self.origins:
            return Refusal(403, "Another page may not drive the live page.")
        # Somebody may follow a link to the page, which gives the place of the link nothing.
        opened = headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin") and not opened:
            return Refusal(403, "Another page may not load parts of the live page.")
        if (socket or scope["path"].startswith("/api/")) and not self._shown(headers, socket=socket):
            return Refusal(
                401, "Open the address that nlsdesign serve has printed; its token is missing here."
            )
        return None

    def _shown(self, headers: dict[str, str], *, socket: bool) -> bool:
        if socket:
            offered = [each.strip() for each in headers.get("sec-websocket-protocol", "").split(",")]
            given = offered[1] if len(offered) == 2 and offered[0] == PROTOCOL else ""
        else:
            given = headers.get("authorization", "").removeprefix("Bearer ")
        return hmac.compare_digest(given.encode(), self.token.encode())


def gate(application: Application, access: Access) -> Application:
    """Return an application that refuses what access does not allow, and adds headers to each answer."""

    async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await application(scope, receive, send)
            return
        refused = access.refusal(scope)

        async def send_with_headers(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                added = [(name.encode(), value.encode()) for name, value in _HEADERS.items()]
                message = {**message, "headers": [*message.get("headers", []), *added]}
            await send(message)

        if refused is None:
            await application(scope, receive, send_with_headers)
        elif scope["type"] == "websocket":
            await _refuse(refused, send, "websocket.http.response")
        else:
            await _refuse(refused, send_with_headers, "http.response")

    return guarded


async def _refuse(refused: Refusal, send: Send, kind: str) -> None:
    body = refused.words.encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": f"{kind}.start", "status": refused.status, "headers": headers})
    await send({"type": f"{kind}.body", "body": body})
