"""The result of a Monte-Carlo study as files: a row for each drive, the Stanford diagram, and a summary."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from commission.io.atomic import write_text
from commission.io.stanford_picture import picture_of
from commission.studies.monte_carlo_figures import QUANTILES, DriveFigures, MonteCarloResult
from commission.studies.stanford import CELLS_PER_LIMIT, StanfordDiagram

DRIVES, TABLE, PICTURE, SUMMARY = "drives.csv", "stanford.csv", "stanford.png", "summary.json"
"""Names of the files."""
COLUMNS = {
    "drive": "number",
    "seed": "seed",
    "route": "route",
    "cycles": "cycles",
    "duration_s": "duration",
    "operational_fraction": "operational_fraction",
    "lost_fraction": "lost_fraction",
    "fail_episodes": "fail_episodes",
    "longest_fail_s": "longest_fail",
    "position_rmse_m": "position_rmse",
    "position_max_m": "position_max",
    "heading_rmse_rad": "heading_rmse",
    "anees": "anees",
    "anees_position": "anees_position",
    "wrong_while_operational": "hazardous",
    "moved": "moved",
    "missing": "missing",
    "dirty": "dirty",
    "false": "false",
    "covered": "covered",
    "kidnapped": "carried",
}
"""Columns of the table of drives, and which figure each holds."""


def write_monte_carlo(folder: Path, result: MonteCarloResult) -> None:
    """Write all files.

    Parameters
    ----------
    folder : exists.
    result : all drives.
    """
    rows = [[_written(each, name) for name in COLUMNS.values()] for each in result.drives]
    write_text(folder / DRIVES, _table([list(COLUMNS), *rows]))
    diagram = result.stanford
    if diagram is not None:
        write_text(folder / TABLE, table_of(diagram))
        (folder / PICTURE).write_bytes(picture_of(diagram))
    write_text(folder / SUMMARY, json.dumps(summary(result), indent=2) + "\n")


def table_of(diagram: StanfordDiagram) -> str:
    """Return the cells of a diagram that are not empty: upper edges [m], none beyond twice the limit, and counts.

    Parameters
    ----------
    diagram : cycles by error and protection level.
    """
    edges = [(index + 1) / CELLS_PER_LIMIT * diagram.limit for index in range(len(diagram.counts) - 1)]
    texts = [*(f"{edge:.9g}" for edge in edges), ""]
    filled = zip(*diagram.counts.nonzero(), strict=True)
    rows = [[texts[error], texts[level], int(diagram.counts[error, level])] for error, level in filled]
    return _table([["error_up_to_m", "protection_level_up_to_m", "cycles"], *rows])


def summary(result: MonteCarloResult) -> dict[str, Any]:
    """Entries of `summary.json`: what was asked for, and the figures of all drives together.

    Parameters
    ----------
    result : all drives.
    """
    inputs, diagram = result.inputs, result.stanford
    availability, cycles = result.column("operational_fraction"), int(result.column("cycles").sum())
    entries: dict[str, Any] = {
        "runs": len(result.drives),
        "seed": inputs.seed,
        "routes": list(inputs.routes),
        "detections": "beams" if inputs.by_beams else "shadows",
        "faults": asdict(inputs.rates),
        "cycles": cycles,
        "duration_s": float(result.column("duration").sum()),
        "operational_fraction": result.availability,
        "operational_fraction_worst": float(availability.min()),
        "drives_without_stop": int((availability == 1.0).sum()),
        "fail_episodes": int(result.column("fail_episodes").sum()),
        "longest_fail_s": float(result.column("longest_fail").max()),
        "lost_drives": int((result.column("lost_fraction") > 0.0).sum()),
        "anees": _known(result.anees),
        "anees_position": _known(result.anees_position),
        "position_quantiles_m": _quantiles(result.error_quantiles.tolist()),
        "position_quantiles_operational_m": _quantiles(result.operational_error_quantiles.tolist()),
        "hazardous_drives": result.hazardous_drives,
        "hazardous_drives_at_most": result.hazardous_bound,
    }
    if result.notes:
        entries["notes"] = list(result.notes)
    if diagram is not None:
        entries["position_limit_m"] = diagram.limit
        entries["stanford"] = asdict(diagram.regions)
        entries["supervisor"] = asdict(diagram.verdicts)
    return entries


def _quantiles(values: list[float]) -> dict[str, float | None]:
    return {f"{share:g}": _known(value) for share, value in zip(QUANTILES, values, strict=True)}


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _written(drive: DriveFigures, name: str) -> Any:
    value = getattr(drive, name)
    return "" if isinstance(value, float) and math.isnan(value) else value


def _table(rows: list[list[Any]]) -> str:
    """Rows as CSV; numbers are written so that they read back."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
