"""Records that a capture holds as messages: plain JSON over UDP, and what a rosbridge publishes to its clients.

Every port that is sent to is one program's, whatever ports it sends from. Both formats are those of `io.protocols`.
"""

from __future__ import annotations

import struct
from collections import Counter, OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from commission.errors import DecodeError
from commission.io.protocols.json_records import decode_message, named_scanner
from commission.io.protocols.message import LiveMessage
from commission.io.protocols.rosbridge import MESSAGE_LIMIT, decode_publication, decode_record
from commission.io.recordings.pcap import Payload

JSON, ROSBRIDGE = "JSON", "rosbridge"
_UPGRADED = b"HTTP/1.1 101"
_TEXT, _BINARY, _CONTINUED, _CONTROL = 1, 2, 0, 8
_STREAMS = 32
"""Streams that are looked through at once."""
_HEAD_LIMIT = 16_384
"""Bytes of the answer of a server that begins a connection."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """A message, and who sent it."""

    program: str
    """Its address: where JSON is sent to, where a rosbridge is."""
    kind: str
    """JSON or rosbridge."""
    topic: str
    """What it was published on; empty of JSON."""
    scanner: str
    """Name of the scanner that the message names; empty where it names none, or is of none."""
    message: LiveMessage
    """What it says; a scan has the index 0."""
    captured_ns: int
    """When it was captured [ns]."""


class Messages:
    """Finds messages in what was sent, payload by payload.

    Parameters
    ----------
    told : takes what cannot be decoded, and how often.
    """

    def __init__(self, told: Counter[str]) -> None:
        self._told = told
        self._streams: OrderedDict[tuple[str, str], _WebSocket] = OrderedDict()

    def take(self, payload: Payload) -> Iterator[Heard]:
        """Deliver the messages that a payload completes; nothing of other protocols."""
        if not payload.is_stream:
            found = _of_datagram(payload, self._told)
            if found is not None:
                yield found
            return
        flow = payload.sender, payload.receiver
        stream = self._streams.pop(flow, None) or _WebSocket()
        self._streams[flow] = stream
        if len(self._streams) > _STREAMS:
            self._streams.popitem(last=False)
        for frame in stream.take(payload.data):
            found = _of_frame(payload, frame, self._told)
            if found is not None:
                yield found


def _of_datagram(payload: Payload, told: Counter[str]) -> Heard | None:
    """Return the message of a datagram; None where it is none."""
    if payload.data[:1] != b"{":
        return None
    scanner = named_scanner(payload.data)
    if scanner is None:
        return None
    try:
        message = decode_message(payload.data, (scanner,))
    except DecodeError as error:
        told[f"messages to {payload.receiver} cannot be decoded and are left out ({error})"] += 1
        return None
    return Heard(
        program=payload.receiver, kind=JSON, topic="", scanner=scanner, message=message, captured_ns=payload.stamp_ns
    )


def _of_frame(payload: Payload, frame: bytes, told: Counter[str]) -> Heard | None:
    """Return the message of a frame of a rosbridge; None where it is none that is read."""
    try:
        found = decode_publication(frame)
        if found is None or not _is_read(found[1]):
            return None
        topic, content = found
        scans = {topic: 0} if "ranges" in content else {}
        message = decode_record(topic, content, scans)
    except DecodeError as error:
        told[f"messages of {payload.sender} cannot be decoded and are left out ({error})"] += 1
        return None
    name = topic.strip("/").rpartition("/")[0].rpartition("/")[2] if scans else ""
    if message is None:
        return None
    return Heard(
        program=payload.sender,
        kind=ROSBRIDGE,
        topic=topic,
        scanner=name,
        message=message,
        captured_ns=payload.stamp_ns,
    )


def _is_read(content: Mapping[str, Any]) -> bool:
    """Whether a publication is a LaserScan, an Odometry or a PoseStamped by its fields."""
    return "header" in content and ("ranges" in content or isinstance(content.get("pose"), dict))


class _WebSocket:
    """Frames of what a server sends by WebSocket (RFC 6455); of a connection that began before the capture, too."""

    def __init__(self) -> None:
        self._rest, self._message = b"", b""
        self._is_in_step = False

    def take(self, data: bytes) -> Iterator[bytes]:
        """Deliver the messages that some bytes complete."""
        self._rest += data
        if not self._is_in_step and not self._begins(data):
            return
        while (head := self._head()) is not None:
            begin, end, first = head
            if len(self._rest) < end:
                return
            content, self._rest = self._rest[begin:end], self._rest[end:]
            if first & 15 >= _CONTROL:
                continue
            self._message = content if first & 15 else self._message + content
            if first & 0x80:
                whole, self._message = self._message, b""
                yield whole

    def _begins(self, data: bytes) -> bool:
        """Come into step where a server answers, or a payload is the begin of a frame; returns whether it does."""
        at = self._rest.find(b"\r\n\r\n")
        if self._rest.startswith(_UPGRADED):
            self._is_in_step = at >= 0
            self._rest = self._rest[at + 4 :] if at >= 0 else self._rest[:_HEAD_LIMIT]
        else:
            # The first bytes of a message of rosbridge: an object, as text or as CBOR.
            begin = {0x7E: 4, 0x7F: 10}.get(data[1] if len(data) > 1 else 0, 2)
            text = data[:1] == b"\x81" and data[begin : begin + 1] == b"{"
            binary = data[:1] == b"\x82" and len(data) > begin and 0xA0 <= data[begin] <= 0xBF
            self._is_in_step = text or binary
            self._rest = data if self._is_in_step else b""
        return self._is_in_step

    def _head(self) -> tuple[int, int, int] | None:
        """Begin and end of the first frame, and its first byte; None where it is not there, or out of step."""
        if len(self._rest) < 2:
            return None
        first, second = self._rest[:2]
        begin, size = 2, second & 0x7F
        if size >= 0x7E:
            form, begin = (">H", 4) if size == 0x7E else (">Q", 10)
            if len(self._rest) < begin:
                return None
            size = struct.unpack_from(form, self._rest, 2)[0]
        # A server masks nothing; what is packed, or longer than can be, is none of ours, or a part was not captured.
        known = first & 15 in (_CONTINUED, _TEXT, _BINARY, 8, 9, 10)
        if first & 0x70 or second & 0x80 or not known or size + len(self._message) > MESSAGE_LIMIT:
            self._rest, self._message, self._is_in_step = b"", b"", False
            return None
        return begin, begin + size, first
