"""A virtual vehicle on the network: a drive's records sent at their times, scans by a scanner's own protocol."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import chain

import numpy as np

from commission.errors import UsageError
from commission.geometry import se2
from commission.io.live.registry import LAST_PORT, LOCAL, SourceAddress, device_of
from commission.io.live.virtual_device import VirtualDevice
from commission.io.protocols.message import OdometryPose, Sent
from commission.site.records import Odometry, Record, Scan

ODOMETRY = "json"
"""Protocol of what a scanner does not say."""
LONGEST_WAIT_S = 0.1
READY_NS = 500_000_000
"""Time of a drive that is ready before the first record is sent [ns]."""


@dataclass(frozen=True, slots=True)
class Sending:
    """What was sent."""

    records: int
    """Records."""
    scans: int
    """Scans among them."""
    seconds: float
    """Time by the drive's clock [s]."""


def addresses_of(address: SourceAddress, scanners: Sequence[str], beside: SourceAddress | None) -> list[SourceAddress]:
    """Return the addresses of all devices of a virtual vehicle, the scanners' first.

    Parameters
    ----------
    address : protocol and address of the first scanner; further ones have the next ports.
    scanners : names of the vehicle's scanners.
    beside : where odometry goes, where the protocol says none; None: JSON to its usual port.

    Raises
    ------
    UsageError
        a port is beyond the last one.
    """
    if device_of(address, tuple(scanners)).sends_all:
        return [address]
    several = len(scanners) > 1
    found = [
        SourceAddress(address.name, address.host, address.port + index, name if several else None)
        for index, name in enumerate(scanners)
    ]
    if found[-1].port > LAST_PORT:
        raise UsageError(f"--address ends at port {found[-1].port}; expected one whose {len(found)} ports exist")
    is_datagram = address.kind.transport == "udp"
    return [*found, beside or SourceAddress(ODOMETRY, address.host if is_datagram else LOCAL, 6061)]


def send_drive(
    records: Iterable[Record],
    addresses: Sequence[SourceAddress],
    scanners: tuple[str, ...],
    *,
    speed: float = 1.0,
    stopped: Callable[[], bool] = lambda: False,
    clock: Callable[[], float] = time.monotonic,
) -> Sending:
    """Send a drive over the network.

    Parameters
    ----------
    records : in order of their stamps.
    addresses : of the devices, by `addresses_of`.
    scanners : names of the vehicle's scanners.
    speed : 1 is real time; of a faster one, whoever listens sees a faster vehicle.
    stopped : asked before each record.
    clock : returns seconds.

    Raises
    ------
    OSError
        an address cannot be sent to.
    """
    if not 0.0 < speed < math.inf:
        raise UsageError(f"--speed is {speed:g}; expected more than 0")
    rest = threading.Event()
    scans = count = 0
    first_ns = last_ns = 0
    pose = np.zeros(3)
    with ExitStack() as stack:
        devices: list[VirtualDevice] = [stack.enter_context(device_of(address, scanners)) for address in addresses]
        everything = devices[-1]
        drive = _begun(records)
        begin = clock()
        for record in drive:
            if not count:
                first_ns = record.stamp_ns
            due = begin + (record.stamp_ns - first_ns) * 1e-9 / speed
            while (wait := due - clock()) > 0.0 and not stopped():
                rest.wait(min(wait, LONGEST_WAIT_S))
            if stopped():
                break
            sent: Sent = record
            if isinstance(record, Odometry):
                # A pose that is lost costs nothing, a displacement would.
                pose = se2.compose(pose, record.displacement)
                sent = OdometryPose(record.stamp_ns, pose)
            is_scan = isinstance(record, Scan)
            (devices[record.scanner] if is_scan and len(devices) > 1 else everything).send(sent)
            scans, count, last_ns = scans + is_scan, count + 1, record.stamp_ns
    return Sending(count, scans, (last_ns - first_ns) * 1e-9)


def _begun(records: Iterable[Record]) -> Iterator[Record]:
    """Have the first moment of a drive ready.

    What makes it loads compiled code for a second and more, in which the vehicle would stand still, and then rush on.
    """
    drive, ready = iter(records), list[Record]()
    for record in drive:
        ready.append(record)
        if record.stamp_ns - ready[0].stamp_ns > READY_NS:
            break
    return chain(ready, drive)
