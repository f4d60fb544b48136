"""The fields of frozen values by their dotted names: what is said about one, reading it, and setting it, checked.

A name is written as in files: `observation.range_sigma`, `scanner.mounting[2]`. It knows no particular value.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import inspect
import itertools
import re
import textwrap
import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, TypeVar

import numpy as np

from commission.errors import ProjectError, UsageError
from commission.site.quantity import LARGEST, Bounds, Choice, Description, Group, Quantity, Switch, Words

Value = TypeVar("Value")

_STEP = re.compile(r"(\w+)((?:\[\d+\])*)")


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldInfo:
    """What is known about one field, or about one number of it."""

    name: str
    """Its name, or `name[index]`."""
    kind: Any
    """Type of its value where there is one."""
    is_optional: bool
    """Whether it may be None."""
    descriptions: tuple[Description, ...]
    """What stands beside it: one for all its numbers, or one for each; none: nobody edits it alone."""
    hint: str
    """The string under the field in one line, without a unit."""

    @property
    def quantity(self) -> Quantity | None:
        """What its number is; None when it is no number."""
        return next((each for each in self.descriptions if isinstance(each, Quantity)), None)

    @property
    def label(self) -> str:
        """What people call it."""
        return self.descriptions[0].label if self.descriptions else self.name.replace("_", " ")

    @property
    def options(self) -> tuple[str, ...]:
        """The words of a choice."""
        choice = next((each for each in self.descriptions if isinstance(each, Choice)), None)
        if choice is None or choice.options:
            return choice.options if choice else ()
        return tuple(self.kind)

    @property
    def unit(self) -> str:
        """Unit in files, of several numbers `m, m, rad`; of a share or a ratio its bounds."""
        quantities = [each for each in self.descriptions if isinstance(each, Quantity)]
        units = [each.unit for each in quantities]
        if any(units):
            return units[0] if len(set(units)) == 1 else ", ".join(units)
        bounds = quantities[0].bounds if len(quantities) == 1 and self.kind is float else Bounds()
        is_ratio = bounds.high <= 1.0 or (bounds.low > 0.0 and bounds.high == LARGEST)
        return bounds.words() if is_ratio else ""

    @property
    def help(self) -> str:
        """The hint with the unit of files, for commands and messages."""
        return f"{self.hint.rstrip('.')} [{self.unit}]." if self.unit else self.hint


@functools.cache
def described(cls: type) -> tuple[tuple[str, tuple[Description, ...]], ...]:
    """Fields with what stands beside them; read without the hints, which need the source."""
    kinds = typing.get_type_hints(cls, include_extras=True)
    found = ((field.name, _descriptions(kinds[field.name])) for field in dataclasses.fields(typing.cast(Any, cls)))
    return tuple((name, descriptions) for name, descriptions in found if descriptions)


def _descriptions(kind: Any) -> tuple[Description, ...]:
    if typing.get_origin(kind) is not Annotated:
        return ()
    return tuple(each for each in kind.__metadata__ if isinstance(each, Quantity | Switch | Choice | Words | Group))


@functools.cache
def fields_of(cls: type) -> dict[str, FieldInfo]:
    """What is known about each field of a dataclass that its constructor takes, by name."""
    kinds, hints = typing.get_type_hints(cls, include_extras=True), _hints(cls)
    found: dict[str, FieldInfo] = {}
    for field in dataclasses.fields(typing.cast(Any, cls)):
        if field.init:
            kind, is_optional = _plain(kinds[field.name])
            found[field.name] = FieldInfo(
                name=field.name,
                kind=kind,
                is_optional=is_optional,
                descriptions=_descriptions(kinds[field.name]),
                hint=hints.get(field.name, ""),
            )
    return found


def _plain(kind: Any) -> tuple[Any, bool]:
    """Type without what stands beside it and without None, and whether it may be None."""
    if typing.get_origin(kind) is Annotated:
        kind = kind.__origin__
    if typing.get_origin(kind) not in (typing.Union, types.UnionType):
        return kind, False
    options = [option for option in typing.get_args(kind) if option is not types.NoneType]
    is_optional = len(options) < len(typing.get_args(kind))
    return (options[0] if len(options) == 1 else typing.Union[tuple(options)]), is_optional  # noqa: UP007


def field_hints(cls: type) -> dict[str, str]:
    """Help of each field of a dataclass by its name: the string under the field, with its unit."""
    return {name: info.help for name, info in fields_of(cls).items() if info.hint}


def _hints(cls: type) -> dict[str, str]:
    """Docstring under each field of a dataclass, by the field's name."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(cls)))
    body = next(node for node in tree.body if isinstance(node, ast.ClassDef)).body
    hints: dict[str, str] = {}
    for statement, following in itertools.pairwise(body):
        if (
            isinstance(statement, ast.AnnAssign)
            and isinstance(statement.target, ast.Name)
            and isinstance(following, ast.Expr)
            and isinstance(following.value, ast.Constant)
            and isinstance(following.value.value, str)
        ):
            hints[statement.target.id] = " ".join(following.value.value.split())
    return hints


