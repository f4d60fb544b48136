"""Results of a run as files that a spreadsheet and a script can read: estimates, detections, summary. Writing only."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.io.atomic import atomic_file, write_text
from commission.localization.estimate import Mode, Status
from commission.localization.run_columns import RunColumns

ESTIMATES = "estimates.csv"
DETECTIONS = "detections.csv"
SUMMARY = "summary.json"

ESTIMATE_COLUMNS = (
    *("stamp_ns", "x", "y", "theta", "var_x", "cov_xy", "cov_xtheta", "var_y", "cov_ytheta", "var_theta"),
    *("mode", "inliers", "outliers"),
)
BEAM_COLUMNS = ("beams", "expected_beams")
"""Width of each cluster, and that of the likeliest kind of reflector there; empty where the sensor itself detected."""
DETECTION_COLUMNS = ("stamp_ns", "range", "bearing", "x", "y", "status", "reflector_id", "d2", "scanner", *BEAM_COLUMNS)

UPPER_TRIANGLE = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
ROWS_AT_ONCE = 50_000


def write_results(folder: Path, run: RunColumns, summary: Mapping[str, Any]) -> None:
    """Write `estimates.csv`, `detections.csv` and `summary.json`; each is replaced whole or not at all.

    Parameters
    ----------
    folder : made when missing.
    run : the filter's own state after each scan goes into the estimates, in fail mode too; beside it the mode. The ids
        of the map that each of its segments was made with name the associated reflectors.
    summary : what the run came to, by key; the last file written, so that where it is the others are complete.

    Raises
    ------
    FileFormatError
        a file cannot be written.
    """
    _write_table(folder / ESTIMATES, ESTIMATE_COLUMNS, _estimate_rows(run))
    _write_table(folder / DETECTIONS, DETECTION_COLUMNS, _detection_rows(run))
    write_text(folder / SUMMARY, json.dumps(dict(summary), indent=2, allow_nan=False) + "\n")


def _estimate_rows(run: RunColumns) -> Iterator[Iterable[Any]]:
    """Columns of some cycles at a time."""
    outliers = run.counts(Status.OUTLIER_DETECTOR) + run.counts(Status.OUTLIER_ASSOCIATION)
    columns = [
        run.stamps_ns,
        *(run.means[:, axis] for axis in range(3)),
        *(run.covariances[:, row, column] for row, column in UPPER_TRIANGLE),
        np.array([mode.name.lower() for mode in Mode])[run.modes],
        run.counts(Status.INLIER),
        outliers,
    ]
    return _blocks(columns)


def _detection_rows(run: RunColumns) -> Iterator[Iterable[Any]]:
    """Columns of some detections at a time; empty where there is no reflector, and so no distance to it.

    Range and bearing are those at the stamp of the scan, upright: corrected for the time of the beam in its sweep.
    """
    points = run.points_map()
    distances = run.d2.astype(object)
    distances[np.isnan(run.d2)] = ""
    beams, expected = run.beams.astype(object), run.expected_beams.round(1).astype(object)
    beams[run.beams == 0], expected[np.isnan(run.expected_beams)] = "", ""
    columns = [
        np.repeat(run.stamps_ns, np.diff(run.offsets)),
        *(run.range_bearing[:, axis] for axis in range(2)),
        *(points[:, axis] for axis in range(2)),
        np.array([status.name.lower() for status in Status])[run.status],
        _reflector_ids(run),
        distances,
        _scanner_names(run),
        beams,
        expected,
    ]
    return _blocks(columns)


def _scanner_names(run: RunColumns) -> NDArray[Any]:
    """(n,) name of the scanner of each detection."""
    ends = (*run.firsts[1:].tolist(), len(run))
    names = np.empty(len(run), dtype=object)
    for segment, end in zip(run.segments, ends, strict=True):
        known = np.array([scanner.name for scanner in segment.setup.scanners], dtype=object)
        names[segment.first : end] = known[run.detected.scanners[segment.first : end]]
    return np.repeat(names, np.diff(run.offsets))


def _reflector_ids(run: RunColumns) -> NDArray[Any]:
    """(n,) id of the reflector that each detection is closest to; empty for nobody."""
    ends = (*run.firsts[1:].tolist(), len(run))
    ids = np.empty(len(run.reflector), dtype=object)
    for segment, end in zip(run.segments, ends, strict=True):
        rows = slice(int(run.offsets[segment.first]), int(run.offsets[end]))
        # The name of nobody is the last one, which is where the index -1 leads.
        names = np.array([*(reflector.id for reflector in segment.setup.reflectors.reflectors), ""], dtype=object)
        ids[rows] = names[run.reflector[rows]]
    return ids


def _blocks(columns: Sequence[NDArray[Any]]) -> Iterator[Iterable[Any]]:
    """Rows of equally long columns as Python values, some at a time: numbers are written so that they read back."""
    for first in range(0, len(columns[0]), ROWS_AT_ONCE):
        yield zip(*(column[first : first + ROWS_AT_ONCE].tolist() for column in columns), strict=True)


def _write_table(path: Path, header: Sequence[str], blocks: Iterator[Iterable[Any]]) -> None:
    with atomic_file(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(header)
        for block in blocks:
            writer.writerows(block)
        text.detach()
