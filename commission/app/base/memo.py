"""A value that stays the very same while what it is made from does, so that whoever draws it can tell by identity."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from commission.studies.inputs import is_same

Value = TypeVar("Value")


class Memo(Generic[Value]):
    """The newest value and what it was made from."""

    def __init__(self) -> None:
        self._key: tuple[object, ...] | None = None
        self._value: Value | None = None

    def of(self, key: tuple[object, ...], make: Callable[[], Value | None]) -> Value | None:
        """Return the value for a key; it is made anew only where the key is another one than last time."""
        if self._key is None or not is_same(self._key, key):
            self._key, self._value = key, make()
        return self._value
