"""SICK NAV350 over TCP: the source `nav350`. It asks for results and changes neither mode nor layout."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from commission.errors import DecodeError
from commission.io.live.driver import BaseDriver
from commission.io.protocols import cola, nav350
from commission.io.protocols.cola_encoder import frame_binary
from commission.io.protocols.device_time import Counter32
from commission.io.protocols.message import LiveMessage
from commission.site.records import Detections

ASK_POSE = frame_binary(b"sMN mNPOSGetData \x01\x02")
"""The next result, with pose, reflectors and scan: what a device in navigation answers."""
ASK_LANDMARKS = frame_binary(b"sMN mNLMDGetData \x01\x02")
"""The same of a device that detects reflectors only."""
ASK_AGAIN_NS = 1_000_000_000
"""Time without an answer after which it is asked again [ns]."""
WRONG_MODE = 1
MILLISECOND = 1_000_000


class NavDriver(BaseDriver):
    """A NAV350: its scan, or where an answer holds none, the reflectors that it has found.

    Parameters
    ----------
    scanners : names of the vehicle's scanners.
    scanner : which of them this is.
    """

    is_one_scanner = True

    def __init__(self, scanners: tuple[str, ...], scanner: int) -> None:
        super().__init__(scanners, scanner)
        self._rest = b""
        self._counter = Counter32(MILLISECOND)
        self._request = ASK_POSE
        self._is_owed = True
        self._asked_ns: int | None = None

    def greeting(self) -> bytes:
        """Ask for the first result."""
        return self._request

    def take(self, data: bytes, arrived_ns: int) -> Iterator[LiveMessage]:
        """Deliver what an answer holds; raises DecodeError."""
        frames, self._rest = cola.split_frames(self._rest + data)
        for frame in frames:
            if not frame.startswith((b"sAN mNPOSGetData ", b"sAN mNLMDGetData ")):
                continue
            result = nav350.decode_nav(frame)
            # A device that answers with an error is asked again after a pause, like one that does not answer.
            self._is_owed = bool(result.error)
            yield from self._message(result, arrived_ns)

    def _message(self, result: nav350.NavResult, arrived_ns: int) -> Iterator[LiveMessage]:
        if result.error:
            if result.error == WRONG_MODE:
                self._request = ASK_LANDMARKS if self._request is ASK_POSE else ASK_POSE
            words = nav350.ERRORS[min(result.error, len(nav350.ERRORS) - 1)]
            raise DecodeError(f"the NAV350 says: {words}; expected one that navigates or detects reflectors", 0)
        scan = nav350.scan_of(result, arrived_ns, scanner=self.scanner)
        if scan is not None:
            yield LiveMessage(scan, device_ns=self._time(result.scan_stamp_ms, arrived_ns))
        elif len(result.range_bearing):
            # The device's 0 points to its cable side.
            turned = result.range_bearing - np.array([0.0, math.pi])
            found = Detections(arrived_ns, turned, self.scanner)
            yield LiveMessage(found, device_ns=self._time(result.pose_stamp_ms, arrived_ns))

    def _time(self, stamp_ms: int | None, arrived_ns: int) -> int | None:
        """Time by the device's clock [ns]; None where an answer says none."""
        return None if stamp_ms is None else self._counter.unwrapped(stamp_ms, arrived_ns)

    def reply(self, now_ns: int) -> bytes:
        """Ask for the next result, once the one before has come, or nothing has for a second."""
        if self._asked_ns is None:
            self._asked_ns = now_ns
        if self._is_owed and now_ns - self._asked_ns < ASK_AGAIN_NS:
            return b""
        self._is_owed, self._asked_ns = True, now_ns
        return self._request
