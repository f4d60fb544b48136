"""From a file of one system to a file of another: which kinds there are, which go into which, and what gets lost.

The formats themselves are modules beside this one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from commission.errors import FileFormatError, UsageError
from commission.io import mesh
from commission.io.atomic import staged
from commission.io.dxf import read_drawing
from commission.io.findings import Findings
from commission.io.imk import read_imk, write_imk
from commission.io.json_document import read_json
from commission.io.lif import is_layout, read_lif
from commission.io.lif_writer import write_lif
from commission.io.map_server import read_floor_map, write_floor_map
from commission.io.overwriting import refuse_files
from commission.io.project_copy import refuse_to_replace
from commission.io.project_file import FILE_NAME, load_project, project_file, save_project
from commission.io.recordings.bag_parts import bag_of
from commission.io.recordings.base import is_recording
from commission.io.recordings.channels import NO_OPTIONS, ChannelOptions
from commission.io.recordings.conversion import convert_recording
from commission.io.recordings.writers import refuse_to_write
from commission.io.reflector_tables import write_reflectors
from commission.io.route_edges import RouteImport
from commission.io.smap import FIELDS, read_smap
from commission.io.table_import import read_any_table
from commission.io.vda5050 import read_order
from commission.site import network_diff
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.quantity import counted_text
from commission.site.reflector_diff import difference, merged
from commission.site.reflectors import ReflectorMap


class Kind(StrEnum):
    """What a file holds, in the words of a message."""

    PROJECT = "a project"
    TABLE = "a reflector table (.csv, .tsv)"
    IMK = "a SICK layout (.imk)"
    LIF = "a VDMA LIF layout (.lif, .json)"
    ORDER = "a VDA 5050 order (.json)"
    DRAWING = "a CAD drawing (.dxf)"
    MODEL = "a 3D model (.stl, .obj, .glb, .ply)"
    MAP = "a floor map (.yaml)"
    SMAP = "a SEER map (.smap)"
    RECORDING = "a recording"


TARGETS: dict[Kind, tuple[Kind, ...]] = {
    Kind.PROJECT: (Kind.TABLE, Kind.IMK, Kind.LIF, Kind.MAP),
    Kind.TABLE: (Kind.IMK, Kind.TABLE, Kind.PROJECT),
    Kind.IMK: (Kind.TABLE, Kind.IMK, Kind.PROJECT),
    Kind.LIF: (Kind.PROJECT, Kind.LIF),
    Kind.ORDER: (Kind.PROJECT, Kind.LIF),
    Kind.DRAWING: (Kind.MAP, Kind.PROJECT),
    Kind.MODEL: (Kind.MAP, Kind.PROJECT),
    Kind.MAP: (Kind.PROJECT, Kind.MAP),
    Kind.SMAP: (Kind.PROJECT, Kind.TABLE, Kind.IMK, Kind.LIF, Kind.MAP),
    Kind.RECORDING: (Kind.RECORDING,),
}
"""Into which kinds each kind can be converted."""

_CALLED = {
    Kind.PROJECT: "the folder of a project",
    Kind.TABLE: "a name that ends with .csv for a reflector table",
    Kind.IMK: "one that ends with .imk for a SICK layout",
    Kind.LIF: "one that ends with .lif for a VDMA LIF layout",
    Kind.MAP: "one that ends with .yaml for a floor map",
    Kind.RECORDING: "a folder for the tables of a recording, or a name that ends with .mcap",
}
"""How a target of each kind is called."""

_SUFFIXES = {
    ".csv": Kind.TABLE,
    ".tsv": Kind.TABLE,
    ".txt": Kind.TABLE,
    ".imk": Kind.IMK,
    ".lif": Kind.LIF,
    ".json": Kind.LIF,
    ".dxf": Kind.DRAWING,
    ".yaml": Kind.MAP,
    ".yml": Kind.MAP,
    ".bag": Kind.RECORDING,
    ".mcap": Kind.RECORDING,
    ".db3": Kind.RECORDING,
    ".pcap": Kind.RECORDING,
    ".pcapng": Kind.RECORDING,
    ".smap": Kind.SMAP,
    **{f".{suffix}": Kind.MODEL for suffix in mesh.KINDS},
}


_AS_CSV = "a recording as a CSV folder (odometry.csv with detections.csv or scans.npz)"
_AS_MODEL = "the model as .stl, .obj, .glb or .ply"
_UNREAD = {
    ".dwg": "the drawing saved as DXF (in the CAD program: Save as, DXF)",
    ".dwt": "the drawing saved as DXF (in the CAD program: Save as, DXF)",
    ".dgn": "the drawing saved as DXF (in the CAD program: Save as, DXF)",
    ".ifc": "the floor plan exported as DXF, or the model as .glb",
    ".rvt": "the floor plan exported as DXF, or the model as .glb",
    ".skp": _AS_MODEL,
    ".dae": _AS_MODEL,
    ".fbx": _AS_MODEL,
    ".step": _AS_MODEL,
    ".stp": _AS_MODEL,
    ".3ds": _AS_MODEL,
    ".log": _AS_CSV,
    ".xml": "reflectors as a table (.csv), routes as VDMA LIF (.lif)",
    ".xls": "the table saved as CSV",
    ".xlsx": "the table saved as CSV",
    ".ods": "the table saved as CSV",
    ".pdf": "the drawing as DXF, or an image (.png), which the page takes as a floor map",
    ".svg": "the drawing as DXF, or an image (.png), which the page takes as a floor map",
    ".png": "the map.yaml that describes the image; the page also takes a plain image as a floor map",
    ".pgm": "the map.yaml that describes the image; the page also takes a plain image as a floor map",
    ".bmp": "the map.yaml that describes the image; the page also takes a plain image as a floor map",
    **dict.fromkeys((".jpg", ".jpeg", ".tif", ".tiff", ".gif", ".webp"), "the image saved as PNG"),
    **dict.fromkeys((".zip", ".7z", ".gz", ".bz2", ".xz", ".zst", ".zstd", ".tar", ".tgz", ".rar"), "it unpacked"),
    **dict.fromkeys((".xlsm", ".xlsb", ".numbers"), "the table saved as CSV"),
    **dict.fromkeys((".pbstream", ".posegraph"), "the map saved by map_saver as map.yaml with its image"),
    **dict.fromkeys((".pcd", ".las", ".laz", ".e57", ".xyz", ".pts"), "a floor plan or model instead of a point cloud"),
}
"""What to bring instead of a file that is not read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertOptions:
    """What a file leaves open."""

    vehicle_type: str | None = None
    """LIF: vehicle type whose edges are read; the most frequent when None."""
    layout: str | None = None
    """LIF: identifier of the layout that is read; all when None."""
    unit: str | None = None
    """Drawing, model: unit in which it was made; as the drawing states, metres for a model when None."""
    layers: tuple[str, ...] = ()
    """Drawing: layers that hold walls; all visible ones when empty."""
    heights: tuple[float, ...] = (0.2,)
    """Model: heights of the sections that become walls [m]."""
    up: str | None = None
    """Model: axis that points up, `y` or `z`; y for GLB and z for the others when None."""
    resolution: float = 0.05
    """Drawing, model: edge of a cell of the map [m]."""
    recording: ChannelOptions = NO_OPTIONS
    """Recording: which topics are what."""


