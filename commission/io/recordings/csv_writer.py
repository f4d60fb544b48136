"""The writing side of a CSV folder: any source's records become a recording. Memory does not grow with its length."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path

from commission.io.atomic import cannot_write, staged
from commission.io.recordings.bearing_file import BEARING_COLUMNS, BEARINGS, REFLECTOR_COLUMN, bearing_line
from commission.io.recordings.contour_file import CONTOUR
from commission.io.recordings.csv_folder import (
    DETECTION_COLUMNS,
    DETECTIONS,
    NAMED_SCANS,
    ODOMETRY,
    ODOMETRY_COLUMNS,
    REFERENCE,
    REFERENCE_COLUMNS,
    SCANNER_COLUMN,
    SCANS,
    scans_file,
)
from commission.io.recordings.reference_file import REFERENCE_MOUNT, write_reference_mount
from commission.io.recordings.scan_writer import ScanWriter
from commission.io.recordings.tag_file import SIGMA_COLUMNS, TAG_COLUMNS, TAGS, tag_lines
from commission.io.recordings.truth_file import TRUTH, write_truth
from commission.site.records import Detections, Odometry, Record, ReferencePose, Reflex, Scan, TagSightings
from commission.site.reference_mount import BASE, ReferenceMount
from commission.site.scanner import ONLY_NAME
from commission.site.truth import Truth

_TABLES = {Odometry: ODOMETRY, Detections: DETECTIONS, ReferencePose: REFERENCE, TagSightings: TAGS, Reflex: BEARINGS}
"""Table of each kind of record that has one."""


def write_recording(
    folder: Path,
    records: Iterable[Record],
    truth: Truth | None = None,
    *,
    scanners: tuple[str, ...] = (ONLY_NAME,),
    reference_mount: ReferenceMount = BASE,
) -> None:
    """Write a recording as a CSV folder.

    Parameters
    ----------
    folder : made when missing; the recording in it is replaced once the new one is complete.
    records : in the order of their stamps; a source's error passes through and leaves the folder as it was.
    truth : the constants of a virtual drive, for its `truth.json`.
    scanners : names of the scanners that records have indices of; of a single one the files do not say the name.
    reference_mount : where the reference measures, for its `reference.json`; base needs no file.

    Raises
    ------
    FileFormatError
        the folder cannot be written, or a scan has other arrays than the first one.
    """
    try:
        with staged(folder, last=ODOMETRY) as scratch:
            names = _write_all(scratch, records, folder, scanners)
            if truth is not None:
                write_truth(scratch / TRUTH, truth)
                names.add(TRUTH)
            if reference_mount != BASE:
                write_reference_mount(scratch / REFERENCE_MOUNT, reference_mount)
                names.add(REFERENCE_MOUNT)
            for path in scratch.iterdir():
                if path.name not in names:
                    path.unlink()
        for name in (
            DETECTIONS,
            SCANS,
            REFERENCE,
            REFERENCE_MOUNT,
            TRUTH,
            CONTOUR,
            BEARINGS,
            TAGS,
            *(path.name for path in folder.glob(NAMED_SCANS)),
        ):
            if name not in names:
                (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error


def _write_all(scratch: Path, records: Iterable[Record], folder: Path, scanners: tuple[str, ...]) -> set[str]:
    """Write all files into a scratch folder; returns the names of those that hold something."""
    with ExitStack() as stack:
        tables = {
            kind: stack.enter_context((scratch / name).open("w", encoding="utf-8", newline="\n"))
            for kind, name in _TABLES.items()
        }
        for kind, columns in (
            (Odometry, ODOMETRY_COLUMNS),
            (Detections, DETECTION_COLUMNS if len(scanners) == 1 else (*DETECTION_COLUMNS, SCANNER_COLUMN)),
            (ReferencePose, REFERENCE_COLUMNS),
            (TagSightings, (*TAG_COLUMNS, *SIGMA_COLUMNS)),
            (Reflex, (*BEARING_COLUMNS, REFLECTOR_COLUMN)),
        ):
            tables[kind].write(",".join(columns) + "\n")
        files = [scans_file(scanners, index) for index in range(len(scanners))]
        writers = [ScanWriter(scratch, folder / file, stack) for file in files]
        cells = [""] if len(scanners) == 1 else [f",{name}" for name in scanners]
        names = {ODOMETRY}
        for record in records:
            if isinstance(record, Scan):
                writers[record.scanner].add(record)
                names.add(files[record.scanner])
            else:
                tables[type(record)].write(_rows(record, cells))
                names.add(_TABLES[type(record)])
        for table in tables.values():
            table.flush()
            os.fsync(table.fileno())
        for writer in writers:
            writer.finish()
    return names


def _rows(record: Odometry | Detections | TagSightings | Reflex | ReferencePose, scanners: Sequence[str]) -> str:
    """Lines of a record, detections with the cell of their scanner; `repr` of a number reads back as the same."""
    if isinstance(record, Detections):
        end = f"{scanners[record.scanner]}\n"
        if len(record.range_bearing) == 0:
            return f"{record.stamp_ns},,{end}"
        return "".join(f"{record.stamp_ns},{r!r},{b!r}{end}" for r, b in record.range_bearing.tolist())
    if isinstance(record, TagSightings):
        return "".join(tag_lines(record))
    if isinstance(record, Reflex):
        return bearing_line(record)
    values = record.displacement if isinstance(record, Odometry) else record.pose
    return ",".join([str(record.stamp_ns), *("" if math.isnan(v) else repr(v) for v in values.tolist())]) + "\n"
