"""Floor plans from CAD drawings (DXF): lines and curves, wide polylines, multilines, faces, hatches, and blocks.

A drawing is loaded once, as a job with progress; layers and resolution are chosen afterwards, on what was loaded.
Bodies are drawn by their outlines. Texts and dimensions are no walls and are left out; how many is said.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from commission.errors import FileFormatError, UsageError
from commission.geometry.arrays import FloatArray, read_only
from commission.io.dxf_entities import Insert, insert_of, shapes_of
from commission.io.dxf_shapes import Affine, Shape
from commission.io.dxf_tags import DxfGroup, read_groups, text_of
from commission.io.dxf_units import UNITS, doubts, judged_unit, stated_unit
from commission.io.findings import Findings, shown
from commission.io.outline import outline_map
from commission.progress import Progress, silent
from commission.site.floor_map import FloorMap
from commission.site.quantity import counted_text

TOLERANCE = 0.001
"""Distance [m] between a curve and its chords: a fiftieth of a map's usual cell."""
SEGMENT_LIMIT = 10_000_000
"""Segments of a drawing after its blocks are expanded; each takes 36 bytes."""
INSERT_LIMIT = 200_000
"""Blocks inserted, each repetition counted."""
DEPTH_LIMIT = 32
"""Blocks within blocks."""

_INSERTS_PER_REPORT = 1000
_TOLD = 3
"""Reasons that are told where there is nothing to draw."""
_DRAWN = {b"LINE", b"LWPOLYLINE", b"POLYLINE", b"ARC", b"CIRCLE", b"ELLIPSE", b"SPLINE", b"INSERT"} | {
    b"MLINE",
    b"SOLID",
    b"TRACE",
    b"3DFACE",
    b"HATCH",
}
_PARTS = {b"VERTEX", b"SEQEND", b"ATTRIB", b"ENDBLK", b"ENDSEC"}
_BLIND_TOLERANCE = 0.02
"""Tolerance in drawing units while the unit is unknown: 20 mm if they are metres, not too fine if millimetres."""


@dataclass(frozen=True, slots=True)
class DrawingLayer:
    """One layer of a drawing."""

    name: str
    """Its name."""
    is_visible: bool
    """Whether it is switched on and thawed."""
    segments: int
    """Segments on it."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Drawing:
    """The lines of a drawing."""

    path: Path
    """Where it comes from."""
    unit: str
    """Unit in which it was drawn."""
    layers: tuple[DrawingLayer, ...]
    """Layers that hold lines."""
    segments: FloatArray
    """(N, 2, 2) start and end points [m]."""
    layer_of: NDArray[np.int32]
    """(N,) index of each segment's layer."""
    warnings: tuple[str, ...]
    """What was left out or assumed, one line each."""

    def on(self, layers: Collection[str] | None = None) -> FloatArray:
        """Segments on the named layers, on all visible ones when None: (M, 2, 2) array [m].

        Raises UsageError, which names the layers that there are, for a name that is none of them.
        """
        names = [layer.name for layer in self.layers]
        for name in layers or ():
            if name not in names:
                raise UsageError(f"no layer is called {name!r}; the drawing has: {', '.join(map(shown, names[:20]))}")
        chosen = [layer.is_visible if layers is None else layer.name in layers for layer in self.layers]
        return self.segments[np.array(chosen, dtype=np.bool_)[self.layer_of]]

    def floor_map(
        self, resolution: float, layers: Collection[str] | None = None, progress: Progress = silent
    ) -> FloorMap:
        """Outline of what is on some layers, see `outline_map`.

        Parameters
        ----------
        resolution : edge of a cell [m].
        layers : names; all visible ones when None.
        progress : told how far it is; may raise to cancel.
        """
        segments = self.on(layers)
        if not len(segments):
            why = f" ({'; '.join(self.warnings[:_TOLD])})" if self.warnings else ""
            raise FileFormatError(self.path, "", f"holds no lines to draw{why}", "at least one on the chosen layers")
        return outline_map(segments, resolution, self.path, progress)


def read_drawing(path: Path, *, unit: str | None = None, progress: Progress = silent) -> Drawing:
    """Read the lines of a drawing.

    Parameters
    ----------
    path : DXF file, text or binary, of any version.
    unit : key of `UNITS` in which it was drawn; what the drawing states when None, else judged by its size.
    progress : told how far the reading is; may raise to cancel.

    Returns
    -------
    drawing : all layers; curves are cut into chords within TOLERANCE.

    Raises
    ------
    FileFormatError
        the file is no DXF, ends before its entities do, or is too large. An entity that cannot be read is passed over
        and counted.
    UsageError
        the unit is unknown.
    """
    if unit is not None and unit not in UNITS:
        raise UsageError(f"unit is {unit!r}; expected one of: {', '.join(UNITS)}")
    reader = _Reader(path, unit, progress)
    for group in read_groups(path, reader.report):
        reader.take(group)
    reader.finish()
    return reader.drawing()


