"""What virtual devices have in common that are connected to: a server on one port that answers whoever asks."""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import ClassVar, Self

from commission.io.live.registry import SourceAddress
from commission.io.protocols.cola import split_frames
from commission.io.protocols.message import Sent

LOOK_UP_S = 0.05
FIRST_CLIENT_S = 60.0
"""Time for which a device waits for who listens before it begins to drive [s]."""
LAST_S = 5.0
"""Time in which clients have to take what is left, when it ends [s]."""
WAITING_LIMIT = 512
"""Telegrams that wait for a client; of more, the oldest is dropped."""


class StreamDevice:
    """A device that speaks CoLa over TCP; opening it waits until somebody asks for scans.

    Parameters
    ----------
    address : of the device.
    scanners : names of the vehicle's scanners.
    """

    sends_all: ClassVar[bool] = False

    def __init__(self, address: SourceAddress, scanners: tuple[str, ...]) -> None:
        self.address, self.scanners = address, scanners
        self._clients: list[StreamClient] = []
        self._stopped = threading.Event()
        self._asked = threading.Event()
        self._threads: list[threading.Thread] = []

    def __enter__(self) -> Self:
        self._server = socket.create_server((self.address.host, self.address.port))
        self._server.settimeout(LOOK_UP_S)
        self._begin(self._accept)
        self._asked.wait(FIRST_CLIENT_S)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            for client in self._clients:
                client.drained.wait(LAST_S)
        self._stopped.set()
        for thread in self._threads:
            thread.join()
        for client in self._clients:
            client.socket.close()
        self._server.close()

    def pieces(self, record: Sent) -> list[bytes]:
        """Return the frames of a record."""
        raise NotImplementedError

    def send(self, record: Sent) -> None:
        """Send the frames of a record to whoever has asked."""
        for piece in self.pieces(record):
            for client in self._clients:
                client.put(piece)

    def answer(self, request: bytes, client: StreamClient) -> bytes:
        """Answer a request with a frame, or nothing; says by `client.owe` how many frames the client may have.

        Parameters
        ----------
        request : content of a frame.
        client : who asks.
        """
        raise NotImplementedError

    def _begin(self, run: Callable[..., None], *arguments: object) -> None:
        thread = threading.Thread(target=run, args=arguments, name="virtual device", daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        while not self._stopped.is_set():
            try:
                opened, _ = self._server.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            # An answer of two frames is not held back until the first one is acknowledged, which takes 40 ms.
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            opened.settimeout(LOOK_UP_S)
            client = StreamClient(opened)
            self._clients.append(client)
            self._begin(self._serve, client)

    def _serve(self, client: StreamClient) -> None:
        """Answer one client until it is gone."""
        rest = b""
        while not self._stopped.is_set():
            try:
                data = client.socket.recv(4_096)
                if not data:
                    break
                frames, rest = split_frames(rest + data)
                for frame in frames:
                    reply = self.answer(frame, client)
                    client.write(reply)
                    if client.owed:
                        client.has_asked = True
                        self._asked.set()
                client.hand_on()
            except TimeoutError:
                continue
            except OSError:
                break
        client.end()


class StreamClient:
    """One connection."""

    def __init__(self, opened: socket.socket) -> None:
        self.socket = opened
        self.owed = 0
        """Frames that it has asked for and not got; -1: all that come."""
        self.has_asked = False
        """Whether it has asked for any: what is measured from then on waits for it."""
        self.drained = threading.Event()
        self._lock = threading.Lock()
        self._waiting: deque[bytes] = deque(maxlen=WAITING_LIMIT)
        self.drained.set()

    def put(self, piece: bytes) -> None:
        """Take a frame that the device has."""
        if self.has_asked:
            self._waiting.append(piece)
            self.drained.clear()
            self.hand_on()

    def hand_on(self) -> None:
        """Send what is waited for."""
        with self._lock:
            while self._waiting and self.owed:
                self.owed -= self.owed > 0
                self._write(self._waiting.popleft())
            if not self._waiting:
                self.drained.set()

    def owe(self, frames: int) -> None:
        """Say that it may have so many frames more; -1: all that come."""
        with self._lock:
            self.owed = -1 if frames < 0 else self.owed + frames

    def write(self, data: bytes) -> None:
        """Send an answer."""
        with self._lock:
            self._write(data)

    def _write(self, data: bytes) -> None:
        try:
            self.socket.settimeout(LAST_S)
            self.socket.sendall(data)
        except OSError:
            self.end()
        finally:
            self.socket.settimeout(LOOK_UP_S)

    def end(self) -> None:
        """It is gone: nothing waits for it."""
        self.owed, self.has_asked = 0, False
        self._waiting.clear()
        self.drained.set()
