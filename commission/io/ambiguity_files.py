"""Ambiguity as files: arrays for scripts, tables for a spreadsheet, an image for a person, a summary. Writing only."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from commission.io.atomic import atomic_file, write_text
from commission.io.lattice_image import NO_FLOOR, lattice_image, shades
from commission.io.table_writer import angle, figure, place, write_table
from commission.site.reflectors import ReflectorMap
from commission.studies.ambiguity import AmbiguityResult, SiteAmbiguity

ARRAYS = "ambiguity.npz"
TABLE = "ambiguity.csv"
IMAGE = "ambiguity.png"
PAIRS = "ambiguous_pairs.csv"
NEIGHBORS = "neighbors.csv"
SUMMARY = "summary.json"
FILES = (ARRAYS, TABLE, IMAGE, PAIRS, NEIGHBORS, SUMMARY)
"""All that is written."""

TOO_FEW = (200, 60, 60)
"""Color of floor from which fewer than two reflectors are visible."""
PARTNER = ("partner_x", "partner_y", "partner_theta")
COLUMNS = ("x", "y", "ambiguous_share", "visible", *PARTNER)
PAIR_COLUMNS = ("constellation", "image", "poses", "x", "y", "theta", *PARTNER)
NEIGHBOR_COLUMNS = ("route", "reflector_id", "neighbor_id", "probability_max", "metre_of_max", "scans", "metres")


def write_ambiguity(
    folder: Path, found: SiteAmbiguity, reflectors: ReflectorMap, summary: Mapping[str, object]
) -> None:
    """Write `ambiguity.npz`, `.csv`, `.png`, the two tables of pairs and `summary.json`; each whole or not at all.

    Parameters
    ----------
    folder : made when missing.
    found : figures of the floor and of the routes; metres and radians.
    reflectors : the map that names the reflectors.
    summary : by key; the last file written, so that where it is the others are complete.

    Raises
    ------
    FileFormatError
        a file cannot be written.
    """
    floor, lattice = found.floor, found.floor.lattice
    shape = (lattice.rows, lattice.columns)
    with atomic_file(folder / ARRAYS) as file:
        np.savez_compressed(
            file,
            allow_pickle=False,
            x=lattice.x + lattice.spacing * np.arange(lattice.columns),
            y=lattice.y + lattice.spacing * np.arange(lattice.rows),
            drivable=floor.drivable.reshape(shape),
            ambiguous_share=floor.share.reshape(shape),
            visible=floor.visible.reshape(shape),
            partner=floor.partners.reshape(*shape, 3),
        )
    ids = [reflector.id for reflector in reflectors.reflectors]
    write_table(folder / TABLE, COLUMNS, _points(floor))
    write_table(folder / PAIRS, PAIR_COLUMNS, _pairs(floor, ids))
    write_table(folder / NEIGHBORS, NEIGHBOR_COLUMNS, _neighbors(found, ids))
    with atomic_file(folder / IMAGE) as file:
        ambiguity_image(floor).save(file, format="PNG")
    write_text(folder / SUMMARY, json.dumps(dict(summary), indent=2, allow_nan=False) + "\n")


def ambiguity_image(found: AmbiguityResult) -> Image.Image:
    """Share of ambiguous headings as a picture, north up: dark is clear, red has too few reflectors in sight."""
    colors = np.empty((len(found.lattice), 3), dtype=np.uint8)
    colors[:] = NO_FLOOR
    colors[found.drivable] = shades(found.share[found.drivable])
    colors[found.drivable & (found.visible < 2)] = TOO_FEW
    return lattice_image(found.lattice, colors)


def _points(found: AmbiguityResult) -> Iterator[tuple[str, ...]]:
    """One row per drivable point; the partner is empty where there is none."""
    points = found.lattice.points()
    for n in np.flatnonzero(found.drivable).tolist():
        share, visible = figure(float(found.share[n])), str(found.visible[n])
        yield *map(place, points[n].tolist()), share, visible, *_pose(found.partners[n].tolist())


def _pairs(found: AmbiguityResult, ids: list[str]) -> Iterator[tuple[str, ...]]:
    """One row per pair of constellations, the one that most poses see first."""
    for pair in found.cold.pairs:
        groups = (" ".join(ids[index] for index in group) for group in (pair.constellation, pair.image))
        yield *groups, str(pair.poses), *_pose(pair.example), *_pose(pair.partner)


def _neighbors(found: SiteAmbiguity, ids: list[str]) -> Iterator[tuple[str, ...]]:
    """One row per route and pair of neighbors, the most probable mistake first."""
    for each in found.routes:
        for risk in each.risks:
            metres = np.unique(risk.metres.astype(np.int64))
            yield (
                *(each.route, ids[risk.reflector], ids[risk.neighbor], figure(risk.worst)),
                place(float(risk.metres[int(np.argmax(risk.probability))])),
                str(len(risk.scans)),
                " ".join(map(str, metres.tolist())),
            )


def _pose(pose: Sequence[float]) -> tuple[str, str, str]:
    """Cells of x, y and heading; empty where there is none."""
    x, y, theta = pose
    return place(x), place(y), angle(theta)
