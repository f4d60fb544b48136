"""Checked, read-only arrays for the frozen values of the project. Not a numerics module: it only guards shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Scalar = TypeVar("Scalar", bound=np.generic)


def read_only(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """Return a read-only contiguous view (a copy where it is not contiguous); the given array stays as it is.

    Kernels take their inputs in this form: to the compiler a writable array is another type, compiled anew.
    """
    view = np.ascontiguousarray(array).view()
    view.setflags(write=False)
    return view


class Growing(Generic[Scalar]):
    """Rows that come in blocks, gathered where they will stay.

    `numpy.concatenate` needs every row twice while it runs, and leaves the blocks as holes in the memory.

    Parameters
    ----------
    dtype : of the numbers.
    width : numbers in a row; 0: a row is one number.
    """

    def __init__(self, dtype: type[Scalar], width: int = 0) -> None:
        self._dtype, self._shape = np.dtype(dtype), (-1, width) if width else (-1,)
        # It grows by an eighth in place: the system moves its pages, not their contents.
        self._bytes = bytearray()

    def append(self, rows: NDArray[Scalar]) -> None:
        """Append some rows; numbers of another type are converted."""
        self._bytes += np.ascontiguousarray(rows, dtype=self._dtype).tobytes()

    def array(self) -> NDArray[Scalar]:
        """Return all rows, read-only and without a copy; nothing may be appended any more."""
        array: NDArray[Scalar] = np.frombuffer(self._bytes, self._dtype).reshape(self._shape)
        array.setflags(write=False)
        return array


def frozen(values: ArrayLike, shape: Sequence[int | None], name: str, *, finite: bool = True) -> FloatArray:
    """Return a read-only float64 copy of `values` after checking its shape.

    Parameters
    ----------
    values : anything that numpy turns into an array.
    shape : expected length of each axis; None accepts any length.
    name : how the array is called in the message.
    finite : whether NaN and infinity are errors.

    Raises
    ------
    ValueError
        says the shape (or the non-finite element) found and what is expected.
    """
    array = np.array(values, dtype=np.float64)
    expected = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
    if array.size == 0 and shape and shape[0] is None:
        array = array.reshape((0, *(n or 0 for n in shape[1:])))
    if array.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, array.shape, strict=True)):
        raise ValueError(f"{name} has shape {array.shape}; expected {expected}")
    if finite and not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name}{list(index)} is {array[index]}; expected finite numbers")
    array.setflags(write=False)
    return array


def equal_fields(first: Any, second: object) -> bool:
    """Whether two dataclass values are of one type and equal field by field, arrays element by element."""
    if first.__class__ is not second.__class__:
        return False
    pairs = ((getattr(first, f.name), getattr(second, f.name)) for f in fields(first) if f.compare)
    return all(
        np.array_equal(a, b) if isinstance(a, np.ndarray) or isinstance(b, np.ndarray) else a == b for a, b in pairs
    )
