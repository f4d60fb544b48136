"""Every live source with the bytes that its device sends of some scans: made by the virtual device."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from commission.io.live.clocks import HostClock
from commission.io.live.connection import Arrival, Connection
from commission.io.live.driver import Driver
from commission.io.live.registry import KINDS, SourceAddress, device_of, driver_of
from commission.io.live.session import connection_of
from commission.site.records import Record, Scan

NAMES = ("scanner",)
PERIOD_NS = 40_000_000
ALL = tuple(name for name, kind in KINDS.items() if kind.virtual is not None)


def scan(number: int, beams: int = 541) -> Scan:
    """A scan that no other one is like: what beam 0 measures tells its number."""
    ranges = np.linspace(1.0, 9.0, beams).astype(np.float32)
    ranges[0] = 1.0 + number * 0.01
    ranges[7] = np.nan
    flags = np.zeros(beams, np.bool_)
    flags[100:104] = True
    return Scan(
        stamp_ns=10**9 + number * PERIOD_NS,
        ranges=ranges,
        angle_min=-2.356,
        angle_increment=4.712 / (beams - 1),
        reflector=flags,
    )


def numbers_of(records: Sequence[Record]) -> list[int]:
    """Numbers of scans; one whose first beam met nothing has none."""
    firsts = [float(record.ranges[0]) for record in records if isinstance(record, Scan)]
    return [round((first - 1.0) / 0.01) for first in firsts if np.isfinite(first)]


@dataclass
class Sending:
    """A virtual device whose pieces a test takes."""

    name: str

    def __post_init__(self) -> None:
        self.address = SourceAddress(self.name, "127.0.0.1", 0)
        self.device = device_of(self.address, NAMES)

    def driver(self) -> Driver:
        return driver_of(self.address, NAMES)()

    def pieces(self, numbers: Sequence[int]) -> list[list[bytes]]:
        """What is sent of each scan."""
        return [self.device.pieces(scan(number)) for number in numbers]


class Listening:
    """A connection, and what it delivered."""

    def __init__(self, name: str, port: int = 0) -> None:
        self.clock = HostClock()
        self.arrivals: list[Arrival] = []
        self.connection: Connection = connection_of(SourceAddress(name, "127.0.0.1", port), NAMES, self.clock)

    def __enter__(self) -> Listening:
        self.connection.start(self._take)
        return self

    def __exit__(self, *_: object) -> None:
        self.connection.stop()

    def _take(self, arrival: Arrival) -> bool:
        self.arrivals.append(arrival)
        return True

    @property
    def numbers(self) -> list[int]:
        return numbers_of([arrival.record for arrival in self.arrivals])  # type: ignore[misc]


def until(holds: Callable[[], bool], seconds: float = 10.0) -> bool:
    """Wait until something holds; whether it does."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if holds():
            return True
        time.sleep(0.005)
    return holds()
