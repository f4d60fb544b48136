"""Results of a run as files that a spreadsheet and a script can read: estimates, detections, summary. Writing only."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.io.atomic import atomic_file, write_bytes, write_text
from commission.io.stanford_picture import picture_of
from commission.localization.estimate import Mode, Status
from commission.localization.run_columns import RunColumns
from commission.studies.events import EventsResult, told
from commission.studies.integrity import Protection
from commission.studies.reflector_figures import ReflectorFigures
from commission.studies.run import RunResult
from commission.studies.stanford import stanford

ESTIMATES = "estimates.csv"
DETECTIONS = "detections.csv"
SUMMARY = "summary.json"
EVENTS = "events.csv"
REFLECTORS = "reflectors.csv"
PROTECTION = "protection.csv"
STANFORD = "stanford.png"
RESULTS = (ESTIMATES, DETECTIONS, SUMMARY, EVENTS, REFLECTORS, PROTECTION, STANFORD)
"""All of them; the last one where there is a reference."""

ESTIMATE_COLUMNS = (
    *("stamp_ns", "x", "y", "theta", "var_x", "cov_xy", "cov_xtheta", "var_y", "cov_ytheta", "var_theta"),
    *("mode", "inliers", "outliers"),
)
BEAM_COLUMNS = ("beams", "expected_beams")
"""Width of each cluster, and that of the likeliest kind of reflector there; empty where the sensor itself detected."""
DETECTION_COLUMNS = ("stamp_ns", "range", "bearing", "x", "y", "status", "reflector_id", "d2", "scanner", *BEAM_COLUMNS)

EVENT_COLUMNS = (
    *("stamp_ns", "kind", "duration_s", "position", "heading", "position_limit", "heading_limit", "rejected_fraction"),
    *("reflector_before", "reflector_after", "told"),
)
"""Metres and radians; empty what an event of this kind does not have."""
REFLECTOR_COLUMNS = (
    *("id", "x", "y", "expected", "seen", "accepted", "rejected"),
    *("along_mean", "along_spread", "across_mean", "across_spread", "nis", "last_seen_s"),
)
"""Scans and detections counted, metres; empty where nothing is known."""

PROTECTION_COLUMNS = ("stamp_ns", "position", "heading", "reflector_id")
"""Metres and radians; empty where the vehicle is lost or not located, and where no reflector would be worst."""

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


def write_events(folder: Path, found: EventsResult) -> None:
    """Write `events.csv`: one row for each event, in the order of time."""
    first_ns = found.inputs.run.inputs.log.first_ns
    rows = [
        (
            first_ns + round(event.time * 1e9),
            event.kind.value,
            *map(_or_empty, (event.lasts, event.position, event.heading, *event.limits, event.share)),
            *event.names,
            told(event),
        )
        for event in found.events
    ]
    _write_table(folder / EVENTS, EVENT_COLUMNS, iter([rows]))


def write_reflector_figures(folder: Path, figures: ReflectorFigures) -> None:
    """Write `reflectors.csv`: what each reflector contributed."""
    counts = (figures.expected, figures.seen, figures.accepted, figures.rejected)
    means = (figures.along_mean, figures.along_spread, figures.across_mean, figures.across_spread)
    columns = (*means, figures.nis, figures.last_seen)
    rows = zip(
        figures.names,
        *figures.places.T.tolist(),
        *(count.tolist() for count in counts),
        *(map(_or_empty, column.tolist()) for column in columns),
        strict=True,
    )
    _write_table(folder / REFLECTORS, REFLECTOR_COLUMNS, iter([rows]))


def write_protection(folder: Path, result: RunResult, levels: Protection) -> None:
    """Write `protection.csv`, and `stanford.png` where the run has a reference.

    Parameters
    ----------
    folder : made when missing.
    result, levels : a run and its protection levels.
    """
    names = (*levels.reflector, "")
    rows = zip(
        result.columns.stamps_ns.tolist(),
        map(_or_empty, levels.position.tolist()),
        map(_or_empty, levels.heading.tolist()),
        (names[index] for index in levels.worst.tolist()),
        strict=True,
    )
    _write_table(folder / PROTECTION, PROTECTION_COLUMNS, iter([rows]))
    diagram = stanford(result, levels.position)
    if diagram is not None:
        write_bytes(folder / STANFORD, picture_of(diagram))


def _or_empty(value: float) -> float | str:
    """A figure, or nothing where it is unknown."""
    return value if math.isfinite(value) else ""


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
