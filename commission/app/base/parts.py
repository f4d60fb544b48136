"""Values found by their type: how the state, a browser and the view hold the parts of features they do not know."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TypeAlias, TypeVar

Part = TypeVar("Part")

Parts: TypeAlias = Mapping[type, object]
"""At most one value of each type; never changed in place."""


@cache
def default_of(kind: type[Part]) -> Part:
    """Return the value that stands for a part nobody has set yet: always the same one."""
    return kind()


def part_of(parts: Parts, kind: type[Part]) -> Part:
    """Return the part of a type; its default where there is none."""
    part = parts.get(kind)
    return part if isinstance(part, kind) else default_of(kind)
