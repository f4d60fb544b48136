"""The page's server: where it listens, and who may talk to it.

It knows nothing of sites or localization. viser alone would listen on every interface, take another port when the
asked one is busy, and answer every page on the internet that the engineer's browser has open.
"""

from __future__ import annotations

import http.client
import ipaddress
import json
import logging
import socket
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import rich
import viser
import websockets.asyncio.server as websocket_server

from commission.app.base import viser_private
from commission.app.base.connection import LARGEST_MESSAGE, Door
from commission.app.base.gate import AccessGate
from commission.app.base.relight import light_message, wants_light
from commission.app.base.seam import Seam
from commission.app.base.transfers import Transfers
from commission.errors import ServerError

log = logging.getLogger(__name__)

SHORTEST_TOKEN = 16
"""Letters of a token that can be chosen by hand."""

_CONSTRUCTION = threading.Lock()
"""Held while viser is given another `serve`: two servers built at the same time would exchange their sockets."""


class PageServer(viser.ViserServer):
    """viser's server without its tunnel.

    Any browser may ask for a public address of the page by a `ShareUrlRequest`; the seam does not let it through, and
    nothing happens where it did.
    """

    alive: Callable[[], dict[str, object]] | None = None
    """What the page is told when it asks whether the program works; see `watch.Watch`."""

    transfers: Transfers
    """Files on their way from browsers."""

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002  (viser's signature)
        """Open no tunnel and return None, whoever asks."""
        return None

    def stop(self) -> None:
        """End quietly."""
        with _quiet():
            super().stop()


def start_server(
    host: str = "127.0.0.1", port: int = 8080, token: str | None = None, public_url: str | None = None
) -> PageServer:
    """Start to serve an empty page.

    Parameters
    ----------
    host : address or name of the interface to listen on. Anything that other computers can reach needs a token.
    port : TCP port; 0 takes any free one, which `get_port()` of the result tells.
    token : secret that a browser brings once as `/?token=...` and then keeps as a cookie.
    public_url : address of a proxy in front of the server, `https://name`, by which browsers call it; needs a token.

    Raises
    ------
    ServerError
        The address is not ours, the port is taken or not allowed, a public address has no token, the token is too
        short, or viser does not listen behind the gate.
    """
    if not 0 <= port <= 65535:
        raise ServerError(f"port {port} does not exist; expected 0 to 65535")
    family, address = _resolved(host, port)
    is_local = ipaddress.ip_address(address[0].partition("%")[0]).is_loopback
    _check_token(token, None if is_local else host, public_url)
    origin = None if public_url is None else _origin(public_url)

    listening = _bound(host, family, address)
    own_names = {"localhost", "127.0.0.1", "::1", host.lower(), address[0]}
    public_names = () if origin is None else (urlsplit(origin).hostname or "",)
    gate = AccessGate(
        token=token,
        host_names=frozenset({*own_names, *public_names}) if is_local else None,
        cookie_name=f"commission_{listening.getsockname()[1]}",
        public_origin=origin,
    )
    try:
        door = Door(gate, lambda: json.dumps({} if server.alive is None else server.alive()))
        with _viser_listens_on(listening, door):
            server = PageServer(host=host, port=port, label="Commission", verbose=False)
    except BaseException:
        listening.close()
        raise
    try:
        _prove(server, door, listening)
    except BaseException:
        server.stop()
        listening.close()
        raise
    return server


def _check_token(token: str | None, open_host: str | None, public_url: str | None) -> None:
    """Refuse a token that is none, and none where others can connect."""
    if token is not None and not token:
        raise ServerError("the token is empty; expected a secret text, or none at all on 127.0.0.1")
    if token is not None and len(token) < SHORTEST_TOKEN:
        raise ServerError(f"the token has {len(token)} letters; expected at least {SHORTEST_TOKEN}, or --token auto")
    if token is None and open_host is not None:
        raise ServerError(f"{open_host} can be reached from other computers; expected a token (--token auto)")
    if token is None and public_url is not None:
        raise ServerError(f"{public_url} can be reached from other computers; expected a token (--token auto)")


def _origin(public_url: str) -> str:
    """Scheme, name and port of a proxy's address."""
    expected = f"the public address is '{public_url}'; expected https://name or https://name:port"
    try:
        parts = urlsplit(public_url)
        is_usable = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.path in ("", "/")
    except ValueError as error:
        raise ServerError(expected) from error
    if not is_usable or parts.query or parts.fragment or "@" in parts.netloc:
        raise ServerError(expected)
    return f"{parts.scheme}://{parts.netloc}".lower()


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
def _viser_listens_on(listening: socket.socket, door: Door) -> Generator[None]:
    """While this lasts, a new viser server listens on the given socket behind the door.

    viser has no setting for either. It takes `serve` from the websockets package when its thread starts, that is
    before its constructor returns; calls by anybody else in this moment are passed on as they are.
    """
    with _CONSTRUCTION, _quiet():  # viser would announce an address without the token
        serve: Callable[..., Any] = websocket_server.serve

        def serve_behind_door(handler: Any, *args: Any, **options: Any) -> Any:
            if getattr(handler, "__module__", None) != viser_private.HANDLER_MODULE:
                return serve(handler, *args, **options)
            options.update(
                process_request=door.answering(options["process_request"]),
                create_connection=door.connection,
                max_size=LARGEST_MESSAGE,
                sock=listening,
            )
            door.is_used = True
            return serve(door.guarded(handler), **options)

        websocket_server.serve = serve_behind_door  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield
        finally:
            websocket_server.serve = serve  # pyright: ignore[reportAttributeAccessIssue]


@contextmanager
def _quiet() -> Generator[None]:
    """Let viser print nothing."""
    console = rich.get_console()
    was_quiet, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = was_quiet


def _prove(server: PageServer, door: Door, listening: socket.socket) -> None:
    """Open the door, once it is sure that nobody comes in beside it.

    Another viser might take `serve` from elsewhere: it would find our port taken, listen on the next one, on every
    interface, and let everybody in.
    """
    if not door.is_used or viser_private.listening_port(server) != listening.getsockname()[1]:
        raise ServerError(f"viser {viser.__version__} does not listen behind our gate; expected viser 1.1")
    viser_private.make_robust(server)
    viser_private.repaint(server, wants_light, light_message)
    server.transfers = Transfers(server)
    door.open(server, Seam(server))
    status = _status_for_a_stranger(listening)
    if status not in (http.client.UNAUTHORIZED, http.client.FORBIDDEN):
        raise ServerError(f"a stranger is answered {status} by viser {viser.__version__}; expected to be refused")


def _status_for_a_stranger(listening: socket.socket) -> int:
    """Ask the server for the page as somebody who has no token and calls it by a foreign name."""
    address, port = listening.getsockname()[:2]
    near = str({"0.0.0.0": "127.0.0.1", "::": "::1"}.get(address, address))  # noqa: S104  (compared, not bound)
    connection = http.client.HTTPConnection(near, port, timeout=10.0)
    try:
        connection.request("GET", "/", headers={"Host": "gate.invalid"})
        return connection.getresponse().status
    except OSError as error:
        raise ServerError(f"{near}:{port} does not answer: {error}") from error
    finally:
        connection.close()
