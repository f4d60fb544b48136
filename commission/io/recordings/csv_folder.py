"""A recording as a folder of tables: what an engineer can make from any log. The reading side.

`odometry.csv`, and where they exist `detections.csv`, `scans.npz` (of several scanners `scans_NAME.npz`),
`reference.csv`, `reference.json` and `truth.json`. A pause in any of them is no error: vehicles stand still, scanners
are unplugged.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray, Growing, IntArray
from commission.io.csv_table import Block, read_table
from commission.io.recordings.reference_file import REFERENCE_MOUNT, read_reference_mount
from commission.io.recordings.scan_archive import ScanArchive
from commission.io.recordings.truth_file import TRUTH, read_truth
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanStore
from commission.site.records import (
    ORDER_WITHIN_A_STAMP,
    Detections,
    Odometry,
    Record,
    ReferencePose,
    Scan,
)
from commission.site.reference_mount import BASE, ReferenceMount
from commission.site.scanner import ONLY_NAME, is_name
from commission.site.truth import Truth

ODOMETRY = "odometry.csv"
DETECTIONS = "detections.csv"
SCANS = "scans.npz"
NAMED_SCANS = "scans_*.npz"
REFERENCE = "reference.csv"

ODOMETRY_COLUMNS = ("stamp_ns", "dx", "dy", "dtheta")
DETECTION_COLUMNS = ("stamp_ns", "range", "bearing")
SCANNER_COLUMN = "scanner"
"""Optional column of detections."""
REFERENCE_COLUMNS = ("stamp_ns", "x", "y", "theta")

_STREAMED = 100_000
_LOADED = 1_000_000
"""Bytes of a table read at once."""


@dataclass(frozen=True, slots=True)
class _Rows:
    """Some rows of one table: stamps [ns] and the numbers beside them."""

    stamps_ns: IntArray
    values: FloatArray
    scanners: IntArray = field(default_factory=lambda: np.empty(0, np.int64))


def scans_file(scanners: tuple[str, ...], index: int) -> str:
    """Name of the file with the scans of one of a recording's scanners."""
    return SCANS if len(scanners) == 1 else f"scans_{scanners[index]}.npz"


