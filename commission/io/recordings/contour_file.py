"""`contour.csv` of a recording: control points of a planar contour that something else tracked in a camera's images.

Columns `stamp_ns,point,u,v`: time of the frame, name of the control point, and where it is in the image, u to the right
and v down from the principal point in focal lengths (or in pixels from the corner, with the camera's focal length and
principal point said to whoever reads it). Rows of one stamp are a frame; a point without u and v was not seen.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import Growing
from commission.io.csv_table import read_table
from commission.site.contour_track import ContourTrack

CONTOUR = "contour.csv"
CONTOUR_COLUMNS = ("stamp_ns", "point", "u", "v")


def read_contour(path: Path) -> ContourTrack:
    """Read the control points of all frames that show every point; rows may come in any order.

    Parameters
    ----------
    path : the table, or the folder of a recording that has one.

    Raises
    ------
    FileFormatError
        there is none, a cell is wrong, a point is twice in a frame, or no frame shows all points.
    """
    if path.is_dir():
        path /= CONTOUR
    if not path.is_file():
        raise FileFormatError(path, "", "does not exist", f"tracked control points: {','.join(CONTOUR_COLUMNS)}")
    stamps, values, names, lines = Growing(np.int64), Growing(np.float64, 2), list[str](), Growing(np.int64)
    for block in read_table(path, CONTOUR_COLUMNS, ignore_unknown=True, bytes_at_once=1_000_000):
        u, v = (block.numbers(column, "focal lengths or pixels", empty=np.nan) for column in ("u", "v"))
        half = np.flatnonzero(np.isnan(u) != np.isnan(v))
        if len(half):
            row = int(half[0])
            column = "u" if np.isnan(u[row]) else "v"
            raise block.error(row, column, "is empty", "u and v, or neither where the point was not seen")
        texts = block.texts("point")
        if "" in texts:
            raise block.error(texts.index(""), "point", "is empty", "the name of a control point")
        stamps.append(block.stamps())
        values.append(np.stack([u, v], axis=1))
        names.extend(texts)
        lines.append(np.array(block.lines))
    if not names:
        raise FileFormatError(path, "", "has no rows", "control points of at least two frames")
    points = tuple(dict.fromkeys(names))
    numbers = {name: index for index, name in enumerate(points)}
    frames, frame_of = np.unique(stamps.array(), return_inverse=True)
    cells = frame_of * len(points) + np.array([numbers[name] for name in names])
    order = np.argsort(cells, kind="stable")
    twice = np.flatnonzero(np.diff(cells[order]) == 0)
    if len(twice):
        row = int(order[twice[0] + 1])
        where = f"line {int(lines.array()[row])}, column point"
        raise FileFormatError(path, where, f"has {names[row]} again in one frame", "each point once for a stamp")
    if len(frames) * len(points) > 50 * len(names):
        raise FileFormatError(
            path, "", f"has {len(points)} points in {len(names)} rows", "the same points in each frame"
        )
    table = np.full((len(frames) * len(points), 2), np.nan)
    table[cells] = values.array()
    table = table.reshape(len(frames), len(points), 2)
    whole = np.isfinite(table).all(axis=(1, 2))
    if not whole.any():
        raise FileFormatError(path, "", f"no frame shows all {len(points)} points", "the same points in each frame")
    return ContourTrack(
        stamps_ns=frames[whole], points=table[whole], names=points, left_out=int(np.count_nonzero(~whole))
    )
