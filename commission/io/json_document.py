"""JSON written by other systems: limits before reading, and access that notes what is odd instead of giving up.

It knows no particular format. What cannot be used becomes a finding and counts as absent; text that holds a number is
taken for that number, since several exporters write numbers so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from commission.errors import FileFormatError
from commission.io.findings import Findings, shown
from commission.io.reading import read_text

SIZE_LIMIT = 32_000_000
"""Bytes of a document: a layout of about 50,000 edges. Python needs up to 30 times as much memory for it."""
LARGEST = 1e7
"""Largest number that is taken seriously: 10,000 km, or as many metres per second."""


@dataclass(frozen=True, slots=True)
class Fields:
    """One JSON object of a document."""

    path: Path
    """The file."""
    where: str
    """Which object this is, as a person would say it: "edge 'N1-N2'"; empty for the whole document."""
    values: dict[str, Any]
    """Its content; spaces around keys are gone."""
    found: Findings
    """Takes what is odd."""

    def number(self, key: str, *, least: float = -LARGEST) -> float | None:
        """Finite number from `least` to LARGEST; None when it is absent or, which is noted, something else."""
        value = self.values.get(key)
        if value is None:
            return None
        number = _number(value)
        if number is None or not least <= number <= LARGEST:
            bounds = "a number" if number is None else f"{least:g} to {LARGEST:g}"
            self.found.add(self.where, f"{key} is {shown(value)}; expected {bounds}")
            return None
        if isinstance(value, str):
            self.found.add(self.where, f"{key} is a number written as text")
        return number

    def numbers(self, key: str) -> list[float] | None:
        """List of finite numbers; None when it is absent or, which is noted, something else."""
        values = self.values.get(key)
        if values is None:
            return None
        numbers = [_number(value) for value in values] if isinstance(values, list) else [None]
        kept = [number for number in numbers if number is not None and abs(number) <= LARGEST]
        if len(kept) < len(numbers):
            self.found.add(self.where, f"{key} is not a list of numbers")
            return None
        if any(isinstance(value, str) for value in values):
            self.found.add(self.where, f"{key} holds numbers written as text")
        return kept

    def text(self, key: str) -> str:
        """Text without spaces around it; empty when it is absent or, which is noted, neither text nor number."""
        value = self.values.get(key)
        if value is None or isinstance(value, str):
            return (value or "").strip()
        if isinstance(value, int | float) and not isinstance(value, bool):
            return shown(value)
        self.found.add(self.where, f"{key} is {shown(value)}; expected text")
        return ""

    def mapping(self, key: str, where: str = "") -> Fields | None:
        """Object under a key; None when it is absent or, which is noted, something else."""
        value = self.values.get(key)
        if value is None:
            return None
        if not isinstance(value, dict):
            self.found.add(self.where, f"{key} is {shown(value)}; expected an object")
            return None
        return Fields(self.path, where or self.where, _stripped(value), self.found)

    def mappings(self, key: str, kind: str = "", name: str = "") -> Iterator[Fields]:
        """Objects in the list under a key; what else is in it is noted.

        Parameters
        ----------
        key : of the list.
        kind, name : notes about an object call it by this kind and the value of its key `name`.
        """
        values = self.values.get(key)
        if values is None:
            return
        if not isinstance(values, list):
            self.found.add(self.where, f"{key} is {shown(values)}; expected a list")
            return
        for index, value in enumerate(values, start=1):
            if isinstance(value, dict):
                content = _stripped(value)
                where = f"{kind} {shown(content.get(name) or index)}" if kind else self.where
                yield Fields(self.path, where, content, self.found)
            else:
                self.found.add(self.where, f"{key} holds {shown(value)}; expected objects")

    def require_list(self, key: str) -> None:
        """Raise FileFormatError unless a list is under the key: without it the file is of another format."""
        if not isinstance(self.values.get(key), list):
            problem = f"is {shown(self.values[key])}" if key in self.values else "is missing"
            raise FileFormatError(self.path, f"{self.where}, {key}".removeprefix(", "), problem, "a list")


def read_json(path: Path, found: Findings) -> Fields:
    """Read a document whose outermost value is an object.

    Raises
    ------
    FileFormatError
        it is too large, nested too deep, no JSON, or something else than an object.
    """
    text = read_text(path, SIZE_LIMIT)
    try:
        document = msgspec.json.decode(text)
    except (msgspec.DecodeError, ValueError) as error:
        raise FileFormatError(path, "", f"is no JSON ({error})", "a complete JSON document") from error
    except RecursionError as error:
        raise FileFormatError(path, "", "is nested too deep", "a JSON document of a few levels") from error
    if not isinstance(document, dict):
        raise FileFormatError(path, "", f"holds {shown(document)}", "a JSON object { ... }")
    return Fields(path, "", _stripped(document), found)


def _stripped(value: dict[str, Any]) -> dict[str, Any]:
    """Object with keys as they were meant: one official example has a space behind a key."""
    return {key.strip(): content for key, content in value.items()}


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    if isinstance(value, str) and (len(value) > 400 or "_" in value):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None
