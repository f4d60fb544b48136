"""Changes of a project as plain values: what a journal line holds, and what it makes of a project again.

Only what differs is written: single reflectors, routes and stations, whole vehicles, a rectangle of the floor map.
"""

from __future__ import annotations

import base64
import dataclasses
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from commission.errors import FileFormatError, reason_of
from commission.io.conversion import convert
from commission.io.map_server import CELL_LIMIT
from commission.io.project_file import VEHICLES
from commission.io.yaml_document import YamlDocument
from commission.site.disturbances import Disturbances, WheelNoise
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap
from commission.site.layout_brief import LayoutBrief
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag, TagCamera
from commission.site.uncertainty import Uncertainty
from commission.site.zones import Zone

_LISTS = {"reflectors": "id", "scanners": "name", "routes": "name", "stations": "name", "tags": "id", "zones": "name"}
"""Parts that are lists, and the field that tells their elements apart."""
_WHOLE = ("name", "parameters", "uncertainty", "disturbances", "layout", "tag_camera")
"""Parts that are written as they are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Parts:
    """Parts of a project that the project's own rules convert and check; those absent have not changed."""

    name: str = ""
    scanner: Scanner = field(default_factory=Scanner)
    """The only one, in journals of old."""
    parameters: Parameters = field(default_factory=Parameters)
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    disturbances: Disturbances = field(default_factory=Disturbances)
    layout: LayoutBrief = field(default_factory=LayoutBrief)
    scanners: tuple[Scanner, ...] = ()
    reflectors: tuple[Reflector, ...] = ()
    routes: tuple[Route, ...] = ()
    stations: tuple[Station, ...] = ()
    tags: tuple[Tag, ...] = ()
    tag_camera: TagCamera = field(default_factory=TagCamera)
    zones: tuple[Zone, ...] = ()


def change(before: Project | None, after: Project, *, with_map: bool = True) -> dict[str, Any]:
    """Difference between two projects as plain values.

    Parameters
    ----------
    before : None gives all of `after`.
    after : the later project.
    with_map : whether the floor map is looked at.

    Returns
    -------
    change : for `apply`; empty when nothing differs.
    """
    found: dict[str, Any] = {}
    for name in _WHOLE:
        value = getattr(after, name)
        if before is None or (getattr(before, name) is not value and getattr(before, name) != value):
            found[name] = _plain(value)
    if before is None or before.vehicle != after.vehicle:
        found["vehicle"] = {"kind": after.vehicle.kind, **_plain(after.vehicle)}
    for name, key in _LISTS.items():
        old, new = () if before is None else _elements(before, name), _elements(after, name)
        if before is None or (old is not new and old != new):
            found[name] = _list_change(old, new, key) if before is not None else {"all": _plain(new)}
    if with_map and (before is None or before.floor_map is not after.floor_map):
        map_change = _map_change(before.floor_map if before is not None else None, after.floor_map, before is None)
        if map_change is not None:
            found["floor_map"] = map_change
    return found


def apply(project: Project, values: dict[str, Any], path: Path) -> Project:
    """Make a change again.

    Parameters
    ----------
    project : the project before it.
    values : of `change`, as read from a file.
    path : that file, for messages.

    Raises
    ------
    FileFormatError
        the values are not those of a change, or not possible.
    """
    try:
        return _apply(project, values, path)
    except FileFormatError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, zlib.error) as error:
        raise FileFormatError(
            path, "", f"holds no change of a project ({reason_of(error)})", "what this program wrote"
        ) from error


def _apply(project: Project, values: dict[str, Any], path: Path) -> Project:
    plain = {name: values[name] for name in (*_WHOLE, "scanner") if name in values}
    for name in _LISTS:
        if name in values:
            part = values[name]
            plain[name] = part["all"] if "all" in part else [element for _, element in part["set"]]
    parts = convert(YamlDocument(path, plain), _Parts)
    new: dict[str, Any] = {name: getattr(parts, name) for name in _WHOLE if name in values}
    if "disturbances" in values and "wheels" not in values["disturbances"]:
        # Written before the wheels had noise of their own.
        odometry = new["parameters"].odometry if "parameters" in new else None
        stated = values.get("parameters", {}).get("odometry", {})
        wheels = project.disturbances.wheels if odometry is None else WheelNoise.believed(odometry, stated)
        new["disturbances"] = dataclasses.replace(parts.disturbances, wheels=wheels)
    if "scanner" in values:
        new["scanners"] = (parts.scanner,)
    if "vehicle" in values:
        keys = {key: value for key, value in values["vehicle"].items() if key != "kind"}
        kind = VEHICLES[values["vehicle"]["kind"]]
        new["vehicle"] = convert(YamlDocument(path, {"vehicle": keys}), kind, ("vehicle",))
    for name, key in _LISTS.items():
        if name in values:
            elements = getattr(parts, name)
            if "all" not in values[name]:
                elements = _list_applied(_elements(project, name), values[name], elements, key)
            new[name] = ReflectorMap(elements) if name == "reflectors" else elements
    if "floor_map" in values:
        new["floor_map"] = _map_applied(project.floor_map, values["floor_map"])
    return dataclasses.replace(project, **new)


