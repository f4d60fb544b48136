"""The project folder: `project.yaml` and the files that it refers to, read, checked and written.

It converts between files and `site.Project`; it does not watch for changes and keeps no journal.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from commission.errors import FileFormatError, ProjectError, UsageError
from commission.io.atomic import staged, write_text
from commission.io.conversion import convert
from commission.io.findings import Findings
from commission.io.map_server import read_floor_map, write_floor_map
from commission.io.project_text import project_text
from commission.io.reading import cannot_read, inside
from commission.io.reflector_tables import read_reflectors, write_reflectors
from commission.io.yaml_document import YamlDocument, read_yaml, scalar
from commission.site.disturbances import Disturbances, WheelNoise
from commission.site.fields import in_file, with_field
from commission.site.floor_map import FloorMap
from commission.site.layout_brief import LayoutBrief
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag, TagCamera
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle, Vehicle
from commission.site.zones import Zone

SCHEMA = 2
"""Version of the format that this program writes."""
SCHEMAS = (1, SCHEMA)
"""Versions that it reads: 1 has one `scanner`, 2 has `scanners`."""
FILE_NAME = "project.yaml"

VEHICLES: dict[str, type[Vehicle]] = {
    kind.kind: kind for kind in (DifferentialVehicle, TricycleVehicle, OmnidirectionalVehicle)
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ProjectDocument:
    """Keys of `project.yaml`."""

    schema: int
    """Version of this format."""
    name: str = "Unnamed"
    """Shown in the title of the page."""
    floor_map: str | None = None
    """`map_server` YAML file, relative to this folder; none: an open field."""
    reflectors: str | None = None
    """Reflector table (CSV), relative to this folder; none: no reflectors yet."""
    vehicle: dict[str, Any] | None = None
    """Wheels and outline; `kind` says which vehicle."""
    scanner: Scanner = field(default_factory=Scanner)
    """The only laser scanner, as files of schema 1 have it."""
    scanners: tuple[Scanner, ...] = ()
    """The laser scanners."""
    routes: tuple[Route, ...] = ()
    """Planned routes."""
    parameters: Parameters = field(default_factory=Parameters)
    """Tunables of the localizer."""
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    """How well the constants of the site and the vehicle are known."""
    disturbances: Disturbances = field(default_factory=Disturbances)
    """What a virtual drive suffers."""
    stations: tuple[Station, ...] = ()
    """Places where the vehicle has to stand accurately."""
    tags: tuple[Tag, ...] = ()
    """Landmarks that tell place and heading at once."""
    tag_camera: TagCamera = field(default_factory=TagCamera)
    """The camera that sees them."""
    zones: tuple[Zone, ...] = ()
    """Parts of the floor in which only some kinds of observation correct the pose."""
    layout: LayoutBrief = field(default_factory=LayoutBrief)
    """What is asked of a suggested layout of reflectors."""


def project_file(path: Path) -> Path:
    """Path of the `project.yaml` that `path` (the folder or the file itself) stands for."""
    return path / FILE_NAME if path.is_dir() else path


@dataclass(frozen=True, slots=True)
class OpenedProject:
    """A project to work on."""

    project: Project
    """What is edited."""
    folder: Path
    """Where it is kept."""
    is_new: bool
    """Whether nothing of it is on disk yet."""
    notes: tuple[str, ...] = ()
    """What was doubted while it was read, one line each."""


def open_project(path: Path) -> OpenedProject:
    """Read a project, or begin one in a folder that holds none or does not exist yet; nothing is written.

    Parameters
    ----------
    path : folder of the project, or its `project.yaml`. A new project is called like its folder.

    Raises
    ------
    FileFormatError
        the path is another file, or its project cannot be read.
    """
    folder = path.parent if path.name == FILE_NAME else path
    if path.is_file() and path.name != FILE_NAME:
        raise FileFormatError(path, "", "is a file", f"the folder of a project, or of one to begin, or its {FILE_NAME}")
    try:
        is_new = not (folder / FILE_NAME).exists()
        if is_new and folder.exists() and not folder.is_dir():
            raise FileFormatError(folder, "", "is no folder", "the folder of a project, or of one to begin")
        name = folder.resolve().name or "Unnamed"
    except (OSError, ValueError) as error:
        raise cannot_read(path, error) from error
    found = Findings()
    project = Project(name=name) if is_new else load_project(folder, found)
    return OpenedProject(project, folder, is_new, found.lines())


def load_project(path: Path, found: Findings | None = None) -> Project:
    """Read a project.

    Parameters
    ----------
    path : folder that holds a `project.yaml`, or that file.
    found : takes what was doubted in its map and tables.

    Raises
    ------
    FileFormatError
        one line that names file, line, key, what was found and what is expected.
    """
    yaml_path = project_file(path)
    if not yaml_path.is_file():
        raise FileFormatError(yaml_path, "", "does not exist", f"a project: a folder with a {FILE_NAME}")
    document, keys = _read_document(yaml_path)
    try:
        return Project(
            name=keys.name,
            floor_map=_floor_map(document, keys.floor_map, found),
            reflectors=_reflectors(document, keys.reflectors, found),
            routes=keys.routes,
            vehicle=_vehicle(document, keys.vehicle),
            scanners=_scanners(document, keys),
            parameters=keys.parameters,
            uncertainty=keys.uncertainty,
            disturbances=_disturbances(document, keys),
            stations=keys.stations,
            tags=keys.tags,
            tag_camera=keys.tag_camera,
            zones=keys.zones,
            layout=keys.layout,
        )
    except ProjectError as error:
        problem, _, remedy = str(error).partition("; expected ")
        raise FileFormatError(yaml_path, "", problem, remedy) from error


def save_project(project: Project, folder: Path) -> None:
    """Write a project; a file whose content is still the same is not touched.

    Parameters
    ----------
    project : what to write; loading it again gives an equal one.
    folder : made when missing. The names of map and reflector table in a `project.yaml` that is there are kept.

    Raises
    ------
    FileFormatError
        a file cannot be written: then none is. They are put in their place when all are complete, `project.yaml` last.
    """
    map_name, table_name = _names_in(folder / FILE_NAME)
    with staged(folder, last=FILE_NAME) as scratch:
        if project.floor_map is not None and not _holds_map(folder / map_name, folder, project.floor_map):
            write_floor_map(project.floor_map, scratch / _normal(folder, map_name))
        if not _holds_table(folder / table_name, project.reflectors):
            write_reflectors(project.reflectors, scratch / _normal(folder, table_name))
        text = project_text(project, SCHEMA, map_name if project.floor_map is not None else None, table_name)
        write_text(scratch / FILE_NAME, text)


def apply_settings(parameters: Parameters, settings: Sequence[str]) -> Parameters:
    """Change tunables as `--set group.key=value` does.

    Parameters
    ----------
    parameters : where to start.
    settings : texts like `association.gate_probability=0.95`, applied in order; one that its group refuses as the group
        stands is tried again after the others, so that both of two limits can be raised past each other.

    Raises
    ------
    UsageError
        unknown group or key (lists the known ones) or a value that the key refuses.
    """
    waiting = list(settings)
    while waiting:
        refused: list[tuple[str, ValueError]] = []
        for setting in waiting:
            name, equals, text = (part.strip() for part in setting.partition("="))
            if not equals or "." not in name:
                raise UsageError(
                    f"setting {setting!r} is no group.key=value; expected for example observation.range_sigma=0.02"
                )
            try:
                parameters = with_field(parameters, name, scalar(text), "parameter")
            except ValueError as error:
                refused.append((setting, error))
        if len(refused) == len(waiting):
            raise UsageError(str(refused[0][1])) from refused[0][1]
        waiting = [setting for setting, _ in refused]
    return parameters


def _read_document(yaml_path: Path) -> tuple[YamlDocument, ProjectDocument]:
    document = read_yaml(yaml_path)
    value = document.value
    if not isinstance(value, dict) or "schema" not in value:
        raise document.error(("schema",), "is missing", f"a mapping that begins with `schema: {SCHEMA}`")
    if value["schema"] not in SCHEMAS or isinstance(value["schema"], bool):
        known = " or ".join(map(str, SCHEMAS))
        raise document.error(("schema",), f"is {value['schema']!r}", f"{known}, the versions this program knows")
    return document, convert(document, ProjectDocument)


def _vehicle(document: YamlDocument, keys: dict[str, Any] | None) -> Vehicle:
    if keys is None:
        return DifferentialVehicle()
    kind = keys.get("kind", DifferentialVehicle.kind)
    if not isinstance(kind, str) or kind not in VEHICLES:
        raise document.error(("vehicle", "kind"), f"is {kind!r}", f"one of: {', '.join(VEHICLES)}")
    without_kind = {key: value for key, value in keys.items() if key != "kind"}
    rest = dataclasses.replace(document, value={**document.value, "vehicle": without_kind})
    return convert(rest, VEHICLES[kind], ("vehicle",))


def _disturbances(document: YamlDocument, keys: ProjectDocument) -> Disturbances:
    """What a virtual drive suffers; projects of old took the true noise of the wheels from the filter's parameters."""
    if "wheels" in document.value.get("disturbances", {}):
        return keys.disturbances
    stated = document.value.get("parameters", {}).get("odometry", {})
    wheels = WheelNoise.believed(keys.parameters.odometry, stated)
    return dataclasses.replace(keys.disturbances, wheels=wheels)


