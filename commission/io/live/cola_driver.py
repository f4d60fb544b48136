"""SICK CoLa B over TCP (TiM, LMS, LRS, MRS): the source `cola`. It subscribes to scans and changes nothing else."""

from __future__ import annotations

import struct
from functools import reduce
from operator import xor

from commission.io.live.driver import ScannerDriver
from commission.io.protocols.assembly import ColaAssembly

SUBSCRIBE = b"sEN LMDscandata 1"


class ColaDriver(ScannerDriver):
    """A scanner that sends LMDscandata when it is asked to."""

    assembly = ColaAssembly

    def greeting(self) -> bytes:
        """Ask for scans."""
        content = SUBSCRIBE[:-1] + b"\x01"
        return b"\x02\x02\x02\x02" + struct.pack(">I", len(content)) + content + bytes([reduce(xor, content, 0)])
