"""Reading numbers from the bytes of a telegram, each within its bounds. It knows no protocol."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.errors import DecodeError


class Telegram:
    """A place in some bytes that moves on as they are read.

    Parameters
    ----------
    data : the telegram.
    place : where reading begins [bytes].
    order : `<` little-endian, `>` big-endian.
    """

    __slots__ = ("data", "order", "place")

    def __init__(self, data: bytes, place: int = 0, order: str = "<") -> None:
        self.data = data
        self.place = place
        self.order = order

    @property
    def left(self) -> int:
        """Bytes that are not read."""
        return len(self.data) - self.place

    def numbers(self, form: str) -> tuple[Any, ...]:
        """Read numbers of the forms that `struct` names; raises DecodeError where the bytes end before them."""
        size = struct.calcsize(self.order + form)
        if self.left < size:
            raise DecodeError(f"{max(self.left, 0)} bytes are left; expected {size}", self.place)
        found = struct.unpack_from(self.order + form, self.data, self.place)
        self.place += size
        return found

    def number(self, form: str) -> Any:
        """Read one number."""
        return self.numbers(form)[0]

    def array(self, kind: str, count: int) -> NDArray[Any]:
        """Read (count,) numbers of a numpy kind (`u2`); nothing is made room for before they are known to be there."""
        dtype = np.dtype(self.order + kind)
        if count < 0 or self.left < count * dtype.itemsize:
            found = f"{count} numbers of {dtype.itemsize} bytes are said, {max(self.left, 0)} bytes are left"
            raise DecodeError(f"{found}; expected as many as said", self.place)
        found = np.frombuffer(self.data, dtype, count, self.place)
        self.place += count * dtype.itemsize
        return found

    def text(self, length: int) -> str:
        """Read ASCII; raises DecodeError where it is none."""
        if length < 0 or self.left < length:
            raise DecodeError(f"a text of {length} bytes is said, {self.left} are left", self.place)
        raw = self.data[self.place : self.place + length]
        if not raw.isascii():
            raise DecodeError(f"{raw[:16]!r} is no ASCII", self.place)
        self.place += length
        return raw.decode("ascii").rstrip("\0")

    def skip(self, count: int) -> None:
        """Pass over some bytes."""
        if self.left < count:
            raise DecodeError(f"{max(self.left, 0)} bytes are left; expected {count}", self.place)
        self.place += count
