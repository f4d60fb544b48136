"""Coverage as files: arrays for scripts, a table for a spreadsheet, an image for a person, a summary. Writing only."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from commission.geometry.arrays import BoolArray
from commission.io.atomic import atomic_file, write_text
from commission.planning.coverage import Coverage

ARRAYS = "coverage.npz"
TABLE = "coverage.csv"
IMAGE = "coverage.png"
SUMMARY = "summary.json"

UNITS = {
    "visible": "",
    "position_sigma": "_m",
    "heading_sigma": "_rad",
    "position_dop": "",
    "heading_dop": "",
    "expected_visible": "",
    "two_or_more": "",
    "three_or_more": "",
}
"""What follows the name of each figure in the files."""

STOPS = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], dtype=np.float64)
"""Five colors of the map `viridis`, good to bad: readable in gray and by the color-blind."""
NO_FIX = (200, 60, 60)
"""Color of floor without a fix."""
NO_FLOOR = (25, 25, 28)
"""Color of walls and unknown ground."""
LARGEST_IMAGE_CELL = 8
ROWS_AT_ONCE = 50_000


def write_coverage(folder: Path, found: Coverage, drivable: BoolArray, summary: Mapping[str, float | None]) -> None:
    """Write `coverage.npz`, `coverage.csv`, `coverage.png` and `summary.json`; each is replaced whole or not at all.

    Parameters
    ----------
    folder : made when missing.
    found : figures of a fix over a lattice.
    drivable : (N,) which points are floor; the table and the image leave the others out.
    summary : by key; the last file written, so that where it is the others are complete.

    Raises
    ------
    FileFormatError
        a file cannot be written.
    """
    lattice = found.lattice
    arrays: dict[str, NDArray[np.generic]] = {
        "x": lattice.x + lattice.spacing * np.arange(lattice.columns),
        "y": lattice.y + lattice.spacing * np.arange(lattice.rows),
        "drivable": drivable.reshape(lattice.rows, lattice.columns),
    }
    arrays |= {name + unit: found.image(name) for name, unit in UNITS.items()}
    with atomic_file(folder / ARRAYS) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)
    _write_table(folder / TABLE, found, drivable)
    with atomic_file(folder / IMAGE) as file:
        heat_image(found, drivable).save(file, format="PNG")
    write_text(folder / SUMMARY, json.dumps(dict(summary), indent=2, allow_nan=False) + "\n")


def heat_image(found: Coverage, drivable: BoolArray) -> Image.Image:
    """Position error as a picture, north up: logarithmic from the 2 % to the 98 % quantile, dark is good."""
    sigma = found.fixes.position_sigma
    regular = drivable & np.isfinite(sigma)
    colors = np.empty((len(sigma), 3), dtype=np.uint8)
    colors[:] = np.where(drivable[:, np.newaxis], NO_FIX, NO_FLOOR)
    if regular.any():
        values = np.log(np.maximum(sigma[regular], 1e-12))
        low, high = np.quantile(values, (0.02, 0.98))
        at = np.clip((values - low) / max(high - low, 1e-9), 0.0, 1.0) * (len(STOPS) - 1)
        colors[regular] = np.stack([np.interp(at, np.arange(len(STOPS)), channel) for channel in STOPS.T], axis=-1)
    lattice = found.lattice
    image = Image.fromarray(np.ascontiguousarray(colors.reshape(lattice.rows, lattice.columns, 3)[::-1]))
    scale = max(1, min(LARGEST_IMAGE_CELL, 1600 // max(lattice.rows, lattice.columns)))
    return image.resize((lattice.columns * scale, lattice.rows * scale), Image.Resampling.NEAREST)


def _write_table(path: Path, found: Coverage, drivable: BoolArray) -> None:
    """Write one row per drivable point; a figure that is infinite is empty."""
    rows = np.flatnonzero(drivable)
    points = found.lattice.points()
    with atomic_file(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["x", "y", *(name + unit for name, unit in UNITS.items())])
        for start in range(0, len(rows), ROWS_AT_ONCE):
            block = rows[start : start + ROWS_AT_ONCE]
            columns = [_texts(points[block, axis]) for axis in range(2)]
            columns += [_texts(getattr(found.fixes, name)[block]) for name in UNITS]
            writer.writerows(zip(*columns, strict=True))
        text.flush()
        text.detach()


def _texts(values: NDArray[np.generic]) -> list[str]:
    """Six significant digits, empty where infinite."""
    return [f"{value:.6g}" if np.isfinite(value) else "" for value in values.tolist()]
