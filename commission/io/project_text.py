"""Text of `project.yaml`: the same project always gives the same text, one value a line, units as comments.

Numbers are rounded as their `Quantity` says: what is read and written again does not drift.

Only the writing side; `project_file` reads it and owns the format's version.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from enum import StrEnum
from typing import Any

import numpy as np
import yaml

from commission.io.yaml_document import scalar
from commission.site.fields import fields_of, in_file
from commission.site.layout_brief import LayoutBrief
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.tags import TagCamera

_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_./ ()-]*")
_WIDTH = 110
"""A list that fits on a line of this width is written on one."""


def project_text(project: Project, schema: int, floor_map: str | None, reflectors: str) -> str:
    """Text of the `project.yaml` of a project.

    Parameters
    ----------
    project : what to write; its map and reflectors are files of their own.
    schema : version of the format.
    floor_map, reflectors : names of those files, relative to the project's folder.
    """
    project = in_file(replace(project, floor_map=None, reflectors=ReflectorMap()))
    lines = [
        f"schema: {schema}",
        f"name: {_text(project.name)}",
        *([f"floor_map: {_text(floor_map)}"] if floor_map is not None else []),
        f"reflectors: {_text(reflectors)}",
        "vehicle:",
        f"  kind: {project.vehicle.kind}",
        *_fields(project.vehicle, "  "),
        *_entry("scanners", project.scanners, "", ""),
        *_entry("routes", project.routes, "", ""),
        *(_entry("stations", project.stations, "", "") if project.stations else ()),
        *(_entry("tags", project.tags, "", "") if project.tags else ()),
        *(_entry("tag_camera", project.tag_camera, "", "") if project.tag_camera != TagCamera() else ()),
        *(_entry("zones", project.zones, "", "") if project.zones else ()),
        "parameters:",
        *_fields(project.parameters, "  "),
        "uncertainty:",
        *_fields(project.uncertainty, "  "),
        "disturbances:",
        *_fields(project.disturbances, "  "),
        *(_entry("layout", project.layout, "", "") if project.layout != LayoutBrief() else ()),
    ]
    return "\n".join(lines) + "\n"


def _fields(value: Any, indent: str) -> Iterator[str]:
    """Lines of a dataclass; what is None is left out."""
    for name, info in fields_of(type(value)).items():
        content = getattr(value, name)
        if content is not None:
            yield from _entry(name, content, indent, info.unit)


def _entry(key: str, content: Any, indent: str, unit: str) -> Iterator[str]:
    """Lines of one key."""
    comment = f"  # {unit}" if unit else ""
    if dataclasses.is_dataclass(content):
        yield f"{indent}{key}:"
        yield from _fields(content, indent + "  ")
        return
    if isinstance(content, np.ndarray):
        content = content.tolist()
    if isinstance(content, tuple | list) and content and dataclasses.is_dataclass(content[0]):
        yield f"{indent}{key}:"
        for element in content:
            first, *rest = _fields(element, indent + "    ")
            yield f"{indent}  - {first.strip()}"
            yield from rest
        return
    line = f"{indent}{key}: {_flow(content)}"
    if len(line) <= _WIDTH or not isinstance(content, tuple | list):
        yield line + comment
        return
    yield f"{indent}{key}:{comment}"
    yield from (f"{indent}  - {_flow(element)}" for element in content)


def _flow(value: Any) -> str:
    """Value on one line."""
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_flow(element) for element in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _number(value)
    return _text(str(value.value if isinstance(value, StrEnum) else value))


def _number(value: float) -> str:
    """Shortest text that reads back as the same number, also for readers of YAML 1.1 (which want a point)."""
    if not math.isfinite(value):
        raise ValueError(f"{value} cannot be written; expected a finite number")
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}{'' if '.' in mantissa else '.0'}e{exponent}" if e else text


def _text(text: str) -> str:
    """Plain where every reader takes it for text, quoted otherwise."""
    if _PLAIN.fullmatch(text) and text == text.strip() and isinstance(scalar(text), str) and text.lower() not in _WORDS:
        return text
    return str(yaml.safe_dump(text, default_style='"', width=math.inf, allow_unicode=True)).strip()


_WORDS = frozenset({"y", "n", "yes", "no", "on", "off"})
"""Texts that readers of YAML 1.1 take for true or false."""
