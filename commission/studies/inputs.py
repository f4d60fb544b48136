"""What a study may read: frozen inputs that are themselves the keys of what was computed from them.

An input holds parts of a project and plain settings, never the project: what a study has forgotten to ask for is an
`AttributeError`, and not a picture that stays when it should have changed.
"""

from __future__ import annotations

import dataclasses
from typing import Any


class StudyInput:
    """Base of the frozen inputs: equal where all fields are the same.

    Plain values are compared by value, and so are tuples and dataclasses of them. Arrays, and what compares its arrays
    element by element (a floor map, a segment, a scanner), are compared by identity: an edit makes a new one, and
    millions of cells are not looked at in every picture.
    """

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        """Whether a study of the other input would read the same."""
        return is_same(self, other)

    def __hash__(self) -> int:
        """Equal inputs have one hash."""
        return _hash_of(self)


def is_same(one: object, other: object) -> bool:
    """Whether two values count as the same for a study; as for `StudyInput`."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(is_same, one, other))
    if _is_compared_by_field(one):
        return all(is_same(getattr(one, name), getattr(other, name)) for name in _fields(one))
    return isinstance(one, bool | int | float | str) and one == other


def _hash_of(value: object) -> int:
    if isinstance(value, tuple):
        return hash(tuple(map(_hash_of, value)))
    if _is_compared_by_field(value):
        return hash((type(value), *(_hash_of(getattr(value, name)) for name in _fields(value))))
    return hash(value) if isinstance(value, bool | int | float | str) else id(value)


def _is_compared_by_field(value: Any) -> bool:
    """Whether a value is an input, or a dataclass that has not said itself how it compares."""
    return isinstance(value, StudyInput) or (
        dataclasses.is_dataclass(value) and getattr(type(value), "__dataclass_params__").eq  # noqa: B009
    )


def _fields(value: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(value) if field.compare]