def _scanners(document: YamlDocument, keys: ProjectDocument) -> tuple[Scanner, ...]:
    """The scanners; a file of schema 1 has one or none."""
    if "scanners" not in document.value:
        return (keys.scanner,)
    if "scanner" in document.value:
        raise document.error(("scanner",), "is given besides `scanners`", "all scanners in the list `scanners`")
    return keys.scanners


def _floor_map(document: YamlDocument, name: str | None, found: Findings | None) -> FloorMap | None:
    if name is None:
        return None
    folder = document.path.parent
    return read_floor_map(inside(folder, name, document.path, document.place(("floor_map",))), folder, found=found)


def _reflectors(document: YamlDocument, name: str | None, found: Findings | None) -> ReflectorMap:
    if name is None:
        return ReflectorMap()
    path = inside(document.path.parent, name, document.path, document.place(("reflectors",)))
    return read_reflectors(path, found)


def _names_in(yaml_path: Path) -> tuple[str, str]:
    """Names of map and table in the project that is already there; the usual ones when it is absent or broken."""
    try:
        document, keys = _read_document(yaml_path)
        for key, name in (("floor_map", keys.floor_map), ("reflectors", keys.reflectors)):
            if name is not None:
                inside(yaml_path.parent, name, yaml_path, document.place((key,)))
    except FileFormatError:
        return "map.yaml", "reflectors.csv"
    return keys.floor_map or "map.yaml", keys.reflectors or "reflectors.csv"


def _normal(folder: Path, name: str) -> str:
    """Name of a file relative to the folder that it lies in, without going out and back: `../hall/map.yaml`."""
    top = os.path.abspath(folder)
    return os.path.relpath(os.path.join(top, name), top)


def _holds_map(path: Path, folder: Path, floor_map: FloorMap) -> bool:
    try:
        return read_floor_map(path, folder) == in_file(floor_map)
    except FileFormatError:
        return False


def _holds_table(path: Path, reflectors: ReflectorMap) -> bool:
    try:
        return read_reflectors(path) == in_file(reflectors)
    except FileFormatError:
        return False
