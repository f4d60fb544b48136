"""Fields of many messages of ROS 2 at once, from the bytes of a chunk (CDR, little-endian). It knows no file.

Decoding message by message takes 50 microseconds each, which is a minute for hours of scans; gathering takes two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray
from commission.io.recordings.cdr import ENCAPSULATION, SECOND

MESSAGE_HEAD = 9 + 22
"""Bytes of a record of MCAP before the message."""


@dataclass(frozen=True, slots=True, eq=False)
class CdrColumns:
    """Messages of one type in one chunk."""

    content: NDArray[np.uint8]
    """Bytes of the chunk."""
    begins: IntArray
    """(N,) where the fields of each message begin: behind what says the encoding."""
    ends: IntArray
    """(N,) where each message ends."""

    @staticmethod
    def of(content: bytes, offsets: NDArray[np.int32], channel: int) -> CdrColumns:
        """Return the messages of a channel.

        Parameters
        ----------
        content : of a chunk.
        offsets : (N,) where their records begin.
        channel : its number.

        Raises
        ------
        ValueError
            there is no such message at an offset, or it is of another encoding than little-endian.
        """
        data = np.frombuffer(content, np.uint8)
        records = offsets.astype(np.int64)
        whole = CdrColumns(data, records, np.full(len(records), len(data), np.int64))
        lengths = whole.numbers(records + 1, "<u8").astype(np.int64)
        is_message = (data[records] == 0x05) & (whole.numbers(records + 9, "<u2") == channel)
        ends = records + 9 + lengths
        if not (is_message & (lengths >= 22 + len(ENCAPSULATION)) & (ends <= len(data))).all():
            raise ValueError("its index tells of a message where there is none")
        encodings = whole.numbers(records + MESSAGE_HEAD, "<u4")
        if (encodings & 0xFFFF != 0x0100).any():
            raise ValueError("a message is not in plain little-endian CDR")
        return CdrColumns(data, records + MESSAGE_HEAD + len(ENCAPSULATION), ends)

    def numbers(self, places: IntArray, kind: str) -> NDArray[Any]:
        """(N,) a number at a place of each message; raises ValueError where a message ends before it."""
        return self.rows(places, kind, 1)[:, 0]

    def rows(self, places: IntArray, kind: str, count: int) -> NDArray[Any]:
        """Numbers that follow each other.

        Parameters
        ----------
        places : (N,) where the first one of each message stands.
        kind, count : their type, as numpy has it, and how many they are.

        Returns
        -------
        numbers : (N, count).

        Raises
        ------
        ValueError
            a message ends before them.
        """
        size = np.dtype(kind).itemsize * count
        if (places + size > self.ends).any() or (places < 0).any():
            raise ValueError("a message ends before its last field")
        return self.content[places[:, np.newaxis] + np.arange(size)].view(kind)

    def stamps_ns(self) -> IntArray:
        """(N,) stamps of the headers [ns]."""
        seconds, nanoseconds = self.numbers(self.begins, "<i4"), self.numbers(self.begins + 4, "<u4")
        return seconds.astype(np.int64) * SECOND + nanoseconds

    def log_times_ns(self) -> IntArray:
        """(N,) when the messages were recorded [ns]."""
        return self.numbers(self.begins - len(ENCAPSULATION) - 16, "<u8").astype(np.int64)

    def after_header(self, align: int) -> IntArray:
        """(N,) where the field behind the header begins, which stands at a multiple of a size."""
        return self.after_text(self.begins + 8, align)

    def after_text(self, places: IntArray, align: int) -> IntArray:
        """(N,) where the field behind a text begins, which stands at a multiple of a size."""
        return self.aligned(places + 4 + self.numbers(places, "<u4"), align)

    def aligned(self, places: IntArray, align: int) -> IntArray:
        """(N,) the first places that are a multiple of a size."""
        return places + (self.begins - places) % align

    def arrays(self, places: IntArray, size: int) -> tuple[IntArray, IntArray]:
        """Lengths of arrays, and where their first element begins; ValueError where a message ends before the last one.

        Parameters
        ----------
        places : (N,) where their lengths stand.
        size : bytes of an element.
        """
        counts = self.numbers(places, "<u4").astype(np.int64)
        firsts = np.where(counts > 0, self.aligned(places + 4, size), places + 4)
        if (firsts + counts * size > self.ends).any():
            raise ValueError("a message ends within an array")
        return counts, firsts

    def gathered(self, firsts: IntArray, counts: IntArray) -> FloatArray:
        """(sum of counts,) doubles of arrays whose places were checked, one array after the other."""
        before = np.repeat(np.cumsum(counts) - counts, counts)
        places = np.repeat(firsts, counts) + 8 * (np.arange(int(counts.sum())) - before)
        return self.content[places[:, np.newaxis] + np.arange(8)].view("<f8")[:, 0]
