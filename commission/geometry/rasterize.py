"""Line segments drawn into a grid: every cell that a segment touches. Not where the grid lies, nor what it means."""

from __future__ import annotations

import numpy as np

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray


@compiled
def draw_segments(cells: BoolArray, segments: FloatArray) -> None:
    """Set each cell that a segment touches.

    Parameters
    ----------
    cells : (H, W) array, changed in place; cell (row, column) covers [column, column + 1) x [row, row + 1).
    segments : (N, 4) array of x1, y1, x2, y2 [cells]; what lies outside the grid is cut off, NaN draws nothing.

    Notes
    -----
    x = x1 + (y - y1) (x2 - x1) / (y2 - y1) where the segment enters and leaves a row, by definition of a line; the
    columns between are touched. Computed from the segment's ends, never accumulated, so that a long segment is as exact
    as a short one.
    """
    rows, columns = cells.shape
    for i in range(segments.shape[0]):
        x1, y1, x2, y2 = segments[i]
        if y1 > y2:
            x1, y1, x2, y2 = x2, y2, x1, y1
        # Comparisons with NaN are false, so a segment with one ends here.
        if not (y2 >= 0.0 and y1 < rows and max(x1, x2) >= 0.0 and min(x1, x2) < columns):
            continue
        slope = (x2 - x1) / (y2 - y1) if y2 > y1 else 0.0
        first, last = int(max(y1, 0.0)), int(min(y2, rows - 1.0))
        for row in range(first, last + 1):
            enter = x1 if row <= y1 else x1 + (row - y1) * slope
            leave = x2 if row + 1 >= y2 else x1 + (row + 1 - y1) * slope
            low, high = min(enter, leave), max(enter, leave)
            if high >= 0.0 and low < columns:
                for column in range(int(max(low, 0.0)), int(min(high, columns - 1.0)) + 1):
                    cells[row, column] = True


def warm_up() -> None:
    """Compile the kernel."""
    draw_segments(np.zeros((1, 1), dtype=np.bool_), np.zeros((1, 4)))
