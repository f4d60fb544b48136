"""What reaches the server before it is a message: methods, addresses, probes, floods, guesses."""

from __future__ import annotations

import http.client
import json
import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from commission.app.base import connection
from commission.app.base.server import PageServer, start_server
from tests.app.raw_client import RawClient

TOKEN = "abcdefghijklmnop"

Start = Callable[..., PageServer]


@pytest.fixture
def start() -> Iterator[Start]:
    servers: list[PageServer] = []

    def start_one(token: str | None = None, public_url: str | None = None) -> PageServer:
        servers.append(start_server("127.0.0.1", 0, token, public_url))
        return servers[-1]

    yield start_one
    for server in servers:
        server.stop()


def ask(
    port: int, method: str, path: str = "/", body: bytes = b"", **headers: str
) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of an answer."""
    client = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    client.request(method, path, body or None, headers)
    response = client.getresponse()
    content = response.read()
    client.close()
    return response.status, dict(response.getheaders()), content


def say(port: int, *pieces: bytes, pause: float = 0.0) -> bytes:
    """Say something to the port, piece by piece, and return what it answers until it closes."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as probe:
        for piece in pieces:
            probe.sendall(piece)
            time.sleep(pause)
        answer = b""
        try:
            while part := probe.recv(65536):
                answer += part
        except ConnectionResetError:
            pass
        return answer


def test_head_is_answered_like_get_without_the_page_itself(start: Start) -> None:
    port = start().get_port()
    status, headers, body = ask(port, "GET")
    assert (status, len(body)) == (200, int(headers["Content-Length"]))
    head = ask(port, "HEAD")
    assert (head[0], head[2]) == (200, b"")
    assert head[1]["Content-Length"] == headers["Content-Length"]
    assert ask(port, "HEAD", "/nothing-here")[0] == 404


def test_options_says_what_can_be_asked_and_lets_no_foreign_page_in(start: Start) -> None:
    port = start().get_port()
    status, headers, body = ask(port, "OPTIONS")
    assert (status, headers["Allow"], body) == (204, "GET, HEAD, OPTIONS", b"")
    assert [name for name in headers if name.lower().startswith("access-control")] == []
    assert ask(port, "OPTIONS", Origin="http://evil.example")[0] == 403


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "TRACE", "CONNECT", "PROPFIND"])
def test_other_methods_are_refused_and_their_body_is_not_listened_to(start: Start, method: str) -> None:
    port = start().get_port()
    status, headers, _ = ask(port, method, body=b"\x81\x05hello" * 100)
    assert (status, headers["Allow"]) == (405, "GET, HEAD, OPTIONS")


@pytest.mark.parametrize("method", ["HEAD", "OPTIONS", "POST"])
def test_no_method_gets_around_the_token(start: Start, method: str) -> None:
    port = start(TOKEN).get_port()
    assert ask(port, method)[0] == 401
    assert ask(port, method, "/alive")[0] == 401


def test_a_request_may_come_letter_by_letter(start: Start) -> None:
    request = b"HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n"
    answer = say(start().get_port(), *(request[i : i + 1] for i in range(len(request))), pause=0.001)
    assert answer.startswith(b"HTTP/1.1 200 OK")
    assert answer.endswith(b"\r\n\r\n")


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/" + "a" * 200, 404),
        ("/" + "a" * 201, 414),
        ("/" + "a/" * 500, 414),
        ("/" + "a" * 9_000, 414),
        ("/" + "%61" * 201, 414),
        ("/a%00b", 400),
        ("/a%0ab", 400),
        ("/a%ff%fe", 404),
        ("/../../etc/passwd", 404),
        ("/%2e%2e/%2e%2e/etc/passwd", 404),
    ],
)
def test_odd_addresses_are_refused_with_their_status(
    start: Start, path: str, status: int, caplog: pytest.LogCaptureFixture
) -> None:
    assert ask(start().get_port(), "GET", path)[0] == status
    assert [record for record in caplog.records if record.levelno >= logging.WARNING] == []


def test_the_page_can_ask_whether_the_program_is_there(start: Start) -> None:
    server = start()
    assert ask(server.get_port(), "GET", "/alive")[2] == b"{}"
    server.alive = lambda: {"owner_s": 0.5}
    status, headers, body = ask(server.get_port(), "GET", "/alive")
    assert (status, json.loads(body)) == (200, {"owner_s": 0.5})
    assert headers["Content-Type"] == "application/json"
    assert headers["Cache-Control"] == "no-store"


PROBES = (
    b"",
    b"\n",
    b"\r\n\r\n",
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\0" * 500,
    b"SSH-2.0-OpenSSH_9.6\r\n",
    b"GET\r\n\r\n",
    b"GET / HTTP/1.0\r\n\r\n",
    b"GET / HTTP/1.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
    b"GET / HTTP/1.1\r\nno header\r\n\r\n",
    b"get / http/1.1\r\nhost: localhost\r\n\r\n",
    b"HEAD\r\n\r\n",
    b"OPTIONS * HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"\xff" * 20_000,
    b"A" * 20_000,
    b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 1_000 + b"\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n",
)


def test_probes_of_the_port_are_no_line_in_the_terminal(
    start: Start, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    port = start().get_port()
    for probe in PROBES:
        with socket.create_connection(("127.0.0.1", port), timeout=10) as client:
            client.sendall(probe)
            client.shutdown(socket.SHUT_WR)
            client.settimeout(5)
            try:
                while client.recv(65536):
                    pass
            except ConnectionResetError:
                pass
    assert ask(port, "GET")[0] == 200
    assert [record for record in caplog.records if record.levelno >= logging.INFO and record.exc_info] == []
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING] == []
    assert capfd.readouterr() == ("", "")


