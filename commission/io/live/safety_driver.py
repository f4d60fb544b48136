"""UDP data output of SICK safety scanners: the source `sick-safety`. It listens; nothing is ever sent to a scanner."""

from __future__ import annotations

from collections.abc import Iterator

from commission.io.live.driver import BaseDriver
from commission.io.protocols import safety
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

    def take(self, data: bytes, arrived_ns: int) -> Iterator[LiveMessage]:
        """Deliver the scan that a fragment completes, by the time of arrival: the scanner's clock jitters."""
        instance = self._reassembly.add(safety.decode_fragment(data))
        found = None if instance is None else safety.decode_instance(instance)
        if found is None:
            return
        if found.contamination_warning:
            self.told["scans came while the scanner warns of a dirty window"] += 1
        if found.glare.any():
            self.told["scans have beams that were blinded"] += 1
        # Every data set of a channel has a number of its own: what is missing between two was lost.
        yield LiveMessage(safety.scan_of(found, arrived_ns, scanner=self.scanner), sequence=found.sequence)