def _plain(value: Any) -> Any:
    return msgspec.to_builtins(value, enc_hook=_array_as_list)


def _array_as_list(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise NotImplementedError(f"{type(value).__name__} cannot be written to a journal")


def _elements(project: Project, name: str) -> tuple[Any, ...]:
    return project.reflectors.reflectors if name == "reflectors" else getattr(project, name)


def _list_change(old: Sequence[Any], new: Sequence[Any], key: str) -> dict[str, Any]:
    """Elements set and removed; all of them when the order of those that stay is another one."""
    before = {getattr(value, key): value for value in old}
    after = [getattr(value, key) for value in new]
    names = set(after)
    kept = [name for name in before if name in names]
    if after[: len(kept)] != kept:
        return {"all": _plain(new)}
    changed = [
        [name, _plain(value)]
        for name, value in zip(after, new, strict=True)
        if name not in before or (before[name] is not value and before[name] != value)
    ]
    return {"set": changed, "removed": [name for name in before if name not in names]}


def _list_applied(old: Sequence[Any], part: dict[str, Any], elements: Sequence[Any], key: str) -> tuple[Any, ...]:
    removed = set(part["removed"])
    values = {getattr(value, key): value for value in old if getattr(value, key) not in removed}
    values.update({getattr(value, key): value for value in elements})
    return tuple(values.values())


def _map_change(old: FloorMap | None, new: FloorMap | None, whole: bool) -> dict[str, Any] | None:
    """Rectangle of cells that differ, or the whole map where its size does; None when the maps are equal."""
    if new is None:
        return {"removed": True} if whole or old is not None else None
    origin = [float(value) for value in new.origin]
    frame = {"resolution": float(new.resolution), "origin": origin, "shape": list(new.cells.shape)}
    if old is None or whole or old.cells.shape != new.cells.shape:
        return {**frame, "at": [0, 0], "size": frame["shape"], "cells": _packed(new.cells)}
    top, bottom, left, right = (0, 0, 0, 0) if old.cells is new.cells else _changed_part(old.cells, new.cells)
    is_same_frame = old.resolution == new.resolution and np.array_equal(old.origin, new.origin)
    if top == bottom and is_same_frame:
        return None
    part = new.cells[top:bottom, left:right]
    return {**frame, "at": [top, left], "size": list(part.shape), "cells": _packed(part)}


def _changed_part(old: np.ndarray, new: np.ndarray) -> tuple[int, int, int, int]:
    """First and end row, first and end column of the cells that differ; zeros when none does."""
    differs = old != new
    rows = np.flatnonzero(differs.any(axis=1))
    if len(rows) == 0:
        return 0, 0, 0, 0
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    columns = np.flatnonzero(differs[top:bottom].any(axis=0))
    return top, bottom, int(columns[0]), int(columns[-1]) + 1


def _map_applied(old: FloorMap | None, part: dict[str, Any]) -> FloorMap | None:
    if part.get("removed"):
        return None
    rows, columns = (int(n) for n in part["shape"])
    height, width = (int(n) for n in part["size"])
    top, left = (int(n) for n in part["at"])
    if not 0 < rows * columns <= CELL_LIMIT or not (0 <= top <= rows - height and 0 <= left <= columns - width):
        raise ValueError(f"floor map of {rows} x {columns} cells")
    cells = _unpacked(part["cells"], (height, width))
    if (height, width) != (rows, columns):
        if old is None or old.cells.shape != (rows, columns):
            raise ValueError("a part of a floor map that is not there")
        whole = np.array(old.cells)
        whole[top : top + height, left : left + width] = cells
        cells = whole
    return FloorMap(cells, float(part["resolution"]), np.array(part["origin"], dtype=np.float64))


def _packed(cells: np.ndarray) -> str:
    # Level 1: four times as fast as the default, and a map of walls is small either way.
    return base64.b64encode(zlib.compress(np.ascontiguousarray(cells).tobytes(), 1)).decode("ascii")


def _unpacked(text: str, shape: tuple[int, int]) -> np.ndarray:
    expected = shape[0] * shape[1]
    unpacker = zlib.decompressobj()
    data = unpacker.decompress(base64.b64decode(text, validate=True), expected + 1)
    if len(data) != expected:
        raise ValueError(f"{len(data)} cells; expected {expected}")
    cells = np.frombuffer(data, dtype=np.int8).reshape(shape)
    if not np.isin(cells, (UNKNOWN, FREE, OCCUPIED)).all():
        raise ValueError("a cell that is neither free, occupied nor unknown")
    return cells
