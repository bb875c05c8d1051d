"""The server of the live page: who is answered, how much is taken, and how it begins and ends."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from nlsdesign.foundation.errors import NlsError, ValueRangeError
from nlsdesign.live.access import Access, loopback
from nlsdesign.live.messages import MOST, Inbox
from nlsdesign.live.sessions import FILES, TooLargeError, Uploads, plain_name
from tests.command_line import Run, run
from tests.live_server import Server, processes_of, running, start

__all__ = ["run"]
pytest.importorskip("uvicorn")
pytest.importorskip("starlette")
pytest.importorskip("websockets")


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with running() as one:
        yield one


def upgrade(server: Server, **changed: str) -> tuple[int, str]:
    headers = {
        "Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==", "Origin": server.origin,
        "Sec-WebSocket-Protocol": f"nlsdesign, {server.token}",
    }  # fmt: skip
    headers |= {name.replace("_", "-"): value for name, value in changed.items()}
    status, _, text = server.ask("GET", "/api/design", {k: v for k, v in headers.items() if v})
    return status, text


# --- who is answered ------------------------------------------------------------------------------


def test_the_page_is_sent_with_a_policy_that_lets_it_load_nothing_from_elsewhere(server: Server) -> None:
    status, headers, text = server.ask("GET", "/")
    assert status == 200
    assert '<script type="module" src="/page/main.js"' in text
    policy = headers["content-security-policy"]
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert not [name for name in headers if name.startswith("access-control")]
    for part in ("/page/main.js", "/page/style.css"):
        assert server.ask("GET", part)[0] == 200


@pytest.mark.parametrize(
    "path", ["/page/../access.py", "/page/%2e%2e/access.py", "/page//etc/passwd", "/api/"]
)
def test_no_file_is_sent_but_those_of_the_page(server: Server, path: str) -> None:
    assert server.ask("GET", path, {"Authorization": f"Bearer {server.token}"})[0] == 404


@pytest.mark.parametrize("host", ["evil.example", "evil.example:{port}", "127.0.0.1", "[::1]:{port}", ""])
def test_a_name_that_was_rebound_to_this_machine_is_refused(server: Server, host: str) -> None:
    status, _, text = server.ask("GET", "/", {"Host": host.format(port=server.port)})
    assert status in (400, 421)
    assert status == 400 or "loopback" in text


def test_localhost_is_this_machine(server: Server) -> None:
    assert server.ask("GET", "/", {"Host": f"localhost:{server.port}"})[0] == 200


def test_only_the_page_itself_with_its_token_opens_the_socket(server: Server) -> None:
    assert upgrade(server, Origin="http://evil.example")[0] == 403
    assert upgrade(server, Origin="")[0] == 403
    assert upgrade(server, Origin="null")[0] == 403
    assert upgrade(server, Origin=f"http://127.0.0.1:{server.port + 1}")[0] == 403
    status, text = upgrade(server, Sec_WebSocket_Protocol="nlsdesign")
    assert (status, "nlsdesign serve" in text) == (401, True)
    another = server.token[:-1] + ("y" if server.token.endswith("x") else "x")
    assert upgrade(server, Sec_WebSocket_Protocol=f"nlsdesign, {another}")[0] == 401
    assert upgrade(server, Host="evil.example")[0] == 421


@pytest.mark.parametrize("path", ["/api/records?name=a.csv", "/api/open", "/api/file/deck"])
def test_nothing_is_done_for_another_page_or_without_the_token(server: Server, path: str) -> None:
    shown = {"Authorization": f"Bearer {server.token}"}
    assert server.ask("POST", path, {**shown, "Origin": "http://evil.example"}, b"x")[0] == 403
    assert server.ask("POST", path, shown, b"x")[0] == 403
    assert server.ask("POST", path, {"Origin": server.origin}, b"x")[0] == 401
    assert server.ask("POST", path, {**shown, "Origin": server.origin}, b"x")[0] == 410, "no such session"


def test_other_methods_and_loads_by_another_page_are_refused(server: Server) -> None:
    for method in ("PUT", "DELETE", "OPTIONS", "TRACE"):
        assert server.ask(method, "/", {"Origin": server.origin})[0] == 405
    for site in ("cross-site", "same-site"):
        headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "script"}
        assert server.ask("GET", "/page/main.js", headers)[0] == 403


def test_a_header_that_comes_twice_counts_for_nothing() -> None:
    access = Access("127.0.0.1", 80)
    good = (b"host", b"127.0.0.1:80")
    scope = {"type": "http", "method": "GET", "path": "/", "headers": [good]}
    assert access.refusal(scope) is None
    refused = access.refusal({**scope, "headers": [good, (b"host", b"evil.example")]})
    assert refused is not None
    assert refused.status == 421
    assert access.token not in repr(access)


def test_tokens_differ_and_are_long() -> None:
    tokens = {Access("127.0.0.1", 80).token for _ in range(50)}
    assert len(tokens) == 50
    assert all(len(each) >= 32 for each in tokens)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.2", "example.org", "::"])
def test_only_this_machine_is_served(host: str, run: Run) -> None:
    with pytest.raises(ValueRangeError, match="this machine only"):
        loopback(host)
    status, _, err = run("serve", "--host", host, "--no-browser")
    assert status == 2
    assert "ssh -L" in err
    assert err.count("\n") == 1


# --- how much is taken ----------------------------------------------------------------------------


async def _parts(*parts: bytes):  # type: ignore[no-untyped-def]
    for part in parts:
        yield part


def kept(uploads: Uploads, name: str, *parts: bytes, announced: int | None = None) -> str:
    import asyncio

    return asyncio.run(uploads.keep(name, _parts(*parts), announced))


def test_uploads_are_bounded_in_size_and_number_and_leave_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from nlsdesign.live import sessions as module

    monkeypatch.setattr(module, "FILE_BYTES", 100)
    monkeypatch.setattr(module, "ALL_BYTES", 250)
    uploads = Uploads(tmp_path)
    with pytest.raises(TooLargeError, match=r"a\.csv: is larger than"):
        kept(uploads, "a.csv", b"x" * 60, b"x" * 60)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(TooLargeError):
        kept(uploads, "a.csv", b"x", announced=101)
    for name in ("a.csv", "b.csv", "a.csv"):  # the same name again takes the place of the first
        assert kept(uploads, name, b"x" * 100) == name
    with pytest.raises(TooLargeError):
        kept(uploads, "c.csv", b"x" * 51)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.csv", "b.csv"]
    uploads.clear()
    assert list(tmp_path.iterdir()) == []
    for number in range(FILES):
        kept(uploads, f"r{number}.csv", b"x")
    with pytest.raises(TooLargeError, match="which is the most"):
        kept(uploads, "one_more.csv", b"x")


def test_the_name_of_an_upload_is_no_path(tmp_path: Path) -> None:
    names = {
        "../../etc/cron.csv": "cron.csv", "C:\\x\\run 1.CSV": "run_1.csv", "<img src=x>.csv": "img_src_x.csv",
        "...csv": "record.csv", "\x1b[2J.mat": "2J.mat", "mapping.toml": "records.toml",
        "ü" * 300 + ".csv": "record.csv",
    }  # fmt: skip
    assert {name: plain_name(name) for name in names} == names
    for bad in ("deck.py", "passwd", "", "a.csv/../b", ".csv.exe"):
        with pytest.raises(NlsError, match="no table of records"):
            plain_name(bad)


def test_of_one_drag_only_the_newest_waits_and_what_came_between_stays_in_order() -> None:
    inbox = Inbox()
    for number in range(300):
        inbox.put({"page": {"number": number, "drag": "point 1"}})
    inbox.put({"page": {"number": 300, "what": "undo"}})
    inbox.put({"page": {"number": 301, "drag": "point 1"}})
    inbox.put({"page": {"number": 302, "drag": "point 2"}})
    taken = [inbox.take(0.0) for _ in range(5)]
    assert [each and each["page"]["number"] for each in taken] == [299, 300, 301, 302, None]
    for number in range(2 * MOST):
        inbox.put({"page": {"number": number}})
    inbox.put({"server": {"number": 1}})
    count = 0
    while inbox.take(0.0):
        count += 1
    assert count == MOST + 1


# --- how it begins and ends -----------------------------------------------------------------------


def test_a_port_in_use_and_an_unknown_deck_end_with_one_message(run: Run) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        status, out, err = run("serve", "--no-browser", "--port", str(taken.getsockname()[1]))
    assert (status, out) == (2, "")
    assert "already in use" in err
    assert "--port" in err
    status, out, err = run("serve", "no_such_deck", "--no-browser")
    assert (status, out) == (2, "")
    assert "no_such_deck" in err


def test_a_missing_library_is_named_with_its_extra(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    status, _, err = run("serve", "--no-browser")
    assert status == 2
    assert "pip install 'nlsdesign[live]'" in err


@pytest.mark.skipif(sys.platform != "linux", reason="reads the processes of Linux")
def test_an_interrupt_ends_it_and_all_its_processes() -> None:
    with running() as server:
        until = time.monotonic() + 10.0
        while not (children := processes_of(server.process.pid)) and time.monotonic() < until:
            time.sleep(0.02)
        assert children, "the process of the next session has not begun"
        assert server.end() == 130
        assert server.process.stderr is not None
        assert server.process.stderr.read().split() == ["interrupted"]
        assert not any(os.path.exists(f"/proc/{child}") for child in children)


@pytest.mark.skipif(sys.platform != "linux", reason="reads the processes of Linux")
def test_a_server_that_was_killed_leaves_no_process() -> None:
    process = start()
    try:
        until = time.monotonic() + 20.0
        while not (children := processes_of(process.pid)) and time.monotonic() < until:
            time.sleep(0.02)
        process.kill()
        process.wait(10)
        while any(_lives(child) for child in children) and time.monotonic() < until:
            time.sleep(0.02)
        assert children
        assert not any(_lives(child) for child in children)
    finally:
        process.kill()
        process.communicate(timeout=10)


def _lives(number: int) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] not in ("Z", "X")
    except OSError:
        return False


@pytest.mark.slow
def test_start_is_refused_to_a_module_that_needs_the_server_before_it_is_asked_for() -> None:
    code = "import nlsdesign.cli.main, sys; assert not {'uvicorn', 'starlette', 'asyncio'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
