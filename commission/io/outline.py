"""Floor maps from line segments, whatever file they come from: cells that a segment touches are walls, others free."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray
from commission.geometry.rasterize import draw_segments
from commission.io.map_server import CELL_LIMIT
from commission.progress import Progress, silent
from commission.site.floor_map import FREE, OCCUPIED, FloorMap

MARGIN = 1.0
"""Free floor around the outline [m]."""
_CELLS_AT_ONCE = 20_000_000
"""Cells drawn between two reports of progress: a tenth of a second."""


def outline_map(segments: FloatArray, resolution: float, path: Path, progress: Progress = silent) -> FloorMap:
    """Draw segments into a map just large enough for them.

    Parameters
    ----------
    segments : (N, 2, 2) array of start and end points [m, map frame].
    resolution : edge of a cell [m]; cell borders lie at whole multiples of it.
    path : where the segments come from, for messages.
    progress : told how far the drawing is; may raise to cancel.

    Returns
    -------
    floor_map : upright in the map frame, with a margin of 1 m.

    Raises
    ------
    FileFormatError
        there are no segments, or so large an extent that the map would have too many cells.
    ValueError
        the resolution is not positive.
    """
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise ValueError(f"resolution is {resolution:g}; expected metres per cell > 0")
    if not len(segments):
        raise FileFormatError(path, "", "holds no lines to draw", "at least one on the chosen layers or at that height")
    points = segments.reshape(-1, 2)
    low = np.floor((points.min(axis=0) - MARGIN) / resolution)
    high = np.ceil((points.max(axis=0) + MARGIN) / resolution)
    columns, rows = (high - low).tolist()
    if not rows * columns <= CELL_LIMIT:
        width, height = np.ptp(points, axis=0)
        problem = f"measures {width:.6g} x {height:.6g} m, {rows * columns:.3g} cells of {resolution:g} m"
        remedy = f"at most {CELL_LIMIT} cells: a coarser resolution, another unit, or layers without stray lines"
        raise FileFormatError(path, "", problem, remedy)
    occupied = np.zeros((int(rows), int(columns)), dtype=np.bool_)
    flat = segments.reshape(-1, 4) / resolution - np.tile(low, 2)
    # Cells that each segment costs, so that a few long segments report as often as many short ones.
    effort = np.cumsum(np.abs(flat[:, 2:] - flat[:, :2]).sum(axis=1) + 1.0)
    borders = np.searchsorted(effort, np.arange(_CELLS_AT_ONCE, effort[-1], _CELLS_AT_ONCE))
    bounds = [0, *borders.tolist(), len(flat)]
    for start, end in itertools.pairwise(bounds):
        progress(start / len(flat), "drawing the map")
        draw_segments(occupied, np.ascontiguousarray(flat[start:end]))
    progress(1.0, "drawing the map")
    cells = np.where(occupied, np.int8(OCCUPIED), np.int8(FREE))
    return FloorMap(cells, resolution, np.array([low[0] * resolution, low[1] * resolution, 0.0]))
