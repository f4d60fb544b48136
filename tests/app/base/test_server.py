"""The server in front of viser, talked to by raw clients: what it lets through and what it refuses."""

from __future__ import annotations

import http.client
import os
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
import viser
import websockets.asyncio.server
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from commission.app.base import connection
from commission.app.base.server import start_server
from commission.errors import ServerError
from tests.app.raw_client import RawClient

TOKEN = "a secret; with = and é"
QUOTED = "a%20secret%3B%20with%20%3D%20and%20%C3%A9"

Start = Callable[..., viser.ViserServer]


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "WRONG_TOKEN_TAKES_S", 0.01)


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts servers on free ports and stops them at the end."""
    servers: list[viser.ViserServer] = []

    def start_one(host: str = "127.0.0.1", port: int = 0, token: str | None = None) -> viser.ViserServer:
        servers.append(start_server(host, port, token))
        return servers[-1]

    yield start_one
    for server in servers:
        server.stop()


def get(port: int, path: str = "/", **headers: str) -> http.client.HTTPResponse:
    """Answer to a plain request; its body has been read."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    response.read()
    connection.close()
    return response


def websocket_status(port: int, origin: str | None = None, **headers: str) -> int:
    """Status of an attempt to open the websocket: 101 when it opens and sends the first message of the scene."""
    try:
        with connect(
            f"ws://127.0.0.1:{port}",
            origin=None if origin is None else Origin(origin),
            additional_headers=headers,
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        ) as client:
            assert len(client.recv(timeout=10)) > 0
            return 101
    except InvalidStatus as refusal:
        return refusal.response.status_code


def entry_cookie(port: int) -> str:
    cookie = get(port, f"/?token={QUOTED}").getheader("Set-Cookie")
    assert cookie is not None
    return cookie.partition(";")[0]


def test_a_server_binds_loopback_unless_told_otherwise(start: Start) -> None:
    server = start()
    listening = server._websock_server._port
    assert server.get_port() == listening > 0
    assert get(listening).status == 200
    with pytest.raises(OSError), socket.create_connection((_own_address(), listening), timeout=2):
        pass


def _own_address() -> str:
    """An address of this computer other than 127.0.0.1: loopback's next, which an open server would answer too."""
    return "127.0.0.2"


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_public_address_without_a_token_is_refused(host: str) -> None:
    with pytest.raises(ServerError, match="expected a token"):
        start_server(host, 0, None)


@pytest.mark.parametrize(("token", "is_enough"), [("a" * 15, False), ("a" * 16, True)])
def test_a_token_has_at_least_16_letters(start: Start, token: str, is_enough: bool) -> None:
    if is_enough:
        assert get(start(token=token).get_port()).status == 401
    else:
        with pytest.raises(ServerError, match="the token has 15 letters; expected at least 16, or --token auto"):
            start(token=token)


@pytest.mark.parametrize(
    "url",
    [
        "agv.example.com",
        "ftp://agv.example.com",
        "https://",
        "https://a/page",
        "https://a?x",
        "https://u@a",
        "https://[",
        "",
    ],
)
def test_a_public_address_that_is_none_is_refused(url: str) -> None:
    with pytest.raises(ServerError, match="expected https://name"):
        start_server("127.0.0.1", 0, TOKEN, url)


def test_a_public_address_needs_a_token() -> None:
    with pytest.raises(ServerError, match="can be reached from other computers; expected a token"):
        start_server("127.0.0.1", 0, None, "https://agv.example.com")


def ports_of_ours() -> set[int]:
    """Ports on which this process listens."""
    listening = "0A"
    lines = [
        line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]
    ]
    sockets = {os.readlink(link) for link in Path("/proc/self/fd").iterdir() if link.is_symlink()}
    return {
        int(part[1].rpartition(":")[2], 16)
        for part in lines
        if part[3] == listening and f"socket:[{part[9]}]" in sockets
    }