class CsvFolder:
    """A recording in a folder of tables."""

    def __init__(self, path: Path) -> None:
        """Open a folder; raises FileFormatError when it has no odometry or its scans are no archive."""
        self.path = path
        if not (path / ODOMETRY).is_file():
            raise FileFormatError(path / ODOMETRY, "", "does not exist", "the recording's odometry")
        named = sorted(path.glob(NAMED_SCANS))
        if named and (path / SCANS).exists():
            raise FileFormatError(
                path / SCANS, "", f"is there besides {named[0].name}", "scans that name their scanner"
            )
        self._scanners: tuple[str, ...] | None = None
        self._archives = [ScanArchive(file) for file in named or [path / SCANS] if file.exists()]

    @property
    def scanners(self) -> tuple[str, ...]:
        """Names of the scanners: those of files, then those in detections as they appear; raises FileFormatError."""
        if self._scanners is None:
            self._scanners = self._found_scanners()
        return self._scanners

    def _found_scanners(self) -> tuple[str, ...]:
        names = [_name_in(archive.path) for archive in self._archives if archive.path.name != SCANS]
        if (self.path / DETECTIONS).exists():
            for block in _table(self.path / DETECTIONS, DETECTION_COLUMNS, _STREAMED):
                if SCANNER_COLUMN not in block.columns:
                    break
                names.extend(name for name in dict.fromkeys(block.texts(SCANNER_COLUMN)) if name not in names)
        if len(names) > 1 and (self.path / SCANS).exists():
            found = f"is of one scanner, {DETECTIONS} of {', '.join(names)}"
            raise FileFormatError(self.path / SCANS, "", found, f"a file {scans_file(tuple(names), 0)} for each")
        return tuple(names) or (ONLY_NAME,)

    def _loaded_scans(self) -> tuple[ScanStore, ...]:
        found = (archive.load(index) for index, archive in enumerate(self._archives))
        return tuple(scans for scans in found if scans is not None)

    @staticmethod
    def recognizes(path: Path) -> bool:
        """Whether a path is such a folder, complete or not."""
        if not path.is_dir():
            return False
        return any((path / name).exists() for name in (ODOMETRY, DETECTIONS, SCANS, REFERENCE)) or any(
            path.glob(NAMED_SCANS)
        )

    def records(self) -> Iterator[Record]:
        """Deliver every record in order of stamps; within a stamp motion comes first.

        Raises
        ------
        FileFormatError
            at the first row that is wrong; names file, line, column, what was found and what is expected.
        """
        scans = (self._scan_records(index) for index in range(len(self._archives)))
        streams = (self._odometry(), self._reference(), self._detections(), *scans)
        return heapq.merge(*streams, key=lambda record: (record.stamp_ns, ORDER_WITHIN_A_STAMP[type(record)]))

    def load(self) -> RecordLog:
        """Read everything into columns; raises FileFormatError like `records`."""
        odometry = _joined(self._odometry_rows(_LOADED), 3)
        reference = _joined(self._reference_rows(_LOADED), 3)
        detections = _joined(self._detection_rows(_LOADED), 2)
        starts = np.flatnonzero(
            np.diff(detections.stamps_ns, prepend=detections.stamps_ns[:1] - 1)
            | np.diff(detections.scanners, prepend=detections.scanners[:1])
        )
        seen = np.isfinite(detections.values[:, 0])
        offsets = np.concatenate([[0], np.cumsum(seen)]).astype(np.int64)
        return RecordLog(
            odometry_stamps_ns=odometry.stamps_ns,
            displacements=odometry.values,
            scanners=self.scanners,
            scans=self._loaded_scans(),
            detection_stamps_ns=detections.stamps_ns[starts],
            detection_offsets=np.append(offsets[starts], offsets[-1]),
            range_bearing=detections.values[seen],
            detection_scanners=detections.scanners[starts],
            reference_stamps_ns=reference.stamps_ns,
            reference_poses=reference.values,
            truth=self.truth(),
            reference_mount=self.reference_mount(),
        )

    def truth(self) -> Truth | None:
        """Read the constants of a virtual drive; None of a real vehicle. Raises FileFormatError."""
        return read_truth(self.path / TRUTH) if (self.path / TRUTH).exists() else None

    def reference_mount(self) -> ReferenceMount:
        """Read where on the vehicle the reference measures; base where nothing is said. Raises FileFormatError."""
        path = self.path / REFERENCE_MOUNT
        return read_reference_mount(path) if path.exists() else BASE

    def _odometry(self) -> Iterator[Record]:
        for rows in self._odometry_rows(_STREAMED):
            for stamp, values in zip(rows.stamps_ns.tolist(), rows.values, strict=True):
                yield Odometry(stamp, values)

    def _reference(self) -> Iterator[Record]:
        for rows in self._reference_rows(_STREAMED):
            for stamp, values in zip(rows.stamps_ns.tolist(), rows.values, strict=True):
                yield ReferencePose(stamp, values)

    def _detections(self) -> Iterator[Record]:
        scan: tuple[int, int] | None = None
        seen: list[FloatArray] = []
        for rows in self._detection_rows(_STREAMED):
            for key, values in zip(
                zip(rows.stamps_ns.tolist(), rows.scanners.tolist(), strict=True), rows.values, strict=True
            ):
                if scan is not None and key != scan:
                    yield Detections(scan[0], np.array(seen).reshape(-1, 2), scan[1])
                    seen = []
                scan = key
                if np.isfinite(values[0]):
                    seen.append(values)
        if scan is not None:
            yield Detections(scan[0], np.array(seen).reshape(-1, 2), scan[1])

    def _scan_records(self, scanner: int) -> Iterator[Record]:
        for block in self._archives[scanner].blocks():
            named = replace(block, scanner=scanner)
            for index in range(len(named)):
                scan: Scan = named.scan(index)
                yield scan

    def _odometry_rows(self, bytes_at_once: int) -> Iterator[_Rows]:
        last: int | None = None
        for block in _table(self.path / ODOMETRY, ODOMETRY_COLUMNS, bytes_at_once):
            stamps = _ascending(block, last, "later than the row before")
            last = int(stamps[-1])
            columns = [block.numbers("dx", "m"), block.numbers("dy", "m"), block.numbers("dtheta", "rad")]
            yield _Rows(stamps, np.stack(columns, axis=1))
        if last is None:
            raise FileFormatError(self.path / ODOMETRY, "", "has no rows", "at least one row of odometry")

    def _reference_rows(self, bytes_at_once: int) -> Iterator[_Rows]:
        if not (self.path / REFERENCE).exists():
            return
        last: int | None = None
        for block in _table(self.path / REFERENCE, REFERENCE_COLUMNS, bytes_at_once):
            stamps = _ascending(block, last, "later than the row before")
            last = int(stamps[-1])
            theta = block.numbers("theta", "rad", empty=np.nan)
            yield _Rows(stamps, np.stack([block.numbers("x", "m"), block.numbers("y", "m"), theta], axis=1))

    def _detection_rows(self, bytes_at_once: int) -> Iterator[_Rows]:
        if not (self.path / DETECTIONS).exists():
            return
        last: int | None = None
        last_empty, last_scanner = False, 0
        scans = _ScanGroups(self.scanners)
        for block in _table(self.path / DETECTIONS, DETECTION_COLUMNS, bytes_at_once):
            stamps = _ascending(block, last, "the stamp of the row before, or a later one", repeated=True)
            values = np.stack(
                [block.numbers(c, u, empty=np.nan) for c, u in (("range", "m"), ("bearing", "rad"))], axis=1
            )
            empty = np.isnan(values[:, 0])
            _check_detections(block, values, empty)
            scanners = scans.indices(block, stamps)
            previous_stamps = np.concatenate([stamps[:1] - 1 if last is None else [last], stamps[:-1]])
            previous_empty = np.concatenate([[last_empty], empty[:-1]])
            previous_scanners = np.concatenate([[last_scanner], scanners[:-1]])
            same = (stamps == previous_stamps) & (scanners == previous_scanners)
            mixed = np.flatnonzero(same & (empty | previous_empty))
            if len(mixed):
                found = "an empty row and another row have one stamp"
                raise block.error(int(mixed[0]), "range", found, "one empty row for a scan that saw no reflector")
            last, last_empty, last_scanner = int(stamps[-1]), bool(empty[-1]), int(scanners[-1])
            yield _Rows(stamps, values, scanners)


