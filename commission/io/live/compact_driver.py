"""SICK Compact format over UDP (picoScan, multiScan): the source `compact`. It listens."""

from __future__ import annotations

from commission.io.live.driver import ScannerDriver
from commission.io.protocols.assembly import CompactAssembly


class CompactDriver(ScannerDriver):
    """A picoScan or multiScan; of several layers the one that is nearest to level."""

    assembly = CompactAssembly