def kind_of_source(path: Path) -> Kind:
    """Kind of an existing file or folder; raises FileFormatError when it does not exist or is none of them."""
    if not path.exists():
        raise FileFormatError(path, "", "does not exist", "a file or folder to convert")
    if bag_of(path) != path:
        return Kind.RECORDING
    if path.is_dir() or path.name == FILE_NAME:
        return Kind.PROJECT if project_file(path).is_file() else Kind.RECORDING
    kind = _SUFFIXES.get(path.suffix.lower())
    if kind is None and is_recording(path):
        return Kind.RECORDING
    if kind is None:
        remedy = _UNREAD.get(path.suffix.lower(), f"a folder, or a file that ends in {', '.join(_SUFFIXES)}")
        raise FileFormatError(path, "", f"ends in {path.suffix!r}, which is not read", remedy)
    if path.suffix.lower() == ".json" and not is_layout(read_json(path, Findings())):
        return Kind.ORDER
    return kind


def kind_of_target(path: Path, source: Kind) -> Kind:
    """Kind that a file to be written shall have, by its ending; a name without one is a folder."""
    if path.name == FILE_NAME:
        return Kind.PROJECT
    kind = _SUFFIXES.get(path.suffix.lower())
    if kind is None or path.is_dir():
        return Kind.RECORDING if source is Kind.RECORDING else Kind.PROJECT
    return kind


