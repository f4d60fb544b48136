"""Checked conversion of parsed YAML into the project's values: msgspec converts, this module explains what is wrong.

An error names the line, the full key, what was found, what is expected, and what the key means (the docstring of its
field). It knows no particular file.
"""

from __future__ import annotations

import dataclasses
import functools
import re
import types
import typing
from enum import StrEnum
from typing import Any, TypeVar

import msgspec
import numpy as np

from commission.errors import CommissionError, FileFormatError
from commission.io.yaml_document import KeyPath, YamlDocument
from commission.site.fields import field_hints

Value = TypeVar("Value")

_NAMES = {
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "str": "text",
    "array": "a list",
    "object": "a mapping (key: value)",
    "null": "nothing",
}
_PLACE = re.compile(r"^(?P<text>.*?)(?: - at `(?P<key>[^`]*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")
_EXPECTED = re.compile(r"^Expected (?P<expected>.*?)(?:, got (?P<got>.*))?$", re.DOTALL)


def convert(document: YamlDocument, cls: type[Value], key_path: KeyPath = (), *, ignore_unknown: bool = False) -> Value:
    """Convert a part of a document into a frozen dataclass.

    Parameters
    ----------
    document : parsed file.
    cls : dataclass whose fields are the keys.
    key_path : place of the part in the document; the whole of it when empty.
    ignore_unknown : whether keys that the dataclass does not have are passed over instead of refused.

    Raises
    ------
    FileFormatError
        unknown or missing key, wrong type, or a value that the dataclass refuses.
    """
    part = document.value
    for step in key_path:
        part = part[step]
    part = {} if part is None else part
    if not isinstance(part, dict):
        raise document.error(key_path, f"is {_shown(part)}", "a mapping (key: value)")
    if not ignore_unknown:
        _refuse_unknown_keys(document, key_path, part, cls)
    try:
        return msgspec.convert(part, cls, dec_hook=_array)
    except msgspec.ValidationError as error:
        raise _explained(document, key_path, cls, str(error)) from error
    except (CommissionError, OverflowError, ArithmeticError) as error:
        raise _explained(document, key_path, cls, str(error)) from error


def _array(kind: Any, value: Any) -> Any:
    """Turn a list of numbers into an array: the only type of the project's values that msgspec does not know."""
    if typing.get_origin(kind) is not np.ndarray:
        raise NotImplementedError(f"no conversion to {kind}")
    if not _is_numbers(value, 2):
        raise ValueError(f"is {_shown(value)}; expected a list of numbers")
    try:
        return np.array(value, dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"is {_shown(value)}; expected rows of one length") from error


