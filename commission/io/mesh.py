"""Floor plans from 3D models (STL, OBJ, GLB, PLY): a horizontal section, such as a scanner sees at its height.

trimesh reads the files; the section is cut here, in pieces, so that it reports progress and can be cancelled.
"""

from __future__ import annotations

import struct
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from commission.errors import FileFormatError, UsageError, reason_of
from commission.geometry.arrays import FloatArray, read_only
from commission.io.dxf_units import UNITS
from commission.io.glb_header import check_announced
from commission.io.outline import outline_map
from commission.io.reading import cannot_read, check_size
from commission.progress import Progress, silent
from commission.site.floor_map import FloorMap
from commission.site.quantity import number_text

SIZE_LIMIT = 512_000_000
"""Bytes of a model."""
FACE_LIMIT = 10_000_000
"""Triangles of a model, each repetition of a part counted; each takes 72 bytes."""
KINDS = ("stl", "obj", "glb", "ply")

_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_SCANNER_HEIGHT = 0.2
"""Height of a safety scanner above its floor [m]."""
_FACES_AT_ONCE = 200_000
_BYTES_AT_ONCE = 4_000_000
_LOOK_S = 0.05
"""Time between two looks at how far trimesh is [s]."""
# What trimesh, numpy and struct raise for files that are not what they claim to be depends on format and place.
_GARBAGE = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    NameError,
    ArithmeticError,
    AssertionError,
    NotImplementedError,
    ImportError,
    MemoryError,
    RecursionError,
    EOFError,
    struct.error,
)


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """A 3D model of a hall."""

    path: Path
    """Where it comes from."""
    triangles: FloatArray
    """(N, 3, 3) corners [m], z up, z = 0 the model's own zero."""
    is_y_up: bool = False
    """Whether the file was read with y pointing up."""

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest x, y, z: (2, 3) array [m]."""
        points = self.triangles.reshape(-1, 3)
        return np.array([points.min(axis=0), points.max(axis=0)])

    def _advice(self, low: float, high: float) -> str:
        """What to try where no section meets the model: its own floor, or the other axis as the one that points up."""
        if low < -1.0 and high <= 0.0:
            # A hall that was drawn with y up lies below the floor once z is taken for up.
            other = "z" if self.is_y_up else "y"
            return f" (--height); or it was made with {other} up (--up {other})"
        return f", such as --height {low + _SCANNER_HEIGHT:.6g}"

    def section(self, height: float, progress: Progress = silent) -> FloatArray:
        """Cut the model by a horizontal plane.

        Parameters
        ----------
        height : height of the plane [m].
        progress : told how far the cutting is; may raise to cancel.

        Returns
        -------
        segments : (M, 2, 2) array [m]. A point in the plane counts as above it, so that a closed body gives closed
            outlines, whatever lies in the plane.
        """
        pieces: list[FloatArray] = [np.empty((0, 2, 2))]
        for start in range(0, len(self.triangles), _FACES_AT_ONCE):
            progress(start / len(self.triangles), f"cutting at {height:g} m")
            pieces.append(_cut(self.triangles[start : start + _FACES_AT_ONCE], height))
        progress(1.0, f"cutting at {height:g} m")
        return np.concatenate(pieces)

    def floor_map(self, heights: tuple[float, ...], resolution: float, progress: Progress = silent) -> FloorMap:
        """Outline of a model's sections, see `outline_map`.

        Parameters
        ----------
        heights : one or several [m].
        resolution : edge of a cell [m].
        progress : told how far it is; may raise to cancel.
        """
        segments = [self.section(height, progress) for height in heights]
        if not any(map(len, segments)):
            (_, _, low), (_, _, high) = self.bounds.tolist()
            at = " or ".join(f"{height:g}" for height in heights)
            reach = f"{number_text(low, 6)} to {number_text(high, 6)} m"
            problem = f"reaches from z = {reach}; a section at {at} m meets none of it"
            raise FileFormatError(self.path, "", problem, f"a height within the model{self._advice(low, high)}")
        return outline_map(np.concatenate([np.empty((0, 2, 2)), *segments]), resolution, self.path, progress)


def read_model(path: Path, *, unit: str | None = None, y_up: bool | None = None, progress: Progress = silent) -> Model:
    """Read a model.

    Parameters
    ----------
    path : file; its ending says which format it has.
    unit : key of `UNITS` in which it was made; metres when None, as GLB demands (which not every program heeds).
    y_up : whether y points up, as GLB demands; that for GLB and z for the others when None.
    progress : told how far the reading is; may raise to cancel.

    Raises
    ------
    FileFormatError
        another ending, a file too large or not of its format, no triangles, or one that is not finite.
    UsageError
        the unit is unknown.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in KINDS:
        raise FileFormatError(path, "", f"ends in {path.suffix!r}", f"a model: {', '.join(f'.{k}' for k in KINDS)}")
    if unit is not None and unit not in UNITS:
        raise UsageError(f"unit is {unit!r}; expected one of: {', '.join(UNITS)}")
    check_size(path, SIZE_LIMIT)
    try:
        with path.open("rb") as file:
            if kind == "glb":
                check_announced(path, file, FACE_LIMIT)
            loaded = _loaded(_Reported(file, path.stat().st_size), kind, progress)
            is_y_up = kind == "glb" if y_up is None else y_up
            to_model = (_Y_UP if is_y_up else np.eye(3)) * UNITS[unit or "m"]
            triangles = _triangles(path, loaded, to_model, progress)
    except OSError as error:
        raise cannot_read(path, error) from error
    except _GARBAGE as error:
        raise FileFormatError(
            path, "", f"is no readable {kind.upper()} ({reason_of(error)})", "a complete model"
        ) from error
    return Model(path, triangles, is_y_up)