def convert_file(source: Path, target: Path, options: ConvertOptions, *, force: bool = False) -> tuple[str, ...]:
    """Convert a file or folder.

    Parameters
    ----------
    source : what to read.
    target : what to write. An existing project keeps what the source does not hold: reflectors and the floor map are
        replaced, routes and stations of the same name too, others stay.
    options : what the source leaves open.
    force : whether what is there may be replaced.

    Returns
    -------
    report : what was made up, doubted or lost, one line each.

    Raises
    ------
    FileFormatError
        the source is unreadable or the target cannot be written.
    UsageError
        the one cannot become the other, or something is there that would be overwritten.
    """
    kind = kind_of_source(source)
    if kind not in TARGETS:
        raise UsageError(f"{source}: {kind} cannot be converted; expected {'; '.join(TARGETS)}")
    wanted = kind_of_target(target, kind)
    if wanted not in TARGETS[kind]:
        problem = f"{source} is {kind} already" if wanted is kind else f"{kind} is not converted into {wanted}"
        raise UsageError(f"{target}: {problem}; expected {', '.join(_CALLED[each] for each in TARGETS[kind])}")
    if target.exists() and source.resolve() == target.resolve():
        raise UsageError(f"{target} is the source itself; expected another place")
    _refuse_to_overwrite(target, wanted, force=force)
    return _CONVERTERS[kind](source, target, wanted, options)


def _refuse_to_overwrite(target: Path, wanted: Kind, *, force: bool) -> None:
    """Raise UsageError when there is something that would be overwritten, unless that was asked for."""
    if wanted is Kind.PROJECT:
        refuse_to_replace(_folder(target), force=force)
    elif wanted is Kind.RECORDING:
        refuse_to_write(target, force=force)
    elif wanted is Kind.MAP:
        refuse_files(target, target.with_suffix(".png"), force=force)
    else:
        refuse_files(target, force=force)


def _from_project(source: Path, target: Path, wanted: Kind, _: ConvertOptions) -> tuple[str, ...]:
    found = Findings()
    project = load_project(source, found)
    if wanted is Kind.LIF:
        return (*found.lines(), *write_lif(project, target))
    if wanted is Kind.MAP:
        if project.floor_map is None:
            raise UsageError(f"{source} has no floor map; expected a project with one")
        return (*found.lines(), *_written_map(project.floor_map, target, wanted))
    return (*found.lines(), *_written_reflectors(project.reflectors, target, wanted))


def _from_map(source: Path, target: Path, wanted: Kind, _: ConvertOptions) -> tuple[str, ...]:
    found = Findings()
    floor_map = read_floor_map(source, found=found)
    return (*found.lines(), *_written_map(floor_map, target, wanted))


def _from_reflectors(source: Path, target: Path, wanted: Kind, _: ConvertOptions) -> tuple[str, ...]:
    imported = read_imk(source) if source.suffix.lower() == ".imk" else read_any_table(source)
    return (*imported.warnings, *_written_reflectors(imported.reflectors, target, wanted, imported.fields))


def _from_routes(source: Path, target: Path, wanted: Kind, options: ConvertOptions) -> tuple[str, ...]:
    return _written_routes(source, _routes(source, options), target, wanted)


def _written_routes(source: Path, imported: RouteImport, target: Path, wanted: Kind) -> tuple[str, ...]:
    """Write routes and stations; an existing project keeps those that the source does not speak of."""
    if wanted is Kind.LIF:
        return (*imported.warnings, *write_lif(_network(source, imported), target))
    project = _existing(target)
    routes = network_diff.difference(project.routes, imported.routes)
    accurate = network_diff.with_required_accuracy(project.stations, imported.stations)
    stations = network_diff.difference(project.stations, accurate)
    changed = dataclasses.replace(
        project,
        routes=network_diff.merged(project.routes, routes, remove=False),
        stations=network_diff.merged(project.stations, stations, remove=False),
    )
    save_project(changed, _folder(target))
    read = f"{counted_text(len(imported.routes), 'route')} and {counted_text(len(imported.stations), 'station')} read"
    return (*imported.warnings, f"{read}, {counted_text(len(routes.removed), 'other route')} kept")


def _routes(source: Path, options: ConvertOptions) -> RouteImport:
    if kind_of_source(source) is Kind.ORDER:
        return read_order(source)
    return read_lif(source, vehicle_type=options.vehicle_type, layout=options.layout)