def walk_fields(cls: type, prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """Dotted name and info of each field, those of dataclasses inside it instead of these themselves."""
    for name, info in fields_of(cls).items():
        if isinstance(info.kind, type) and dataclasses.is_dataclass(info.kind):
            yield from walk_fields(info.kind, f"{prefix}{name}.")
        else:
            yield prefix + name, info


def names_of(cls: type) -> tuple[str, ...]:
    """Names of all that the engineer edits in a value, in order; of what is described number by number each number."""
    return tuple(
        name if len(info.descriptions) == 1 else f"{name}[{index}]"
        for name, info in fields_of(cls).items()
        for index in range(len(info.descriptions))
    )


def field_info(value: object, name: str, what: str = "field") -> FieldInfo:
    """What is known about a field of a value.

    Parameters
    ----------
    value : a dataclass.
    name : dotted name of a field of it, or of one inside it.
    what : what the message calls a field: "parameter".

    Raises
    ------
    UsageError
        there is no such field; lists those there are.
    """
    return _found(value, name, what)[-1].info


def get_field(value: object, name: str, what: str = "field") -> Any:
    """Read a field of a value.

    Parameters
    ----------
    value : a dataclass.
    name : dotted name of a field of it, or of one inside it.
    what : what the message calls a field: "parameter".

    Raises
    ------
    UsageError
        there is no such field; lists those there are.
    """
    found = _found(value, name, what)[-1]
    content = getattr(found.holder, found.name)
    for index in found.indices:
        content = content[index]
    return content


def with_field(value: Value, name: str, new: object, what: str = "field") -> Value:
    """Return a value with one field changed.

    Parameters
    ----------
    value : a dataclass.
    name : dotted name of a field of it, or of one inside it.
    new : the field's new content, in the unit of code and files.
    what : what a message calls a field: "parameter".

    Raises
    ------
    UsageError
        there is no such field; lists those there are.
    ValueError
        the content has another type, or the value refuses it.
    """
    found = _found(value, name, what)
    last = found[-1]
    here = getattr(last.holder, last.name)
    if dataclasses.is_dataclass(here) and not dataclasses.is_dataclass(new):
        inner = ", ".join(f"{name}.{each}" for each in fields_of(type(here)))
        raise UsageError(f"no {what} is called {name!r}; expected one of: {inner}")
    changed: Any = _of_kind(new, last.info, name)
    for step in reversed(found):
        content = _with_element(getattr(step.holder, step.name), step.indices, changed) if step.indices else changed
        changes: dict[str, Any] = {step.name: content}
        changed = dataclasses.replace(typing.cast(Any, step.holder), **changes)
    return typing.cast(Value, changed)


@dataclass(frozen=True, slots=True)
class _Step:
    """One step of a dotted name."""

    holder: object
    name: str
    indices: tuple[int, ...]
    info: FieldInfo


def _found(value: object, name: str, what: str) -> list[_Step]:
    """Follow a dotted name from a value to its field."""
    steps: list[_Step] = []
    holder, way = value, ""
    for word in name.split("."):
        match = _STEP.fullmatch(word)
        known = fields_of(type(holder)) if dataclasses.is_dataclass(holder) else {}
        if match is None or match[1] not in known:
            expected = ", ".join(way + each for each in known) or f"a name like {way.rstrip('.')}"
            raise UsageError(f"no {what} is called {name!r}; expected one of: {expected}")
        indices = tuple(int(index) for index in re.findall(r"\d+", match[2]))
        content = getattr(holder, match[1])
        try:
            for index in indices:
                content = content[index]
        except (IndexError, TypeError):
            raise UsageError(f"no {what} is called {name!r}; {way}{match[1]} has no such element") from None
        steps.append(_Step(holder, match[1], indices, _of_element(known[match[1]], indices, content)))
        holder, way = content, f"{way}{word}."
    return steps


def _of_element(info: FieldInfo, indices: tuple[int, ...], content: object) -> FieldInfo:
    if not indices:
        return info
    own = info.descriptions if len(info.descriptions) <= 1 else info.descriptions[indices[0] : indices[0] + 1]
    name = info.name + "".join(f"[{index}]" for index in indices)
    kind = float if isinstance(content, float) else type(content)
    return dataclasses.replace(info, name=name, kind=kind, is_optional=False, descriptions=own)


def _with_element(content: Any, indices: tuple[int, ...], new: object) -> tuple[Any, ...]:
    """Return a list as a tuple, with one element changed."""
    elements = content.tolist() if isinstance(content, np.ndarray) else list(content)
    first, *inner = indices
    elements[first] = _with_element(elements[first], tuple(inner), new) if inner else new
    return tuple(elements)


def _of_kind(new: object, info: FieldInfo, name: str) -> Any:
    """Return a content of the type that the field has; raises ValueError that says what is expected."""
    if new is None and info.is_optional:
        return None
    expected = _expected_kind(new, info.kind)
    if expected:
        meaning = f" ({info.help.rstrip('.')})" if info.hint else ""
        raise ValueError(f"{name} is {new!r}; expected {expected}{meaning}")
    if info.kind in (int, float) or _is_enumeration(info.kind):
        return info.kind(typing.cast(Any, new))
    return new


def _expected_kind(new: object, kind: Any) -> str:
    """Words for the type that is expected; empty where the content has it, and for lists, which the value checks."""
    number = new if isinstance(new, int | float) and not isinstance(new, bool) else None
    if _is_enumeration(kind):
        return "" if new in list(kind) else f"one of: {', '.join(kind)}"
    fits, words = {
        bool: (isinstance(new, bool), "true or false"),
        int: (number is not None and float(number).is_integer(), "a whole number"),
        float: (number is not None, "a number"),
        str: (isinstance(new, str), "text"),
    }.get(kind, (True, ""))
    return "" if fits else words


def _is_enumeration(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, StrEnum)


def in_file(value: Value) -> Value:
    """Return a value with its numbers as files have them: no digits that nobody meant.

    Parameters
    ----------
    value : a dataclass; what is inside it is rounded as well.

    Returns
    -------
    rounded : each `Quantity` rounded by its own rule, the rest as it is. A value that would refuse its rounded numbers
        keeps them all. Rounding again changes nothing.
    """
    cls = type(value)
    beside = dict(described(cls))
    changes: dict[str, Any] = {}
    for field in dataclasses.fields(typing.cast(Any, value)):
        if not field.init:
            continue
        content = getattr(value, field.name)
        descriptions = beside.get(field.name, ())
        if descriptions and isinstance(descriptions[0], Quantity):
            rounded = _rounded(content, typing.cast("tuple[Quantity, ...]", descriptions))
        elif isinstance(content, tuple) and any(map(dataclasses.is_dataclass, content)):
            rounded = tuple(in_file(each) if dataclasses.is_dataclass(each) else each for each in content)
        else:
            rounded = in_file(content) if dataclasses.is_dataclass(content) else content
        if rounded is not content:
            changes[field.name] = rounded
    if not changes:
        return value
    try:
        return dataclasses.replace(typing.cast(Any, value), **changes)
    except (ValueError, ProjectError):
        return value


def _rounded(content: Any, quantities: tuple[Quantity, ...]) -> Any:
    if isinstance(content, np.ndarray):
        content = content.tolist()
    if isinstance(content, tuple | list):
        own = itertools.repeat(quantities) if len(quantities) == 1 else ((each,) for each in quantities)
        return tuple(_rounded(element, each) for element, each in zip(content, own, strict=False))
    return content if content is None else quantities[0].in_file(content)
