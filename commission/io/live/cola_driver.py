"""SICK CoLa over TCP (TiM, LMS, LRS, MRS): the source `cola`. It subscribes to scans and changes nothing else."""

from __future__ import annotations

from commission.io.live.driver import ScannerDriver
from commission.io.protocols.assembly import ColaAssembly
from commission.io.protocols.cola_encoder import frame_binary, frame_text

ASK = frame_binary(b"sEN LMDscandata \x01"), frame_text(b"sEN LMDscandata 1")
"""The subscription in CoLa B and in CoLa A: a device understands the one that it is set to."""
ASK_AGAIN_NS = 1_000_000_000
"""Time without an answer after which it is asked in the other dialect [ns]."""


class ColaDriver(ScannerDriver):
    """A scanner that sends LMDscandata when it is asked to."""

    assembly = ColaAssembly
    _asked = 0
    _asked_ns: int | None = None

    def greeting(self) -> bytes:
        """Ask for scans in CoLa B."""
        return ASK[0]

    def reply(self, now_ns: int) -> bytes:
        """Ask in the other dialect while nothing has been answered."""
        if self._asked_ns is None:
            self._asked_ns = now_ns
        # Only an answer counts: noise, or the refusal of the other dialect, is none.
        if self._assembly.answers or now_ns - self._asked_ns < ASK_AGAIN_NS:
            return b""
        self._asked, self._asked_ns = 1 - self._asked, now_ns
        return ASK[self._asked]