@dataclass(frozen=True, slots=True)
class _Block:
    """Content of a block, in its own coordinates."""

    base: tuple[float, float]
    content: list[tuple[str, Shape | Insert]]
    file: str
    """Drawing in which the content is, of an external reference; else empty."""


class _Reader:
    """Takes a drawing's groups in the order of the file."""

    def __init__(self, path: Path, unit: str | None, progress: Progress) -> None:
        self._path = path
        self._progress = progress
        self._fraction = 0.0
        self._unit = None if unit is None else (unit, UNITS[unit])
        self._is_unit_chosen = unit is not None
        self._has_entities = self._has_end = False
        self._found = Findings()
        self._blocks: dict[str, _Block] = {}
        self._off: set[str] = set()
        self._frozen: set[str] = set()
        self._left_out: Counter[str] = Counter()
        self._section = ""
        self._block: _Block | None = None
        self._polyline: tuple[DxfGroup, list[DxfGroup]] | None = None
        self._coordinates = array("d")
        self._layers = array("i")
        self._names: dict[str, int] = {}
        self._inserts = 0

    def report(self, fraction: float, message: str) -> None:
        """Tell how much of the file is read."""
        self._fraction = fraction
        self._progress(fraction, message)

    def take(self, group: DxfGroup) -> None:
        """Take the next group."""
        if self._polyline is not None and group.kind == b"VERTEX":
            self._polyline[1].append(group)
            return
        self._draw_polyline()
        if group.kind == b"SECTION":
            self._section = group.name(2).upper()
            if self._section == "HEADER":
                self._read_header(group)
        elif self._section == "TABLES" and group.kind == b"LAYER":
            self._read_layer(group)
        elif self._section == "BLOCKS" and group.kind == b"BLOCK":
            self._open_block(group)
        elif group.kind == b"EOF":
            self._has_end = True
        elif self._section in ("BLOCKS", "ENTITIES") and group.kind not in _PARTS:
            self._take_entity(group)
        elif self._section == "ENTITIES" and group.kind == b"ENDSEC":
            self._has_entities = True

    def finish(self) -> None:
        """Take note that the file has ended; raises FileFormatError where its entities are not complete."""
        self._draw_polyline()
        if not self._has_end and not self._has_entities:
            raise FileFormatError(self._path, "", "ends before its entities do", "a complete DXF drawing")
        if not self._has_end:
            self._found.add("", "the end mark EOF is missing; what comes before it was read")

    def _draw_polyline(self) -> None:
        """Draw the polyline whose vertices have come one by one."""
        if self._polyline is not None:
            polyline, vertices = self._polyline
            self._polyline = None
            self._add(polyline, vertices)

    def drawing(self) -> Drawing:
        """Everything that was taken."""
        segments = np.frombuffer(self._coordinates, dtype=np.float64).reshape(-1, 2, 2)
        layer_of = np.frombuffer(self._layers, dtype=np.int32)
        width, height = np.ptp(segments.reshape(-1, 2), axis=0).tolist() if len(segments) else (0.0, 0.0)
        unit, metres = self._unit or (judged_unit((width, height)), 0.0)
        metres = metres or UNITS[unit]
        if not self._is_unit_chosen and len(segments):
            doubt = doubts((width, height), unit, metres, is_stated=self._unit is not None)
            if doubt:
                self._found.add("", doubt)
        for kind, count in self._left_out.most_common():
            what = counted_text(count, "entity", "entities")
            self._found.add("", f"left out as no walls, or not understood: {what} of kind {shown(kind)}")
        counts = np.bincount(layer_of, minlength=len(self._names)).tolist()
        layers = tuple(DrawingLayer(name, self._is_visible(name), counts[i]) for name, i in self._names.items())
        return Drawing(
            path=self._path,
            unit=unit,
            layers=layers,
            segments=read_only(segments * metres),
            layer_of=read_only(layer_of),
            warnings=self._found.lines(),
        )

    def _is_visible(self, layer: str) -> bool:
        return layer.upper() not in self._off | self._frozen

    def _read_header(self, group: DxfGroup) -> None:
        """Unit of the drawing; a header is one group of names (code 9), each with its value behind it."""
        for (code, name), (_, value) in itertools.pairwise(group.tags):
            if code == 9 and name == b"$INSUNITS" and self._unit is None and value.isdigit():
                self._unit = stated_unit(int(value[:6]))

    def _read_layer(self, group: DxfGroup) -> None:
        try:
            is_frozen, is_off = group.whole(70) & 1, group.whole(62, 7) < 0
        except ValueError:
            is_frozen, is_off = 0, False
        # Names of layers are told apart without regard to upper and lower case.
        if is_frozen:
            self._frozen.add(group.name(2).upper())
        if is_off:
            self._off.add(group.name(2).upper())

    def _open_block(self, group: DxfGroup) -> None:
        try:
            base = (group.number(10), group.number(20))
        except ValueError:
            base = (0.0, 0.0)
        try:
            # 4: an external reference, 8: one that lies over the drawing; its content is in another file.
            file = group.name(1) or "unnamed" if group.whole(70) & (4 | 8) else ""
        except ValueError:
            file = ""
        self._block = _Block(base, [], file)
        self._blocks[group.name(2).upper()] = self._block

    def _take_entity(self, group: DxfGroup) -> None:
        """Draw an entity, or keep it in the block that is open."""
        if group.kind not in _DRAWN:
            self._left_out[text_of(group.kind)[:40]] += 1
        elif group.kind == b"POLYLINE":
            self._polyline = (group, [])
        else:
            self._add(group, ())

    def _add(self, group: DxfGroup, vertices: Sequence[DxfGroup]) -> None:
        try:
            # What lies on a sheet of paper (67) or is invisible (60) is no part of the hall.
            if group.whole(67) or group.whole(60):
                return
            if group.kind == b"POLYLINE" and group.whole(70) & (16 | 64):
                self._left_out["POLYLINE (mesh)"] += 1
                return
            content = [insert_of(group)] if group.kind == b"INSERT" else list(shapes_of(group, vertices))
            layer = group.name(8) or "0"
            if self._section == "BLOCKS":
                if self._block is not None:
                    self._block.content.extend((layer, part) for part in content)
                return
            for part in content:
                self._draw(part, layer, Affine(), 0)
        except (ValueError, KeyError, OverflowError, ZeroDivisionError, IndexError, TypeError) as error:
            self._found.add(f"line {group.line}", f"{text_of(group.kind)} cannot be read ({type(error).__name__})")

    def _draw(self, part: Shape | Insert, layer: str, to: Affine, depth: int) -> None:
        if isinstance(part, Insert):
            self._expand(part, layer, to, depth)
            return
        points = part.chords(to, TOLERANCE / self._unit[1] if self._unit is not None else _BLIND_TOLERANCE)
        number = self._names.setdefault(layer, len(self._names))
        for (x1, y1), (x2, y2) in itertools.pairwise(points):
            if not abs(x1) + abs(y1) + abs(x2) + abs(y2) < 1e12:
                raise OverflowError("coordinates are too large")
            self._coordinates.extend((x1, y1, x2, y2))
            self._layers.append(number)
        if len(self._layers) > SEGMENT_LIMIT:
            problem = f"has over {SEGMENT_LIMIT} line segments once its blocks are expanded"
            raise FileFormatError(self._path, "", problem, "a drawing of the walls alone")

    def _expand(self, insert: Insert, layer: str, to: Affine, depth: int) -> None:
        """Draw the content of a block as often as it is inserted.

        What is on layer 0 in it takes the insert's layer. An insert on a frozen layer is hidden as a whole (on one that
        is only switched off, it is not): all of its content then counts as being on that layer.
        """
        block = self._blocks.get(insert.block.upper())
        if block is None or depth >= DEPTH_LIMIT:
            problem = "does not exist" if block is None else f"is nested over {DEPTH_LIMIT} deep, or in itself"
            self._found.add(f"block {shown(insert.block)}", problem)
            return
        if block.file and not block.content:
            remedy = "bind it in the CAD program (XREF, Bind), and save the drawing again"
            problem = f"is in another file, {shown(block.file)}, which is not read: {remedy}"
            self._found.add(f"block {shown(insert.block)}", problem)
        is_frozen = layer.upper() in self._frozen
        for index in range(insert.rows * insert.columns):
            self._inserts += 1
            if self._inserts % _INSERTS_PER_REPORT == 0:
                self._progress(self._fraction, "expanding blocks")
            if self._inserts > INSERT_LIMIT:
                problem = f"inserts blocks over {INSERT_LIMIT} times"
                raise FileFormatError(self._path, f"block {shown(insert.block)}", problem, "fewer")
            row, column = divmod(index, insert.columns)
            shift = Affine(
                x0=row * insert.row_step[0] + column * insert.column_step[0],
                y0=row * insert.row_step[1] + column * insert.column_step[1],
            )
            base = Affine(x0=-block.base[0], y0=-block.base[1])
            inner = to.after(shift).after(insert.to).after(base)
            if not math.isfinite(inner.xx + inner.xy + inner.yx + inner.yy + inner.x0 + inner.y0):
                raise OverflowError("the block is scaled beyond numbers")
            for own, part in block.content:
                self._draw(part, layer if own == "0" or is_frozen else own, inner, depth + 1)
