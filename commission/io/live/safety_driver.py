"""UDP data output of SICK safety scanners: the source `sick-safety`. It listens; nothing is ever sent to a scanner."""

from __future__ import annotations

from collections.abc import Iterator

from commission.io.live.driver import BaseDriver
from commission.io.protocols import safety
from commission.io.protocols.device_time import EvenTime
from commission.io.protocols.message import LiveMessage


class SafetyDriver(BaseDriver):
    """A microScan3, nanoScan3 or outdoorScan3.

    Parameters
    ----------
    scanners : names of the vehicle's scanners.
    scanner : which of them this is.
    """

    is_one_scanner = True

    def __init__(self, scanners: tuple[str, ...], scanner: int) -> None:
        super().__init__(scanners, scanner)
        self._reassembly = safety.Reassembly()
        self._even = EvenTime()

    def take(self, data: bytes, arrived_ns: int) -> Iterator[LiveMessage]:
        """Deliver the scan that a fragment completes; raises DecodeError."""
        instance = self._reassembly.add(safety.decode_fragment(data))
        found = None if instance is None else safety.decode_instance(instance)
        if found is None:
            return
        if found.contamination_warning:
            self.told["scans came while the scanner warns of a dirty window"] += 1
        if found.glare.any():
            self.told["scans have beams that were blinded"] += 1
        # Every data set of a channel has a number of its own: what is missing between two was lost.
        device_ns = None if found.time_ns is None else self._even.of(found.scan_number, found.time_ns)
        scan = safety.scan_of(found, arrived_ns, scanner=self.scanner)
        yield LiveMessage(scan, device_ns=device_ns, sequence=found.sequence)
