"""Coverage as files: arrays for scripts, a table for a spreadsheet, an image for a person, a summary. Writing only."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from commission.geometry.arrays import BoolArray
from commission.io.atomic import atomic_file, write_text
from commission.io.lattice_image import NO_FLOOR, lattice_image, shades
from commission.io.table_writer import angle, figure, place, write_table
from commission.planning.contour_coverage import ContourCoverage
from commission.planning.coverage import Coverage
from commission.planning.error_budget import CONTRIBUTIONS
from commission.planning.floor_budget import FloorBudget
from commission.planning.tag_coverage import TagCoverage
from commission.studies.coverage import CoverageResult, Ellipses

ARRAYS = "coverage.npz"
TABLE = "coverage.csv"
IMAGE = "coverage.png"
SUMMARY = "summary.json"
ELLIPSES = "ellipses.csv"
FILES = (ARRAYS, TABLE, IMAGE, SUMMARY, ELLIPSES)
"""All that may be written."""
ELLIPSE_COLUMNS = ("x", "y", "semi_major_m", "semi_minor_m", "angle_rad")

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

NO_FIX = (200, 60, 60)
"""Color of floor without a fix."""
ROWS_AT_ONCE = 50_000


def write_coverage(folder: Path, result: CoverageResult, summary: Mapping[str, float | None]) -> None:
    """Write `coverage.npz`, `coverage.csv`, `coverage.png` and `summary.json`; each is replaced whole or not at all.

    Parameters
    ----------
    folder : made when missing.
    result : figures over a lattice; table and image leave out what is no floor. Its budget and what contours tell
        become further columns.
    summary : by key; the last file written, so that where it is the others are complete.

    Raises
    ------
    FileFormatError
        a file cannot be written.
    """
    found, drivable = result.coverage, result.drivable
    lattice = found.lattice
    arrays: dict[str, NDArray[np.generic]] = {
        "x": lattice.x + lattice.spacing * np.arange(lattice.columns),
        "y": lattice.y + lattice.spacing * np.arange(lattice.rows),
        "drivable": drivable.reshape(lattice.rows, lattice.columns),
    }
    arrays |= {name + unit: found.image(name) for name, unit in UNITS.items()}
    more = {} if result.budget is None else _budget_columns(result.budget)
    more |= {} if result.contours is None else _contour_columns(result.contours)
    more |= {} if result.tags is None else _tag_columns(result.tags)
    more |= {} if result.reels is None else {"reels_seen": result.reels.astype(np.float64)}
    arrays |= {name: column.reshape(lattice.rows, lattice.columns) for name, column in more.items()}
    with atomic_file(folder / ARRAYS) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)
    header = ["x", "y", *(name + unit for name, unit in UNITS.items()), *more]
    write_table(folder / TABLE, header, _rows(found, drivable, more))
    with atomic_file(folder / IMAGE) as file:
        heat_image(found, drivable).save(file, format="PNG")
    write_text(folder / SUMMARY, json.dumps(dict(summary), indent=2, allow_nan=False) + "\n")


def write_ellipses(folder: Path, found: Ellipses) -> None:
    """Write `ellipses.csv`: center [m], semi-axes of 1-sigma [m] and direction of the longer one [rad] of each.

    Raises
    ------
    FileFormatError
        the file cannot be written.
    """
    columns = [_cells(place, column) for column in found.points.T]
    columns += [_cells(figure, column) for column in found.semi_axes.T]
    write_table(folder / ELLIPSES, ELLIPSE_COLUMNS, zip(*columns, _cells(angle, found.angles), strict=True))


def heat_image(found: Coverage, drivable: BoolArray) -> Image.Image:
    """Position error as a picture, north up: logarithmic from the 2 % to the 98 % quantile, dark is good."""
    sigma = found.fixes.position_sigma
    regular = drivable & np.isfinite(sigma)
    colors = np.empty((len(sigma), 3), dtype=np.uint8)
    colors[:] = np.where(drivable[:, np.newaxis], NO_FIX, NO_FLOOR)
    if regular.any():
        values = np.log(np.maximum(sigma[regular], 1e-12))
        low, high = np.quantile(values, (0.02, 0.98))
        colors[regular] = shades((values - low) / max(high - low, 1e-9))
    return lattice_image(found.lattice, colors)


def _budget_columns(budget: FloorBudget) -> dict[str, NDArray[np.float64]]:
    """(N,) columns of the error with all constants [m], and of the share of each source in its square."""
    shares = {f"{part}_share": budget.shares[:, index] for index, part in enumerate(CONTRIBUTIONS)}
    return {"total_sigma_m": budget.sigma, **shares}


def _tag_columns(tags: TagCoverage) -> dict[str, NDArray[np.float64]]:
    """(N,) columns of what tags tell; no 1-sigma where none is in sight."""
    return {
        "tags_seen": tags.seen.astype(np.float64),
        "tags_in_reach": tags.in_reach.astype(np.float64),
        "tag_position_sigma_m": tags.position_sigma,
        "tag_heading_sigma_rad": tags.heading_sigma,
    }


def _contour_columns(contours: ContourCoverage) -> dict[str, NDArray[np.float64]]:
    """(N,) columns of what contours tell; no 1-sigma where they do not tell the whole pose."""
    return {
        "contour_told": contours.told.astype(np.float64),
        "contour_beams": contours.beams.astype(np.float64),
        "contour_position_sigma_m": contours.position_sigma,
        "contour_heading_sigma_rad": contours.heading_sigma,
    }


def _rows(found: Coverage, drivable: BoolArray, more: Mapping[str, NDArray[np.float64]]) -> Iterator[tuple[str, ...]]:
    """One row per drivable point; a figure that is infinite is empty."""
    rows = np.flatnonzero(drivable)
    points = found.lattice.points()
    for start in range(0, len(rows), ROWS_AT_ONCE):
        block = rows[start : start + ROWS_AT_ONCE]
        columns = [_cells(place, points[block, axis]) for axis in range(2)]
        columns += [_cells(figure, getattr(found.fixes, name)[block]) for name in UNITS]
        columns += [_cells(figure, column[block]) for column in more.values()]
        yield from zip(*columns, strict=True)


def _cells(cell: Callable[[float], str], values: NDArray[np.generic]) -> list[str]:
    return [cell(value) for value in values.tolist()]