def _network(source: Path, imported: RouteImport) -> Project:
    """Project of nothing but what a layout holds."""
    return Project(name=source.stem, routes=imported.routes, stations=imported.stations)


def _from_drawing(source: Path, target: Path, wanted: Kind, options: ConvertOptions) -> tuple[str, ...]:
    drawing = read_drawing(source, unit=options.unit)
    floor_map = _checked(lambda: drawing.floor_map(options.resolution, options.layers or None))
    return (*drawing.warnings, *_written_map(floor_map, target, wanted))


def _from_model(source: Path, target: Path, wanted: Kind, options: ConvertOptions) -> tuple[str, ...]:
    if options.up not in (None, "y", "z"):
        raise UsageError(f"up is {options.up!r}; expected y or z")
    is_y_up = None if options.up is None else options.up == "y"
    model = mesh.read_model(source, unit=options.unit, y_up=is_y_up)
    return _written_map(_checked(lambda: model.floor_map(options.heights, options.resolution)), target, wanted)


def _from_smap(source: Path, target: Path, wanted: Kind, options: ConvertOptions) -> tuple[str, ...]:
    imported = read_smap(source)
    notes = imported.warnings
    if wanted is Kind.PROJECT:
        # One after the other into the same project: what the map does not hold, it keeps.
        if len(imported.walls):
            notes += _written_map(_checked(lambda: imported.floor_map(options.resolution)), target, wanted)
        notes += _written_reflectors(imported.reflectors, target, wanted, FIELDS)
    if wanted in (Kind.PROJECT, Kind.LIF):
        routes = RouteImport(routes=imported.routes, stations=imported.stations)
        return (*notes, *_written_routes(source, routes, target, wanted))
    if wanted is Kind.MAP:
        return (*notes, *_written_map(_checked(lambda: imported.floor_map(options.resolution)), target, wanted))
    return (*notes, *_written_reflectors(imported.reflectors, target, wanted))


def _from_recording(source: Path, target: Path, _: Kind, options: ConvertOptions) -> tuple[str, ...]:
    return convert_recording(source, target, options.recording)


def _written_reflectors(
    reflectors: ReflectorMap, target: Path, wanted: Kind, fields: tuple[str, ...] | None = None
) -> tuple[str, ...]:
    """Write reflectors; `fields` are those that their source speaks of, the others a project keeps."""
    if wanted is Kind.IMK:
        return write_imk(reflectors, target)
    if wanted is Kind.TABLE:
        write_reflectors(reflectors, target)
        return ()
    project = _existing(target)
    diff = difference(project.reflectors, reflectors, fields=fields)
    changed_map = merged(project.reflectors, diff, remove=True)
    save_project(dataclasses.replace(project, reflectors=changed_map), _folder(target))
    added, changed, removed = len(diff.added), len(diff.changed), len(diff.removed)
    return (f"reflectors: {added} added, {changed} changed, {removed} removed, {diff.unchanged} as before",)


def _written_map(floor_map: FloorMap, target: Path, wanted: Kind) -> tuple[str, ...]:
    if wanted is Kind.MAP:
        with staged(target.parent, last=target.name) as scratch:
            write_floor_map(floor_map, scratch / target.name)
    else:
        save_project(dataclasses.replace(_existing(target), floor_map=floor_map), _folder(target))
    width, height = floor_map.size
    return (f"floor map of {width:.2f} x {height:.2f} m, cells of {floor_map.resolution:g} m",)


def _existing(target: Path) -> Project:
    """Project that is there already, or a new one."""
    return load_project(target) if project_file(target).is_file() else Project(name=_folder(target).name or "Unnamed")


def _folder(target: Path) -> Path:
    return target.parent if target.name == FILE_NAME else target


def _checked(make: Callable[[], FloorMap]) -> FloorMap:
    """A wrong resolution came from the user, not from the file."""
    try:
        return make()
    except ValueError as error:
        raise UsageError(str(error)) from None


_CONVERTERS: dict[Kind, Callable[[Path, Path, Kind, ConvertOptions], tuple[str, ...]]] = {
    Kind.PROJECT: _from_project,
    Kind.TABLE: _from_reflectors,
    Kind.IMK: _from_reflectors,
    Kind.LIF: _from_routes,
    Kind.ORDER: _from_routes,
    Kind.DRAWING: _from_drawing,
    Kind.MODEL: _from_model,
    Kind.MAP: _from_map,
    Kind.SMAP: _from_smap,
    Kind.RECORDING: _from_recording,
}
