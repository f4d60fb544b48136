"""A drive by bearings as files: a row for each reflex, and the figures of all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from commission.io.atomic import write_text
from commission.io.table_writer import figure, write_table
from commission.studies.triangulation import TriangulationResult

TABLE, SUMMARY = "triangulation.csv", "summary.json"
"""Names of the files."""
FILES = (TABLE, SUMMARY)
HEADER = (
    *("stamp_ns", "reflector", "nis", "chosen"),
    *("x", "y", "theta", "sigma_x", "sigma_y", "sigma_theta"),
    *("filter_x", "filter_y", "filter_theta", "filter_sigma_x", "filter_sigma_y", "filter_sigma_theta"),
)
"""Columns of the table [m, rad]: pose of base by triangulation, sigmas empty without a fix; the same by the filter."""


def write_triangulation(
    folder: Path, result: TriangulationResult, names: tuple[str, ...], figures: Mapping[str, float | int | None]
) -> None:
    """Write table and figures.

    Parameters
    ----------
    folder : exists.
    result : of the study.
    names : ids of the reflectors, as indexed.
    figures : entries of the summary.
    """
    fix, filtered = (
        np.sqrt(np.diagonal(each, axis1=1, axis2=2)) for each in (result.fix_covariances, result.filtered_covariances)
    )
    numbers = np.concatenate([result.fixes, fix, result.filtered, filtered], axis=1).tolist()
    rows = zip(result.stamps_ns.tolist(), result.landmarks.tolist(), result.nis.tolist(), result.chosen, strict=True)
    write_table(
        folder / TABLE,
        HEADER,
        (
            [
                stamp,
                names[landmark] if landmark >= 0 else "",
                figure(nis),
                " ".join(names[index] for index in chosen.tolist()) if chosen[0] >= 0 else "",
                *map(figure, values),
            ]
            for (stamp, landmark, nis, chosen), values in zip(rows, numbers, strict=True)
        ),
    )
    write_text(folder / SUMMARY, json.dumps(dict(figures), indent=2) + "\n")
