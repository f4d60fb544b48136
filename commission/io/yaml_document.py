"""YAML that a person edits: plain values plus the line of every key. Not a full YAML: no tags, anchors or objects.

Scalars follow the core schema of YAML 1.2, so that `1e-3` is a number and a route called `no` is a text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import yaml

from commission.errors import FileFormatError
from commission.io.reading import read_text
from commission.site.quantity import LARGEST

SIZE_LIMIT = 4_000_000
"""Bytes of a YAML file; a project with 1,000 routes has about 500,000."""
DEPTH_LIMIT = 30
"""Nesting of lists and mappings; a project file has 6."""

KeyPath: TypeAlias = tuple[str | int, ...]

_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_HEX = re.compile(r"0x[0-9a-fA-F]{1,15}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_WORDS = {
    "": None,
    "~": None,
    "null": None,
    "Null": None,
    "NULL": None,
    "true": True,
    "True": True,
    "TRUE": True,
    "false": False,
    "False": False,
    "FALSE": False,
}
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True, slots=True)
class YamlDocument:
    """What a YAML file says, and on which line it says it."""

    path: Path
    """The file."""
    value: Any
    """Nested dict, list, str, int, float, bool or None."""
    lines: dict[KeyPath, int] = field(default_factory=dict)
    """Line (from 1) of each key and list element; empty: the lines are not known."""

    def place(self, key_path: KeyPath) -> str:
        """Where a key is, for messages: `line 7, scanner.rate`; a missing key is placed at its nearest parent."""
        if not self.lines:
            return dotted(key_path)
        known = key_path
        while known and known not in self.lines:
            known = known[:-1]
        name = dotted(key_path)
        return ", ".join(part for part in (f"line {self.lines.get(known, 1)}", name) if part)

    def error(self, key_path: KeyPath, problem: str, remedy: str) -> FileFormatError:
        """Error at a key of this file.

        Parameters
        ----------
        key_path : where the key is.
        problem, remedy : what was found, what is expected.
        """
        return FileFormatError(self.path, self.place(key_path), problem, remedy)


def dotted(key_path: KeyPath) -> str:
    """Key path as a person writes it: `routes[0].segments[2].speed`."""
    text = ""
    for part in key_path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def read_yaml(path: Path) -> YamlDocument:
    """Read a YAML file.

    Raises
    ------
    FileFormatError
        the file is missing, larger than SIZE_LIMIT, nested deeper than DEPTH_LIMIT, holds a key twice, an alias, a tag,
        a number that is not finite, or is no YAML.
    """
    return parse_yaml(read_text(path, SIZE_LIMIT), path)


def parse_yaml(text: str, path: Path) -> YamlDocument:
    """Parse YAML text; `path` is the file that messages name. See `read_yaml`."""
    document = YamlDocument(path, None)
    try:
        # Events instead of yaml.load: duplicate keys, aliases and depth are seen before anything is built from them.
        builder = _Builder(document, yaml.parse(text, Loader=_LOADER))
        value = builder.document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}" if mark else ""
        raise FileFormatError(path, where, f"is no YAML ({error.problem or error.context})", "valid YAML") from error
    except (yaml.YAMLError, UnicodeError) as error:
        raise FileFormatError(path, "", f"is no YAML ({error})", "valid YAML") from error
    return YamlDocument(path, value, document.lines)


def scalar(text: str) -> str | int | float | bool | None:
    """Value of a plain (unquoted) scalar by the core schema of YAML 1.2."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _HEX.fullmatch(text):
        return int(text, 16)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _NOT_FINITE.fullmatch(text):
        return float(text.replace(".", ""))
    return text


class _Builder:
    """Build values from parser events; recursion is bounded by DEPTH_LIMIT."""

    def __init__(self, document: YamlDocument, events: Iterator[yaml.Event]) -> None:
        self.found = document
        self.events = events

    def document(self) -> Any:
        """Value of the only document of the stream; None when it is empty."""
        value = None
        documents = 0
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise self.error(event, (), "a second document starts", "one document per file")
                value = self.node(next(self.events), ())
        return value

    def node(self, event: yaml.Event, key_path: KeyPath) -> Any:
        self.found.lines.setdefault(key_path, event.start_mark.line + 1)
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise self.error(event, key_path, "uses an anchor or alias (& or *)", "every value written out")
        tag = getattr(event, "tag", None)
        if tag not in (None, "!"):
            raise self.error(event, key_path, f"has the tag {tag!r}", "plain values without tags")
        if len(key_path) > DEPTH_LIMIT:
            raise self.error(event, (), "is nested too deeply", f"at most {DEPTH_LIMIT} levels")
        if isinstance(event, yaml.MappingStartEvent):
            return self.mapping(key_path)
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(key_path)
        if not isinstance(event, yaml.ScalarEvent):
            raise self.error(event, key_path, "is no value", "text, a number, a list or a mapping")
        # The style of an unquoted scalar is None in the Python parser and empty in the C parser.
        value = event.value if event.style else scalar(event.value)
        if isinstance(value, int | float) and not abs(value) <= LARGEST:
            raise self.error(event, key_path, f"is {event.value}", f"a finite number of at most {LARGEST:g}")
        return value

    def mapping(self, key_path: KeyPath) -> dict[str, Any]:
        values: dict[str, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                raise self.error(event, key_path, "has a list or mapping as a key", "text as a key")
            key = event.value
            here = (*key_path, key)
            if key in values:
                first = self.found.lines[here]
                raise self.error(event, here, f"is given a second time (first on line {first})", "each key once")
            self.found.lines[here] = event.start_mark.line + 1
            values[key] = self.node(next(self.events), here)
        return values

    def sequence(self, key_path: KeyPath) -> list[Any]:
        values: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            values.append(self.node(event, (*key_path, len(values))))
        return values

    def error(self, event: yaml.Event, key_path: KeyPath, problem: str, remedy: str) -> FileFormatError:
        place = f"line {event.start_mark.line + 1}"
        return FileFormatError(self.found.path, ", ".join(filter(None, (place, dotted(key_path)))), problem, remedy)