def test_a_page_of_another_version_is_turned_away_in_one_line(
    start: Start, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    caplog.set_level(logging.INFO)
    port = start().get_port()
    with connect(f"ws://127.0.0.1:{port}", subprotocols=[Subprotocol("viser-v0.1.2")]) as old:
        with pytest.raises(Exception, match="1002"):
            old.recv(timeout=10)
        assert old.close_reason == "This page is of viser-v0.1.2; reload it"
    ours = [record.getMessage() for record in caplog.records if record.name.startswith("commission")]
    assert ours == ["a page of another version (viser-v0.1.2) was turned away; reload it"]
    assert capfd.readouterr().out == ""


def test_more_pages_than_can_be_served_are_turned_away(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "MOST_BROWSERS", 3)
    server = start()
    clients = [RawClient(server) for _ in range(3)]
    until(lambda: len(server.get_clients()) == 3)
    late = RawClient(server, is_silent=True)
    late.hear_all(2.0)
    assert late.close_reason == "3 pages are open already"
    clients[0].close()
    until(lambda: len(server.get_clients()) == 2)
    after = RawClient(server)
    until(lambda: len(server.get_clients()) == 3)
    for client in (*clients[1:], after):
        client.close()


def test_connections_that_never_ask_for_anything_are_bounded_and_closed(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "MOST_CONNECTIONS", 5)
    port = start().get_port()
    silent = [socket.create_connection(("127.0.0.1", port), timeout=10) for _ in range(6)]
    assert silent[5].recv(1) == b""
    for one in silent:
        one.close()
    until(lambda: _answers(port))


def _answers(port: int) -> bool:
    try:
        return ask(port, "GET")[0] == 200
    except OSError:
        return False


@pytest.mark.measures_time
def test_wrong_tokens_are_slowed_down_and_right_cookies_are_not(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "WRONG_TOKEN_TAKES_S", 0.5)
    port = start(TOKEN).get_port()
    cookie = ask(port, "GET", f"/?token={TOKEN}")[1]["Set-Cookie"].partition(";")[0]
    statuses: list[int] = []
    started = time.monotonic()

    def guess() -> None:
        for number in range(5):
            statuses.append(ask(port, "GET", f"/?token=guess{number:011}")[0])

    threads = [threading.Thread(target=guess) for _ in range(5)]
    for thread in threads:
        thread.start()
    time.sleep(0.1)
    # While guesses are under way, their computer learns nothing from its other requests, be they right or wrong.
    assert ask(port, "GET", f"/?token={TOKEN}")[0] == 429
    assert ask(port, "GET", Cookie=cookie)[0] == 429
    for thread in threads:
        thread.join()
    seconds = time.monotonic() - started
    # Two at a time, half a second each; the others were not looked at.
    assert statuses.count(401) <= 2 + 4 * seconds
    assert statuses.count(429) == 25 - statuses.count(401)
    until(lambda: ask(port, "GET", Cookie=cookie)[0] == 200)


@pytest.mark.measures_time
def test_a_wrong_cookie_is_as_slow_as_a_wrong_token_and_a_missing_one_is_not(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "WRONG_TOKEN_TAKES_S", 0.5)
    port = start(TOKEN).get_port()
    for headers, is_slow in (({"Cookie": f"commission_{port}=x"}, True), ({"Cookie": "other=x"}, False), ({}, False)):
        started = time.monotonic()
        assert ask(port, "GET", **headers)[0] == 401
        assert (time.monotonic() - started > 0.5) is is_slow


PUBLIC = "https://agv.example.com"


def test_behind_a_proxy_the_page_answers_to_its_public_name(start: Start) -> None:
    port = start(TOKEN, PUBLIC).get_port()
    status, headers, _ = ask(port, "GET", f"/?token={TOKEN}", Host="agv.example.com")
    assert status == 200
    assert "Secure" in headers["Set-Cookie"]
    cookie = headers["Set-Cookie"].partition(";")[0]
    assert ask(port, "GET", Host="agv.example.com", Cookie=cookie)[0] == 200
    # A proxy may call us by our own name and pass on the page's origin.
    assert ask(port, "GET", Origin=PUBLIC, Cookie=cookie)[0] == 200
    assert ask(port, "GET", Host="agv.example.com", Origin=PUBLIC, Cookie=cookie)[0] == 200
    assert ask(port, "GET", Host="agv.example.com", Origin="https://evil.example", Cookie=cookie)[0] == 403
    assert ask(port, "GET", Host="evil.example", Cookie=cookie)[0] == 403
    # Called from this computer itself, over http, the cookie has to work as well.
    assert "Secure" not in ask(port, "GET", f"/?token={TOKEN}")[1]["Set-Cookie"]


def test_a_websocket_through_a_proxy_opens_for_its_public_origin_only(start: Start) -> None:
    port = start(TOKEN, PUBLIC).get_port()
    cookie = ask(port, "GET", f"/?token={TOKEN}")[1]["Set-Cookie"].partition(";")[0]
    for origin, status in ((PUBLIC, 101), ("http://agv.example.com", 403), ("https://agv.example.com:444", 403)):
        assert _websocket_status(port, origin, cookie) == status


def _websocket_status(port: int, origin: str, cookie: str) -> int:
    try:
        with connect(
            f"ws://127.0.0.1:{port}",
            additional_headers={"Cookie": cookie, "Origin": origin},
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        ):
            return 101
    except InvalidStatus as refusal:
        return refusal.response.status_code


def until(reached: Callable[[], bool]) -> None:
    end = time.monotonic() + 10.0
    while not reached():
        assert time.monotonic() < end
        time.sleep(0.02)