class _ScanGroups:
    """Which scanner each row of detections is of; the rows of one scan stand together."""

    def __init__(self, scanners: tuple[str, ...]) -> None:
        self._index = {name: index for index, name in enumerate(scanners)}
        self._scan: tuple[int, int] | None = None
        self._done: set[int] = set()
        """Scanners whose rows of the newest stamp have ended."""

    def indices(self, block: Block, stamps: IntArray) -> IntArray:
        """(N,) scanner of each row; raises FileFormatError where the rows of a scan do not stand together."""
        if SCANNER_COLUMN not in block.columns:
            return np.zeros(len(stamps), np.int64)
        names = block.texts(SCANNER_COLUMN)
        for row, name in enumerate(names):
            if not is_name(name):
                raise block.error(
                    row, SCANNER_COLUMN, f"is {name!r}", "the name of a scanner: letters, digits, - and _"
                )
        found = np.array([self._index[name] for name in names], dtype=np.int64)
        for row, scan in enumerate(zip(stamps.tolist(), found.tolist(), strict=True)):
            if scan == self._scan:
                continue
            if self._scan is None or scan[0] != self._scan[0]:
                self._done = set()
            elif scan[1] in self._done:
                remedy = "the rows of one scan one after the other"
                raise block.error(row, SCANNER_COLUMN, f"is {names[row]} again after rows of another scanner", remedy)
            self._done.add(scan[1])
            self._scan = scan
        return found


def _name_in(path: Path) -> str:
    """Name of the scanner in `scans_NAME.npz`."""
    name = path.stem.partition("_")[2]
    if not is_name(name):
        raise FileFormatError(path, "", "names no scanner", "scans_NAME.npz: letters, digits, blanks inside, - and _")
    return name


def _table(path: Path, columns: tuple[str, ...], bytes_at_once: int) -> Iterator[Block]:
    # Other columns are passed over: a recording is often exported from a table that holds more.
    return read_table(path, columns, (SCANNER_COLUMN,), ignore_unknown=True, bytes_at_once=bytes_at_once)


def _ascending(block: Block, last: int | None, expected: str, *, repeated: bool = False) -> IntArray:
    """Stamps of a block; an error where one is earlier than (or, unless `repeated`, equal to) the one before."""
    stamps = block.stamps()
    before = np.concatenate([stamps[:1] - 1 if last is None else [last], stamps[:-1]])
    wrong = np.flatnonzero(stamps < before if repeated else stamps <= before)
    if len(wrong):
        row = int(wrong[0])
        raise block.error(row, "stamp_ns", f"is {stamps[row]} after {before[row]}", expected)
    return stamps


def _check_detections(block: Block, values: FloatArray, empty: np.ndarray) -> None:
    half = np.flatnonzero(empty != np.isnan(values[:, 1]))
    if len(half):
        row = int(half[0])
        column = "range" if empty[row] else "bearing"
        raise block.error(row, column, "is empty", "range and bearing, or neither for a scan that saw no reflector")
    nowhere = np.flatnonzero(values[:, 0] <= 0.0)
    if len(nowhere):
        row = int(nowhere[0])
        expected = "more than 0 m, or an empty range and bearing for a scan that saw no reflector"
        raise block.error(row, "range", f"is {values[row, 0]:g}", expected)


def _joined(blocks: Iterator[_Rows], width: int) -> _Rows:
    stamps, values, scanners = Growing(np.int64), Growing(np.float64, width), Growing(np.int64)
    for block in blocks:
        stamps.append(block.stamps_ns)
        values.append(block.values)
        scanners.append(block.scanners)
    return _Rows(stamps.array(), values.array(), scanners.array())