def _is_numbers(value: Any, depth: int) -> bool:
    if isinstance(value, list):
        return depth > 0 and all(_is_numbers(v, depth - 1) if isinstance(v, list) else _is_number(v) for v in value)
    return False


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _refuse_unknown_keys(document: YamlDocument, key_path: KeyPath, part: Any, kind: Any) -> None:
    """Walk values and types side by side; msgspec itself passes over unknown keys of a dataclass."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        for option in arguments:
            _refuse_unknown_keys(document, key_path, part, option)
    elif origin is tuple and isinstance(part, list) and arguments:
        for index, element in enumerate(part):
            _refuse_unknown_keys(document, (*key_path, index), element, arguments[0])
    elif dataclasses.is_dataclass(kind) and isinstance(part, dict):
        known = keys_of(typing.cast(type, kind))
        for key, value in part.items():
            if key not in known:
                raise document.error((*key_path, key), "is no known key", f"one of: {', '.join(known)}")
            _refuse_unknown_keys(document, (*key_path, key), value, known[key])


@functools.cache
def keys_of(cls: type) -> dict[str, Any]:
    """Keys that a dataclass takes, with their types; found once per class, since a table asks in each of its rows."""
    hints = typing.get_type_hints(cls)
    return {field.name: hints[field.name] for field in dataclasses.fields(cls) if field.init}


def _explained(document: YamlDocument, key_path: KeyPath, cls: type, message: str) -> FileFormatError:
    """Turn the converter's message into place, problem and remedy."""
    match = typing.cast(re.Match[str], _PLACE.match(message))
    text = match["text"]
    steps: KeyPath = tuple(name or int(index) for name, index in _STEP.findall((match["key"] or "$")[1:]))
    if missing := re.match(r"Object missing required field `(.+)`", text):
        steps = (*steps, missing[1])
        return document.error((*key_path, *steps), "is missing", _with_hint("a value", cls, steps))
    if expected := _EXPECTED.match(text):
        return document.error(
            (*key_path, *steps),
            f"is {_shown(_at(document.value, (*key_path, *steps)))}",
            _with_hint(_in_words(expected["expected"]), cls, steps),
        )
    if text.startswith("Invalid enum value"):
        options = typing.get_type_hints(_owner(cls, steps[:-1]) or cls).get(str(steps[-1]))
        words = list(options) if isinstance(options, type) and issubclass(options, StrEnum) else []
        remedy = f"one of: {', '.join(words)}"
        return document.error((*key_path, *steps), text[len("Invalid enum ") :], _with_hint(remedy, cls, steps))
    problem, _, remedy = text.partition("; expected ")
    owner = _owner(cls, steps)
    if owner is not None:
        named = [key for key in keys_of(owner) if re.search(rf"\b{re.escape(key)}\b", problem.split(" is ")[0])]
        value = _at(document.value, (*key_path, *steps))
        if len(named) == 1 and isinstance(value, dict) and named[0] in value:
            steps = (*steps, named[0])
    if steps:
        # The place already names the key: `scanner.rate: is 0` instead of `scanner.rate: scanner.rate is 0`.
        named = re.match(rf"(?:.*[.: ])?{re.escape(str(steps[-1]))}(?P<element>(?:\[\d+\])*) (?=is |has )", problem)
        if named is not None:
            problem = problem[named.end() :]
            steps = (*steps, *(int(index) for index in re.findall(r"\d+", named["element"])))
    return document.error((*key_path, *steps), problem, _with_hint(remedy, cls, steps))


def _with_hint(remedy: str, cls: type, steps: KeyPath) -> str:
    """Append what the key means, unless the place is a whole element of a list of mappings."""
    depth = max((index for index, step in enumerate(steps) if isinstance(step, str)), default=None)
    if depth is None or (_owner(cls, steps) is not None and isinstance(steps[-1], int)):
        return remedy
    owner = _owner(cls, steps[:depth])
    hint = field_hints(owner).get(str(steps[depth]), "") if owner is not None else ""
    return f"{remedy} ({hint.rstrip('.')})" if hint else remedy


def _owner(cls: type, steps: KeyPath) -> type | None:
    """Dataclass that holds the value at `steps`, or that is the value there."""
    kind: Any = cls
    for step in steps:
        if isinstance(step, int):
            arguments = typing.get_args(kind)
            kind = arguments[0] if arguments else None
        elif dataclasses.is_dataclass(kind):
            kind = keys_of(typing.cast(type, kind)).get(step)
    return kind if dataclasses.is_dataclass(kind) and isinstance(kind, type) else None


def _at(value: Any, steps: KeyPath) -> Any:
    for step in steps:
        try:
            value = value[step]
        except (KeyError, IndexError, TypeError):
            return value
    return value


def _shown(value: Any) -> str:
    """Value as found, short enough for one line."""
    text = "empty" if value is None else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _in_words(expected: str) -> str:
    """`float | null` as a person says it."""
    match = re.match(r"`([^`]*)`(.*)", expected)
    if not match:
        return expected
    kinds = [_NAMES.get(kind.strip(), kind.strip()) for kind in match[1].split("|")]
    return " or ".join(kinds) + match[2].replace("`", "")
