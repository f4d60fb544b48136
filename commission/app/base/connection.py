"""A connection of a browser to the page's server: what comes in is bounded and checked before viser hears it.

websockets answers GET only, and a line that is too long not at all; viser reads every message of every connection.
"""

from __future__ import annotations

import asyncio
import logging
import re
from collections import Counter
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import Any

from viser import ViserServer
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from commission.app.base import viser_private
from commission.app.base.gate import AccessGate, GateAnswer
from commission.app.base.seam import Seam

log = logging.getLogger(__name__)

MOST_BROWSERS = 64
"""Pages that may be open at the same time."""
MOST_CONNECTIONS = 256
"""Connections of any kind; those without a page are closed within 10 s."""
LARGEST_MESSAGE = 4 * 1024 * 1024
"""Bytes of one message; the largest that is of use is a part of an upload, or a long pasted table."""
LONGEST_LINE = 8_000
"""Letters of the first line of a request; websockets closes without an answer beyond 8,192."""
LARGEST_HEAD = 65_536
WRONG_TOKEN_TAKES_S = 1.0
"""Time until a wrong token is answered [s]."""
WRONG_TOKENS_AT_ONCE = 2
"""Wrong tokens of one address that are being answered; while there are so many, it is asked to wait, right or wrong."""
MESSAGES_PER_S = 1_000.0
"""Messages that are heard from one browser; a drag sends 60, an upload over a fast network 200 [1/s]."""
MESSAGES_AT_ONCE = 1_000.0
PROTECTION = {
    "X-Frame-Options": "DENY",  # a foreign page must not lay ours, invisible, under its own buttons
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}

_METHOD = re.compile(rb"[A-Z]{1,20}")
_OF_BODY = (b"content-length:", b"transfer-encoding:", b"expect:")
"""Headers about a body, for which websockets would close without an answer."""
_TOO_LONG = (
    b"HTTP/1.1 414 URI Too Long\r\nContent-Type: text/plain\r\nContent-Length: 26\r\nConnection: close\r\n\r\n"
    b"Expected a shorter address"
)

ViserAnswer = Callable[[ServerConnection, Request], Response | None]


class Door:
    """What all connections of one server share: the gate, the seam, and how many there are.

    Parameters
    ----------
    gate : decides about requests.
    alive : answers the page's question whether the program is there and works, as JSON.
    """

    def __init__(self, gate: AccessGate, alive: Callable[[], str]) -> None:
        self.gate = gate
        self.is_used = False
        """Whether viser's server has been put behind it."""
        self.connections = 0
        self.browsers = 0
        self._alive = alive
        self._inside: tuple[ViserServer, Seam] | None = None
        self._guesses: Counter[str] = Counter()

    def open(self, server: ViserServer, seam: Seam) -> None:
        """Let browsers in, from now on."""
        self._inside = server, seam

    def admit(self, connection: GuardedConnection, raw: bytes | str) -> bytes | None:
        """Return a message as viser may read it, or None when it may not."""
        if self._inside is None:
            return None
        server, seam = self._inside
        if connection.number is None:
            connection.number = viser_private.number_of(server, connection)
        return None if connection.number is None else seam.admit(connection.number, raw)

    def connection(self, *args: Any, **options: Any) -> GuardedConnection:
        """Make a connection, as websockets asks for one."""
        return GuardedConnection(self, *args, **options)

    def guarded(self, handle: Callable[[ServerConnection], Awaitable[None]]) -> Callable[..., Awaitable[None]]:
        """Return viser's handler of a websocket, for pages of this version and not more of them than can be served."""

        async def handler(connection: ServerConnection) -> None:
            if connection.subprotocol != viser_private.SUBPROTOCOL:
                found = connection.subprotocol or "no version"
                log.info("a page of another version (%s) was turned away; reload it", found)
                await connection.close(1002, f"This page is of {found}; reload it")
                return
            if self.browsers >= MOST_BROWSERS:
                log.warning("%d pages are open; another one was turned away", self.browsers)
                await connection.close(1013, f"{self.browsers} pages are open already")
                return
            self.browsers += 1
            try:
                await handle(connection)
            finally:
                self.browsers -= 1

        return handler

    def answering(
        self, viser_answer: ViserAnswer
    ) -> Callable[[GuardedConnection, Request], Awaitable[Response | None]]:
        """Answer requests as viser does, behind the gate."""

        async def process_request(connection: GuardedConnection, request: Request) -> Response | None:
            own = await self._answer(connection, request)
            response = viser_answer(connection, request) if own is None else _response(connection, own)
            if response is None:
                return None
            response.headers.update(PROTECTION)
            if connection.method == "HEAD":
                response.body = b""
            return response

        return process_request

    async def _answer(self, connection: GuardedConnection, request: Request) -> GateAnswer | None:
        """Answer of the gate, slowly where it refuses a guess; None where viser answers."""
        if self._inside is None:
            return GateAnswer(HTTPStatus.SERVICE_UNAVAILABLE, "The page is being made.\n", {"Retry-After": "1"})
        brings_secret = self.gate.brings_secret(request.path, request.headers)
        address = str((connection.remote_address or ("",))[0])
        if brings_secret and self._guesses[address] >= WRONG_TOKENS_AT_ONCE:
            return GateAnswer(HTTPStatus.TOO_MANY_REQUESTS, "Wrong tokens came from there; try again in a second.\n")
        own = self.gate.answer(connection.method, request.path, request.headers)
        if own is not None and own.status is HTTPStatus.UNAUTHORIZED and brings_secret:
            async with self._slowly(address):
                return own
        if own is None and request.path.partition("?")[0] == "/alive" and "Upgrade" not in request.headers:
            return GateAnswer(HTTPStatus.OK, self._alive(), {"Content-Type": "application/json"})
        return own

    @asynccontextmanager
    async def _slowly(self, address: str) -> AsyncGenerator[None]:
        """Wait, while the address counts as one that guesses."""
        self._guesses[address] += 1
        try:
            await asyncio.sleep(WRONG_TOKEN_TAKES_S)
            yield
        finally:
            self._guesses[address] -= 1
            if not self._guesses[address]:
                del self._guesses[address]


