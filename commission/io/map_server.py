"""Floor maps in the format of ROS `map_server`: a YAML file that describes a PGM, PNG or BMP image, read and written.

Semantics are those of ROS 1 `image_loader.cpp` and Nav2 `map_io.cpp`: occupancy is p = (255 - v) / 255 of a pixel's
gray value v, or v / 255 when negated; p > occupied_thresh is occupied, p < free_thresh is free, the rest is unknown.
One deviation: an image of the three grays that `map_saver` writes says itself what is unknown (205), which Nav2's own
free_thresh of 0.25 would make free.
"""

from __future__ import annotations

import io
import math
import struct
import warnings
import zlib
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path, PurePath, PureWindowsPath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from commission.errors import FileFormatError, reason_of
from commission.io.atomic import write_bytes, write_text
from commission.io.conversion import convert
from commission.io.findings import Findings, shown
from commission.io.reading import check_size, inside
from commission.io.yaml_document import YamlDocument, read_yaml
from commission.site.checks import above, between
from commission.site.fields import in_file
from commission.site.floor_map import FREE, MOST_CELLS, OCCUPIED, UNKNOWN, FloorMap

CELL_LIMIT = MOST_CELLS
"""Cells of a map, known from the image's header before its pixels are unpacked."""
FILE_LIMIT = 512_000_000
"""Bytes of an image: a text PGM needs up to 6 bytes for each cell."""

_GRAY = {FREE: 254, OCCUPIED: 0, UNKNOWN: 205}
"""Gray values that ROS `map_saver` writes."""
_ROWS_AT_ONCE = 256
_ENDINGS = (".pgm", ".png", ".bmp")