class _Reported:
    """A file that knows how much of it has been read, and ends when nobody wants it any more."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file = file
        self._size = max(size, 1)
        self.share = 0.0
        """Part that has been read [0..1]."""
        self.is_wanted = True
        """Whether reading goes on."""
        self.mode = "rb"

    def read(self, count: int = -1) -> bytes:
        """Read in pieces, however much is asked for."""
        wanted = self._size if count is None or count < 0 else min(count, self._size)
        pieces: list[bytes] = []
        while wanted > 0 and (piece := self._file.read(min(wanted, _BYTES_AT_ONCE))):
            if not self.is_wanted:
                raise EOFError("nobody wants the model any more")
            pieces.append(piece)
            wanted -= len(piece)
            self.share = self._file.tell() / self._size
        return b"".join(pieces)

    def readline(self, limit: int = -1) -> bytes:
        """Next line."""
        return self._file.readline(limit)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Move to a byte."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Byte that is read next."""
        return self._file.tell()

    def close(self) -> None:
        """Nothing: the file is closed by whoever opened it."""


def _loaded(source: _Reported, kind: str, progress: Progress) -> Any:
    """What trimesh makes of a file.

    trimesh asks nobody while it makes triangles of what it has read, for seconds with a large file. So it works on a
    thread of its own, which is left alone when the work is cancelled: it ends by itself, and nobody takes what it made.
    """
    made: list[Any] = []
    failed: list[Exception] = []

    def load() -> None:
        import trimesh

        try:
            # No resolver: a model refers to no other files. No materials: pictures are not decoded.
            made.append(trimesh.load(source, file_type=kind, process=False, skip_materials=True))  # type: ignore[arg-type]
        except (OSError, *_GARBAGE) as error:
            failed.append(error)

    worker = threading.Thread(target=load, name="model", daemon=True)
    worker.start()
    try:
        while worker.is_alive():
            worker.join(_LOOK_S)
            reading = source.share < 1.0
            progress(0.5 * source.share, "reading the model" if reading else "making triangles")
    finally:
        source.is_wanted = False
    if failed:
        raise failed[0]
    if not made:
        raise ValueError("trimesh has failed")
    return made[0]


def _triangles(path: Path, loaded: Any, to_model: FloatArray, progress: Progress) -> FloatArray:
    """(N, 3, 3) corners of all parts of a model, each part as often as the scene shows it, turned and scaled."""
    import trimesh

    if isinstance(loaded, trimesh.Trimesh):
        parts = [(loaded, np.eye(4))]
    elif isinstance(loaded, trimesh.Scene):
        graph = loaded.graph
        placed = [graph.get(node) for node in graph.nodes_geometry]
        parts = [(loaded.geometry[name], transform) for transform, name in placed]
    else:
        parts = []
    meshes = [(part, np.asarray(transform)) for part, transform in parts if isinstance(part, trimesh.Trimesh)]
    count = sum(len(mesh.faces) for mesh, _ in meshes)
    if not 0 < count <= FACE_LIMIT:
        raise FileFormatError(path, "", f"has {count} triangles", f"1 to {FACE_LIMIT}")
    triangles = np.empty((count, 3, 3))
    done = 0
    for mesh, transform in meshes:
        points, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces)
        turn, shift = to_model @ transform[:3, :3], to_model @ transform[:3, 3]
        for start in range(0, len(faces), _FACES_AT_ONCE):
            progress(0.5 + 0.5 * done / count, "collecting triangles")
            some = points[faces[start : start + _FACES_AT_ONCE]] @ turn.T + shift
            if not np.isfinite(some).all():
                raise FileFormatError(path, "", "holds a corner that is not finite", "finite coordinates")
            triangles[done : done + len(some)] = some
            done += len(some)
    progress(1.0, "collecting triangles")
    return read_only(triangles)


def _cut(triangles: FloatArray, height: float) -> FloatArray:
    """(M, 2, 2) segments in which triangles meet the plane z = height."""
    above = triangles[:, :, 2] >= height
    crossing = triangles[above.any(axis=1) & ~above.all(axis=1)]
    above = crossing[:, :, 2] >= height
    # Turn each triangle so that the corner that is alone on its side comes first: both crossed edges begin there.
    is_alone = above == (above.sum(axis=1) == 1)[:, np.newaxis]
    alone = np.argmax(is_alone, axis=1)
    rows = np.arange(len(crossing))
    tip = crossing[rows, alone]
    ends = []
    for step in (1, 2):
        other = crossing[rows, (alone + step) % 3]
        part = (height - tip[:, 2]) / (other[:, 2] - tip[:, 2])
        ends.append(tip[:, :2] + part[:, np.newaxis] * (other[:, :2] - tip[:, :2]))
    return np.stack(ends, axis=1)
