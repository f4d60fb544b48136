"""The page's server: where it listens, and who may talk to it.

It knows nothing of sites or localization. viser alone would listen on every interface, take another port when the
wished one is busy, and answer every page on the internet that the engineer's browser has open.
"""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import socket
import threading
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from http import HTTPStatus
from types import MappingProxyType
from typing import Any, NamedTuple
from urllib.parse import parse_qs, urlsplit

import rich
import viser
import websockets.asyncio.server as websocket_server
from viser.infra import WebsockServer
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from commission.errors import ServerError

_CONSTRUCTION = threading.Lock()
"""Held while viser is given another `serve`: two servers built at the same time would exchange their sockets."""

_ENTERED = (
    """<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0;url=/"><title>Commission</title>"""
)
"""Answer to a right token. A redirect would do, but after a link in a mail or a chat the browser counts its target as
reached from there and withholds a strict cookie; a page of our own that moves on does not have this problem."""

_PROTECTION = {
    "X-Frame-Options": "DENY",  # a foreign page must not lay ours, invisible, under its own buttons
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class PageServer(viser.ViserServer):
    """viser's server without its tunnel.

    Any browser may ask for a public address of the page by a `ShareUrlRequest`; hiding the button does not stop it.
    """

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002  (viser's signature)
        """Open no tunnel and return None, whoever asks."""
        return None


class GateAnswer(NamedTuple):
    """What the gate says in viser's place."""

    status: HTTPStatus
    text: str
    headers: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Gate:
    """Decides about each request, plain or websocket, before viser sees it."""

    token: str | None
    """Secret that a browser has to bring; None when only this computer can connect."""

    host_names: frozenset[str] | None
    """Names by which a browser may call us; None for any (then the token protects: a cookie belongs to one name).

    On loopback a foreign name that resolves to 127.0.0.1 would otherwise make its page one of ours (DNS rebinding).
    """

    cookie_name: str
    """Cookies are shared by all ports of a computer, so the name contains the port."""

    def answer(self, path: str, headers: Headers) -> GateAnswer | None:
        """Answer of the gate itself; None lets the request through to viser."""
        return self._refused_sender(headers) or self._asked_for_token(path, headers)

    def _refused_sender(self, headers: Headers) -> GateAnswer | None:
        """Refusal of a request that does not come from our own page or from the address bar."""
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return GateAnswer(HTTPStatus.BAD_REQUEST, "Expected one Host and at most one Origin header.\n")
        if self.host_names is not None and _name_of(hosts[0]) not in self.host_names:
            return GateAnswer(HTTPStatus.FORBIDDEN, "This page is served to this computer only, by its own names.\n")
        if origins and not _same_origin(origins[0], hosts[0]):
            return GateAnswer(HTTPStatus.FORBIDDEN, "This page does not answer pages of another origin.\n")
        return None

    def _asked_for_token(self, path: str, headers: Headers) -> GateAnswer | None:
        """Cookie for a right token, refusal of a wrong or missing one, None for a browser that has the cookie."""
        if self.token is None:
            return None
        given = parse_qs(path.partition("?")[2], keep_blank_values=True).get("token")
        if given is None and _has_cookie(headers, self.cookie_name, _cookie_value(self.token)):
            return None
        if given is None or not _same_secret(given[-1], self.token):
            return GateAnswer(HTTPStatus.UNAUTHORIZED, "Open the address that ends with the right ?token=... once.\n")
        cookie = f"{self.cookie_name}={_cookie_value(self.token)}; HttpOnly; SameSite=Strict; Path=/"
        return GateAnswer(HTTPStatus.OK, _ENTERED, {"Set-Cookie": cookie, "Content-Type": "text/html; charset=utf-8"})


def start_server(host: str = "127.0.0.1", port: int = 8080, token: str | None = None) -> viser.ViserServer:
    """Start to serve an empty page.

    Parameters
    ----------
    host : address or name of the interface to listen on. Anything that other computers can reach needs a token.
    port : TCP port; 0 takes any free one, which `get_port()` of the result tells.
    token : secret that a browser brings once as `/?token=...` and then keeps as a cookie.

    Raises
    ------
    ServerError
        The address is not ours, the port is taken or not allowed, or a public address has no token.
    """
    if not 0 <= port <= 65535:
        raise ServerError(f"port {port} does not exist; expected 0 to 65535")
    family, address = _resolved(host, port)
    is_local = ipaddress.ip_address(address[0].partition("%")[0]).is_loopback
    if token is not None and not token:
        raise ServerError("the token is empty; expected a secret text, or none at all on 127.0.0.1")
    if not is_local and token is None:
        raise ServerError(f"{host} can be reached from other computers; expected a token (--token) or host 127.0.0.1")

    listening = _bound(host, family, address)
    try:
        gate = Gate(
            token,
            frozenset({"localhost", "127.0.0.1", "::1", host.lower(), address[0]}) if is_local else None,
            f"commission_{listening.getsockname()[1]}",
        )
        with _viser_listens_on(listening, gate):
            return PageServer(host=host, port=port, label="Commission", verbose=False)
    except BaseException:
        listening.close()
        raise


def _resolved(host: str, port: int) -> tuple[socket.AddressFamily, tuple[Any, ...]]:
    """Family and address of the interface called `host`; one of them, since loopback or not must have one answer."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (socket.gaierror, UnicodeError) as error:
        raise ServerError(f"host '{host}' is unknown; expected a name or address of this computer") from error
    return found[0][0], found[0][4]


def _bound(host: str, family: socket.AddressFamily, address: tuple[Any, ...]) -> socket.socket:
    """Socket that listens already, so that a taken port is found here and not avoided by viser."""
    try:
        return socket.create_server(address, family=family, backlog=100)
    except OSError as error:
        problem = error.strerror or str(error)
        raise ServerError(
            f"{host}:{address[1]}: {problem.lower()}; expected a free port (--port, 0 for any)"
        ) from error


@contextmanager
def _viser_listens_on(listening: socket.socket, gate: Gate) -> Generator[None]:
    """While this lasts, a new viser server listens on the given socket behind the gate.

    viser has no setting for either. It takes `serve` from the websockets package when its thread starts, that is
    before its constructor returns; calls by anybody else in this moment are passed on as they are.
    """
    with _CONSTRUCTION:
        serve: Callable[..., Any] = websocket_server.serve
        console = rich.get_console()
        was_quiet = console.quiet

        def serve_behind_gate(handler: Any, *args: Any, **options: Any) -> Any:
            if getattr(handler, "__module__", None) != WebsockServer.__module__:
                return serve(handler, *args, **options)
            options["process_request"] = _gated(gate, options["process_request"])
            return serve(handler, sock=listening, **options)

        websocket_server.serve = serve_behind_gate  # pyright: ignore[reportAttributeAccessIssue]
        console.quiet = True  # viser would announce an address without the token
        try:
            yield
        finally:
            websocket_server.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
            console.quiet = was_quiet


def _gated(
    gate: Gate, viser_answer: Callable[[ServerConnection, Request], Response | None]
) -> Callable[[ServerConnection, Request], Response | None]:
    """Answer requests as viser does, behind the gate."""

    def process_request(connection: ServerConnection, request: Request) -> Response | None:
        own = gate.answer(request.path, request.headers)
        if own is None:
            response = viser_answer(connection, request)
        else:
            response = connection.respond(own.status, own.text)
            if "Content-Type" in own.headers:
                del response.headers["Content-Type"]  # one more would be added, not put in its place
            response.headers.update({**own.headers, "Cache-Control": "no-store"})
        if response is not None:
            response.headers.update(_PROTECTION)
        return response

    return process_request


def _cookie_value(token: str) -> str:
    """What a browser keeps in place of the token: safe characters whatever the token is made of."""
    return hashlib.sha256(f"commission page {token}".encode()).hexdigest()


def _has_cookie(headers: Headers, name: str, value: str) -> bool:
    """Whether the browser brings this cookie, among others of this computer that may be of any form."""
    pairs = (pair.strip().partition("=") for line in headers.get_all("Cookie") for pair in line.split(";"))
    return any(key == name and _same_secret(found, value) for key, _, found in pairs)


def _same_secret(found: str, expected: str) -> bool:
    """Whether two texts agree, in a time that does not tell how much of them does."""
    return hmac.compare_digest(found.encode(errors="replace"), expected.encode())


def _name_of(host_header: str) -> str | None:
    """Host name without its port, lower case; None when there is no such thing in the header."""
    try:
        return urlsplit(f"//{host_header}").hostname
    except ValueError:
        return None


def _same_origin(origin: str, host_header: str) -> bool:
    """Whether a page of this origin was served by us (https: a proxy in front of us may speak TLS)."""
    scheme, separator, authority = origin.lower().partition("://")
    return bool(separator) and scheme in ("http", "https") and authority == host_header.lower()