class GuardedConnection(ServerConnection):
    """One connection; viser hears of it what the seam admits."""

    def __init__(self, door: Door, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.method = "GET"
        """What the browser asked for."""
        self.number: int | None = None
        """viser's number of this connection; none as long as nothing has come."""
        self._door = door
        self._head: bytearray | None = bytearray()
        self._is_deaf = False
        self._allowance = MESSAGES_AT_ONCE
        self._heard_at = 0.0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Count the connection, and end one too many."""
        self._door.connections += 1
        super().connection_made(transport)
        if self._door.connections > MOST_CONNECTIONS:
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Count the connection no more."""
        self._door.connections -= 1
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read the first line of a request ourselves; what follows is websockets' business."""
        if self._is_deaf:
            return
        if self._head is None:
            super().data_received(data)
            return
        head = self._head
        head += data
        line, end, _ = head.partition(b"\n")
        if len(line) > LONGEST_LINE:
            self._is_deaf = True
            self.transport.write(_TOO_LONG)
            self.transport.close()
            return
        method, _, rest = line.partition(b" ")
        if not end:
            # What cannot become a request is not waited for.
            if _METHOD.fullmatch(method) or not head:
                return
        elif method != b"GET" and _METHOD.fullmatch(method) and rest:
            self._receive_other_method(bytes(method), bytes(head))
            return
        self._head = None
        super().data_received(bytes(head))

    def _receive_other_method(self, method: bytes, begun: bytes) -> None:
        """Let websockets read a request that is no GET as one; its body, if it has one, is not listened to."""
        head, end, _ = begun.partition(b"\r\n\r\n")
        if not end and len(head) <= LARGEST_HEAD:
            return
        self._is_deaf = True
        self.method = method.decode()
        lines = (line for line in head[len(method) :].split(b"\r\n") if not line.lower().startswith(_OF_BODY))
        super().data_received(b"GET" + b"\r\n".join(lines) + end)

    async def recv(self, decode: bool | None = None) -> Any:
        """Wait for the next message that viser may hear."""
        while True:
            raw = await super().recv(decode)
            await self._keep_pace()
            admitted = self._door.admit(self, raw)
            if admitted is not None:
                return admitted

    async def _keep_pace(self) -> None:
        """Let a flood wait, so that others are heard, too; what waits fills no memory, since nothing more is read.

        Always for one turn of the loop: by then viser has carried out the message before, on which this one may rest.
        """
        now = self.loop.time()
        self._allowance = min(self._allowance + (now - self._heard_at) * MESSAGES_PER_S, MESSAGES_AT_ONCE) - 1.0
        self._heard_at = now
        await asyncio.sleep(max(-self._allowance / MESSAGES_PER_S, 0.0))


def _response(connection: ServerConnection, answer: GateAnswer) -> Response:
    """Write an answer of our own."""
    response = connection.respond(answer.status, answer.text)
    if "Content-Type" in answer.headers:
        del response.headers["Content-Type"]  # one more would be added, not put in its place
    response.headers.update({**answer.headers, "Cache-Control": "no-store"})
    return response