class MapMode(StrEnum):
    """How gray values become cells."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapDescription:
    """Content of a `map_server` YAML file."""

    image: str
    """Image file (PGM, PNG or BMP), relative to this file."""
    resolution: float
    """Edge of a pixel [m]."""
    origin: tuple[float, float, float]
    """Pose of the lower-left corner of the lower-left pixel in the map frame [m, m, rad]."""
    negate: bool | int = 0
    """1: white is occupied; 0: black is occupied."""
    occupied_thresh: float = 0.65
    """Occupancy above which a cell is occupied [0..1]."""
    free_thresh: float = 0.196
    """Occupancy below which a cell is free [0..1]."""
    mode: MapMode = MapMode.TRINARY
    """`trinary`, `scale` (transparent pixels are unknown) or `raw` (gray value = occupancy in percent)."""

    def __post_init__(self) -> None:
        if not self.image:
            raise ValueError("image is empty; expected the name of a PGM, PNG or BMP file")
        above(self.resolution, 0.0, "resolution", "metres per pixel")
        for axis, value in zip("xy", self.origin[:2], strict=True):
            between(value, (-1e7, 1e7), f"origin {axis}", "m")
        between(self.origin[2], (-2.0 * math.pi, 2.0 * math.pi), "origin yaw", "rad")
        between(self.negate, (0, 1), "negate")
        between(self.occupied_thresh, (0.0, 1.0), "occupied_thresh")
        between(self.free_thresh, (0.0, 1.0), "free_thresh")
        if self.free_thresh > self.occupied_thresh:
            raise ValueError(f"free_thresh is {self.free_thresh:g}; expected at most occupied_thresh")


def image_name(path: Path) -> str:
    """Return what a `map_server` YAML file calls its image, without folders; raises FileFormatError as reading does."""
    return PurePath(_description(path)[1].image.replace("\\", "/")).name


def read_floor_map(
    path: Path, folder: Path | None = None, *, image: Path | None = None, found: Findings | None = None
) -> FloorMap:
    """Read a `map_server` map.

    Parameters
    ----------
    path : the YAML file.
    folder : folder that the image must lie in; the YAML file's own when None.
    image : the image, where it does not lie under the name that the YAML file gives it.
    found : takes what was doubted: an image that lies elsewhere, thresholds that make unknown cells free.

    Returns
    -------
    floor_map : cells are occupied, free or unknown; what `scale` and `raw` maps hold between the thresholds is unknown.

    Raises
    ------
    FileFormatError
        names file, key, what was found and what is expected.
    """
    document, description = _description(path)
    found = Findings() if found is None else found
    image_path = image or _image_beside(document, description, folder, found)
    cells = _read_cells(image_path, description, found)
    try:
        return FloorMap(np.flipud(cells), description.resolution, np.array(description.origin))
    except ValueError as error:
        raise _from_value_error(document, error) from error


def write_floor_map(floor_map: FloorMap, path: Path) -> None:
    """Write a map as YAML beside a PNG of the same name; the image first, so that no YAML names a missing one.

    Parameters
    ----------
    floor_map : what to write; reading it again gives an equal one, but for the rounding of files.
    path : the YAML file.
    """
    gray = np.full(floor_map.cells.shape, _GRAY[UNKNOWN], dtype=np.uint8)
    gray[floor_map.cells == FREE] = _GRAY[FREE]
    gray[floor_map.cells == OCCUPIED] = _GRAY[OCCUPIED]
    image = io.BytesIO()
    Image.fromarray(np.flipud(gray)).save(image, format="PNG", optimize=True)
    image_path = path.with_suffix(".png")
    write_bytes(image_path, image.getvalue())
    placed = in_file(floor_map)
    x, y, yaw = (repr(float(v)) for v in placed.origin)
    write_text(
        path,
        f"image: {image_path.name}\n"
        f"resolution: {float(placed.resolution)!r}  # metres per pixel\n"
        f"origin: [{x}, {y}, {yaw}]  # x [m], y [m], yaw [rad] of the lower-left corner\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n",
    )


def _description(path: Path) -> tuple[YamlDocument, MapDescription]:
    document = read_yaml(path)
    return document, convert(document, MapDescription, ignore_unknown=True)


def _image_beside(document: YamlDocument, description: MapDescription, folder: Path | None, found: Findings) -> Path:
    """Path of the image that a YAML file names; raises FileFormatError when there is none.

    A map that was made on another computer often names its image by an absolute path there: then the file of that name
    beside the YAML file is meant.
    """
    path = document.path
    name = PurePath(description.image.replace("\\", "/")).name
    is_absolute = Path(description.image).is_absolute() or PureWindowsPath(description.image).is_absolute()
    if is_absolute and name and (path.parent / name).is_file():
        found.add("", f"the image {shown(description.image)} is not read; {name} beside {path.name} is taken")
        return path.parent / name
    image_path = inside(folder or path.parent, description.image, path, document.place(("image",)))
    if not image_path.is_file():
        beside = sorted(p.name for p in path.parent.iterdir() if p.suffix.lower() in _ENDINGS)
        remedy = f"an existing image; beside it there are: {', '.join(beside[:5])}" if beside else "an existing image"
        raise document.error(("image",), f"{description.image!r} does not exist", remedy)
    return image_path


def _from_value_error(document: YamlDocument, error: ValueError) -> FileFormatError:
    problem, _, remedy = str(error).partition("; expected ")
    return document.error((), problem, remedy)


def _read_cells(path: Path, description: MapDescription, found: Findings) -> NDArray[np.int8]:
    """(H, W) cells of an image, top row first."""
    check_size(path, FILE_LIMIT)
    try:
        with warnings.catch_warnings():
            # Pillow warns about images that it thinks large; the limit that counts is CELL_LIMIT.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(path, formats=("PNG", "PPM", "BMP")) as image:
                width, height = image.size
                if not 0 < width * height <= CELL_LIMIT:
                    problem = f"has {width} x {height} pixels"
                    raise FileFormatError(path, "", problem, f"1 to {CELL_LIMIT} pixels")
                return _classify(image, description, found)
    except FileFormatError:
        raise
    except Image.DecompressionBombError as error:
        raise FileFormatError(path, "", "is too large", f"1 to {CELL_LIMIT} pixels") from error
    except (OSError, ValueError, SyntaxError, EOFError, OverflowError, struct.error, zlib.error, IndexError) as error:
        # What Pillow raises for garbage and for files that end early depends on format and place.
        raise FileFormatError(
            path, "", f"is no readable image ({why_no_image(error, path)})", "a complete PGM, PNG or BMP"
        ) from error


def why_no_image(error: Exception, path: Path) -> str:
    """Say what is wrong with a file that is to be an image, without where it lies: an upload lies nowhere.

    Parameters
    ----------
    error : what Pillow raised.
    path : of the file.
    """
    if not isinstance(error, UnidentifiedImageError):
        return reason_of(error)
    return "it is none by its content" if path.stat().st_size else "it is empty, 0 bytes"


def _classify(image: Image.Image, description: MapDescription, found: Findings) -> NDArray[np.int8]:
    """Turn pixels into cells, some rows at a time: no copy of the whole image in floating point."""
    opaque: NDArray[np.bool_] | None = None
    if image.mode in ("P", "1", "PA") or "transparency" in image.info:
        image = image.convert("RGBA" if "transparency" in image.info or image.mode == "PA" else "RGB")
        if image.mode == "RGB" and all(band.tobytes() == image.getchannel(0).tobytes() for band in image.split()[1:]):
            # A palette of grays: that it has one is how the file was saved, not what it shows.
            image = image.getchannel(0)
    if image.mode == "F":
        raise ValueError("gray values are floating-point numbers")
    pixels = np.asarray(image)
    full_scale = 65535.0 if pixels.dtype != np.uint8 else 255.0
    if image.mode in ("LA", "RGBA"):
        opaque = pixels[..., -1] == 255
        pixels = pixels[..., :-1]
    cells = np.empty(pixels.shape[:2], dtype=np.int8)
    saved = _is_saved_by_map_saver(pixels, description)
    for start in range(0, len(cells), _ROWS_AT_ONCE):
        rows = slice(start, start + _ROWS_AT_ONCE)
        gray = pixels[rows] if pixels.ndim == 2 else pixels[rows].mean(axis=2)
        cells[rows] = _cells_of(gray.astype(np.float64) / full_scale, description)
        if saved:
            cells[rows][gray == _GRAY[UNKNOWN] * (full_scale / 255.0)] = UNKNOWN
        if opaque is not None and description.mode is MapMode.SCALE:
            cells[rows][~opaque[rows]] = UNKNOWN
    if saved and (count := int(np.count_nonzero(cells == UNKNOWN))):
        problem = f"free_thresh {description.free_thresh:g} would make {count} unknown cells (gray 205) free"
        found.add("", f"{problem}; they stay unknown, as the program that saved the map means them")
    return cells


def _is_saved_by_map_saver(pixels: NDArray[Any], description: MapDescription) -> bool:
    """Whether the image says itself what is unknown, and thresholds would hide it.

    `map_saver` writes the grays 0, 205 and 254; 205 is an occupancy of 0.196, below Nav2's free_thresh of 0.25.
    """
    unknown = 1.0 - _GRAY[UNKNOWN] / 255.0
    hidden = not description.negate and description.free_thresh > unknown and description.mode is MapMode.TRINARY
    if not hidden or pixels.ndim != 2:
        return False
    # An image of 16 bits that was made of one of 8 has each gray 257 times.
    once = 1 if pixels.dtype == np.uint8 else 257
    grays = np.flatnonzero(np.bincount(np.clip(pixels, 0, 65535).reshape(-1)))
    return set(grays.tolist()) <= {once * gray for gray in (*_GRAY.values(), 255)}


def _cells_of(brightness: NDArray[np.float64], description: MapDescription) -> NDArray[np.int8]:
    """Cells of gray values in [0, 1]."""
    occupancy = brightness if description.negate else 1.0 - brightness
    beyond = np.zeros(occupancy.shape, dtype=np.bool_)
    if description.mode is MapMode.RAW:
        # A raw pixel is the cell's occupancy in percent; more than 100 (205, 255) is how ROS stores unknown.
        percent = np.rint((1.0 - occupancy if description.negate else brightness) * 255.0)
        beyond = percent > OCCUPIED
        occupancy = percent / 100.0
    cells = np.full(occupancy.shape, UNKNOWN, dtype=np.int8)
    cells[occupancy > description.occupied_thresh] = OCCUPIED
    cells[occupancy < description.free_thresh] = FREE
    cells[beyond] = UNKNOWN
    return cells
