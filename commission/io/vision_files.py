"""The motion of a camera beside that of the laser as files: a row for each frame, and the figures of all."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from commission.io.atomic import write_text
from commission.io.table_writer import figure, write_table
from commission.studies.vision import VisionResult, summary

TABLE, SUMMARY = "vision.csv", "summary.json"
"""Names of the files."""
FILES = (TABLE, SUMMARY)
_MOTIONS = ("vision", "laser", "closed_form")
HEADER = (
    "stamp_ns",
    *(f"{name}_{part}" for name in _MOTIONS for part in ("forward", "left", "turn")),
    "sigma_forward",
    "sigma_left",
    "sigma_turn",
    *(f"{name}_map_{part}" for name in _MOTIONS[:2] for part in ("x", "y", "theta")),
)
"""Columns of the table [m, rad]: motion of the camera since the first frame, its 1-sigma, and its pose in map."""


def write_vision(folder: Path, result: VisionResult) -> None:
    """Write table and figures.

    Parameters
    ----------
    folder : exists.
    result : of the study.
    """
    sigmas = np.sqrt(np.diagonal(result.camera_covariances, axis1=1, axis2=2))
    columns = (result.camera, result.laser, result.closed_form, sigmas, result.camera_map, result.laser_map)
    rows = zip(result.stamps_ns.tolist(), np.concatenate(columns, axis=1).tolist(), strict=True)
    write_table(folder / TABLE, HEADER, ([stamp, *map(figure, values)] for stamp, values in rows))
    write_text(folder / SUMMARY, json.dumps(summary(result), indent=2) + "\n")