def test_a_viser_that_takes_serve_from_elsewhere_ends_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would find our port taken, listen on the next one, and let everybody in without a token."""
    before = ports_of_ours()
    real = websockets.asyncio.server.serve
    monkeypatch.setattr("viser.infra._infra.websockets.asyncio.server", SimpleNamespace(serve=real))
    with pytest.raises(ServerError, match=r"does not listen behind our gate; expected viser 1\.1"):
        start_server("127.0.0.1", 0, TOKEN)
    assert ports_of_ours() == before


def test_a_gate_that_lets_strangers_in_ends_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    before = ports_of_ours()
    monkeypatch.setattr("commission.app.base.gate.AccessGate.answer", lambda *_: None)
    with pytest.raises(ServerError, match=r"a stranger is answered 200 by viser .*; expected to be refused"):
        start_server("127.0.0.1", 0, TOKEN)
    assert ports_of_ours() == before


def test_an_empty_token_is_refused_even_on_loopback() -> None:
    with pytest.raises(ServerError, match="token is empty"):
        start_server("127.0.0.1", 0, "")


@pytest.mark.parametrize("port", [-1, 65536])
def test_a_port_that_does_not_exist_is_refused(port: int) -> None:
    with pytest.raises(ServerError, match="expected 0 to 65535"):
        start_server("127.0.0.1", port, None)


def test_an_unknown_host_is_refused_in_one_line() -> None:
    with pytest.raises(ServerError, match="unknown") as caught:
        start_server("no-such-host.invalid", 0, "token")
    assert "\n" not in str(caught.value)


def test_a_taken_port_is_an_error_and_not_another_port(start: Start) -> None:
    first = start()
    with pytest.raises(ServerError, match=f"127.0.0.1:{first.get_port()}: .*in use"):
        start_server("127.0.0.1", first.get_port(), None)
    assert get(first.get_port()).status == 200


def test_a_stopped_server_gives_its_port_back() -> None:
    first = start_server("127.0.0.1", 0, None)
    port = first.get_port()
    first.stop()
    second = start_server("127.0.0.1", port, None)
    assert second.get_port() == port
    second.stop()


def test_the_environment_cannot_move_the_server_to_another_port(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", "1")
    assert get(start().get_port()).status == 200


def test_two_servers_have_their_own_ports_and_gates(start: Start) -> None:
    ports: list[int] = []
    threads = [
        threading.Thread(target=lambda token=token: ports.append(start(token=token).get_port()))
        for token in (None, TOKEN)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(get(port).status for port in ports) == [200, 401]


def test_nothing_of_the_wrapping_remains(start: Start) -> None:
    before = websockets.asyncio.server.serve
    start(token=TOKEN)
    with pytest.raises(ServerError):
        start_server("0.0.0.0", 0, None)
    assert websockets.asyncio.server.serve is before


def test_without_token_this_computer_is_served_and_its_websocket_opens(start: Start) -> None:
    port = start().get_port()
    page = get(port)
    assert page.status == 200
    assert page.getheader("X-Frame-Options") == "DENY"
    assert websocket_status(port) == 101
    assert websocket_status(port, origin=f"http://127.0.0.1:{port}") == 101


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1", "http://localhost:1", "file://", ""]
)
def test_a_page_of_another_origin_cannot_open_the_websocket(start: Start, origin: str) -> None:
    port = start().get_port()
    assert websocket_status(port, origin=origin) == 403
    assert get(port, Origin=origin).status == 403


def test_a_foreign_name_that_resolves_to_loopback_is_refused(start: Start) -> None:
    port = start().get_port()
    assert get(port, Host=f"evil.example:{port}").status == 403
    # Rebinding makes the origin agree with the host, so the name itself has to be refused.
    assert get(port, Host=f"evil.example:{port}", Origin=f"http://evil.example:{port}").status == 403
    assert get(port, Host="[::1").status in (400, 403)


@pytest.mark.parametrize("name", ["localhost", "LOCALHOST", "127.0.0.1", "[::1]"])
def test_every_name_of_this_computer_is_served_also_through_a_forwarded_port(start: Start, name: str) -> None:
    port = start().get_port()
    assert get(port, Host=f"{name}:9000", Origin=f"http://{name}:9000").status == 200


def test_two_host_headers_are_refused(start: Start) -> None:
    port = start().get_port()
    with socket.create_connection(("127.0.0.1", port), timeout=10) as raw:
        raw.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n")
        assert raw.recv(100).startswith(b"HTTP/1.1 400")


def test_without_the_token_neither_page_nor_websocket_is_given(start: Start) -> None:
    port = start(token=TOKEN).get_port()
    assert get(port).status == 401
    assert get(port, "/index.html").status == 401
    assert get(port, "/?token=wrong").status == 401
    assert get(port, "/?token=").status == 401
    assert get(port, "//[?token").status == 401
    assert websocket_status(port) == 401
    assert websocket_status(port, Cookie=f"commission_{port}=wrong") == 401
    assert websocket_status(port, Cookie='a b; {}=,"; commission') == 401


def test_the_token_earns_a_strict_cookie_and_the_cookie_opens_everything(start: Start) -> None:
    port = start(token=TOKEN).get_port()
    entered = get(port, f"/?token={QUOTED}")
    cookie = entered.getheader("Set-Cookie") or ""
    assert entered.status == 200
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert "secret" not in cookie
    assert entered.getheader("Cache-Control") == "no-store"

    cookie = cookie.partition(";")[0]
    assert get(port, Cookie=cookie).status == 200
    assert get(port, Cookie=f'other={{"a": [1]}} b; {cookie}; =').status == 200
    assert websocket_status(port, Cookie=cookie) == 101
    assert websocket_status(port, origin=f"http://127.0.0.1:{port}", Cookie=cookie) == 101


def test_a_wrong_token_is_refused_in_spite_of_a_right_cookie(start: Start) -> None:
    port = start(token=TOKEN).get_port()
    assert get(port, "/?token=wrong", Cookie=entry_cookie(port)).status == 401


def test_a_right_cookie_does_not_help_a_page_of_another_origin(start: Start) -> None:
    port = start(token=TOKEN).get_port()
    assert websocket_status(port, origin="http://evil.example", Cookie=entry_cookie(port)) == 403


def test_the_cookie_of_one_server_does_not_open_another(start: Start) -> None:
    first, second = start(token="one of the secrets").get_port(), start(token="two of the secrets").get_port()
    cookie = (get(first, "/?token=one%20of%20the%20secrets").getheader("Set-Cookie") or "").partition(";")[0]
    assert get(first, Cookie=cookie).status == 200
    assert get(second, Cookie=cookie).status == 401
    assert get(second, Cookie=cookie.replace(str(first), str(second))).status == 401


def test_with_a_token_other_computers_reach_the_page_by_any_name(start: Start) -> None:
    port = start("0.0.0.0", token=TOKEN).get_port()
    assert get(port, Host="agv-laptop:80").status == 401
    assert get(port, Host="agv-laptop:80", Cookie=entry_cookie(port)).status == 200
    assert get(port, Host="agv-laptop:80", Origin="http://evil.example", Cookie=entry_cookie(port)).status == 403


def test_nobody_can_make_the_server_open_a_tunnel(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[object] = []
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *args: opened.append(args))
    server = start()
    client = RawClient(server)
    client.send(type="ShareUrlRequest")
    client.hear_until(lambda message: message["type"] == "NotificationShowMessage")
    assert client.refused == 1
    assert server.request_share_url() is None
    assert opened == []
    client.close()
