"""Messages of ROS 2 as bytes (CDR, little-endian), written field by field. It knows the encoding, no type.

OMG DDS-XTypes 1.3, 7.4: plain CDR version 1; a number stands at a multiple of its size, counted from behind the
four bytes that say the encoding.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

ENCAPSULATION = b"\x00\x01\x00\x00"
"""Little-endian, version 1, no options."""
SECOND = 1_000_000_000
_SECONDS_LIMIT = 2**31


class CdrWriter:
    """One message, from its first field to its last."""

    def __init__(self) -> None:
        self._data = bytearray(ENCAPSULATION)

    def numbers(self, kinds: str, *values: float) -> CdrWriter:
        """Append numbers of one size; `kinds` as `struct` has them, each for one value."""
        self._align(struct.calcsize(f"<{kinds[0]}"))
        self._data += struct.pack(f"<{kinds}", *values)
        return self

    def text(self, text: str) -> CdrWriter:
        """Append a text with its length before it, and a zero behind it."""
        data = text.encode("utf-8") + b"\0"
        self._align(4)
        self._data += struct.pack("<I", len(data)) + data
        return self

    def array(self, values: NDArray[np.generic]) -> CdrWriter:
        """Append an array with its length before it, as its type is."""
        self.numbers("I", len(values))
        if len(values):
            self._align(values.dtype.itemsize)
            self._data += values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()
        return self

    def doubles(self, values: NDArray[np.float64]) -> CdrWriter:
        """Append an array of fixed length."""
        self._align(8)
        self._data += values.astype("<f8", copy=False).tobytes()
        return self

    def header(self, stamp_ns: int, frame: str) -> CdrWriter:
        """Append a `std_msgs/Header`.

        Parameters
        ----------
        stamp_ns : time [ns].
        frame : name of the frame.

        Raises
        ------
        ValueError
            the time does not fit into the 32 bits of seconds that a header has.
        """
        seconds, nanoseconds = divmod(stamp_ns, SECOND)
        if not -_SECONDS_LIMIT <= seconds < _SECONDS_LIMIT:
            raise ValueError(f"stamp is {stamp_ns} ns; expected one within 68 years of 1970, as ROS has them")
        return self.numbers("iI", seconds, nanoseconds).text(frame)

    def message(self) -> bytes:
        """Return the bytes."""
        return bytes(self._data)

    def _align(self, size: int) -> None:
        self._data += bytes(-(len(self._data) - len(ENCAPSULATION)) % size)
