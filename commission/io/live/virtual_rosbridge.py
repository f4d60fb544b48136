"""A virtual ROS 2 vehicle: a small rosbridge server that publishes a drive."""

from __future__ import annotations

import json
import threading
from types import TracebackType
from typing import Any, ClassVar, Self

from websockets.exceptions import WebSocketException
from websockets.sync.server import Server, ServerConnection, serve

from commission.io.live.registry import SourceAddress
from commission.io.live.stream_device import FIRST_CLIENT_S
from commission.io.protocols.message import Sent
from commission.io.protocols.rosbridge import encode_publication, published
from commission.io.recordings.recorder import scanner_topics
from commission.site.records import ReferencePose, Scan


class VirtualRosVehicle:
    """Publishes scans, poses of odometry and true poses; opening it waits until somebody subscribes.

    Parameters
    ----------
    address : of the server.
    scanners : names of the vehicle's scanners.
    """

    sends_all: ClassVar[bool] = True

    def __init__(self, address: SourceAddress, scanners: tuple[str, ...]) -> None:
        self.address, self._topics = address, scanner_topics(scanners)
        self._asked: dict[ServerConnection, dict[str, bool]] = {}
        self._lock = threading.Lock()
        self._heard = threading.Event()
        self._server: Server | None = None

    def __enter__(self) -> Self:
        self._server = serve(self._listen, self.address.host, self.address.port, compression=None)
        threading.Thread(target=self._server.serve_forever, name="virtual rosbridge", daemon=True).start()
        self._heard.wait(FIRST_CLIENT_S)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            clients = tuple(self._asked)
        for client in clients:
            client.close()
        if self._server is not None:
            self._server.shutdown()

    def topic(self, record: Sent) -> str:
        """Return the topic that a record is published on."""
        if isinstance(record, Scan):
            return self._topics[record.scanner]
        return "/reference" if isinstance(record, ReferencePose) else "/odom"

    def pieces(self, record: Sent) -> list[bytes]:
        """Return the publication of a record; nothing of one that ROS has no type for."""
        return [encode_publication(self.topic(record), record, is_cbor=True)] if published(record) else []

    def send(self, record: Sent) -> None:
        """Publish a record to those who have subscribed, each in its form."""
        if not published(record):
            return
        topic = self.topic(record)
        with self._lock:
            clients = [(client, asked[topic]) for client, asked in self._asked.items() if topic in asked]
        for client, is_cbor in clients:
            data = encode_publication(topic, record, is_cbor=is_cbor)
            try:
                client.send(data if is_cbor else data.decode())
            except WebSocketException:
                continue

    def _listen(self, client: ServerConnection) -> None:
        """Take the requests of one client until it is gone."""
        asked: dict[str, bool] = {}
        with self._lock:
            self._asked[client] = asked
        try:
            for text in client:
                request: Any = json.loads(text)
                if request.get("op") == "subscribe":
                    with self._lock:
                        asked[str(request["topic"])] = request.get("compression") == "cbor"
                    if {"/odom", *self._topics} <= asked.keys():
                        self._heard.set()
        except (WebSocketException, ValueError):
            pass
        finally:
            with self._lock:
                self._asked.pop(client, None)
