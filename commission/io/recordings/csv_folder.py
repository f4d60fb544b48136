"""A recording as a folder of tables: what an engineer can make from any log. The reading side.

`odometry.csv`, and where they exist `detections.csv`, `tags.csv`, `bearings.csv`, `scans.npz` (of several scanners
`scans_NAME.npz`), `reference.csv`, `reference.json` and `truth.json`. A pause in any of them is no error: vehicles
stand still, scanners are unplugged. Neither is disorder, nor a stamp that comes twice, as real logs have them: both are
mended and told.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from os import SEEK_END
from pathlib import Path

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray, Growing, IntArray
from commission.io.csv_table import Block, read_table
from commission.io.recordings import motion
from commission.io.recordings.bearing_file import BEARINGS, read_reflexes
from commission.io.recordings.reference_file import REFERENCE_MOUNT, read_reference_mount
from commission.io.recordings.scan_archive import ScanArchive
from commission.io.recordings.scan_file import load_scans
from commission.io.recordings.tag_file import TAGS, read_tags
from commission.io.recordings.truth_file import TRUTH, read_truth
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanStore
from commission.site.records import ORDER_WITHIN_A_STAMP, Record, Scan
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

_TABLES = (ODOMETRY, DETECTIONS, REFERENCE, TAGS, BEARINGS)
_AT_ONCE = 1_000_000
"""Bytes of a table read at once."""


@dataclass(frozen=True, slots=True)
class _Rows:
    """Some rows of one table: stamps [ns] and the numbers beside them."""

    stamps_ns: IntArray
    values: FloatArray
    scanners: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """Of detections: index of the scanner of each."""
    lines: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """Of detections: line of each in its file, from 1."""


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
            for block in _table(self.path / DETECTIONS, DETECTION_COLUMNS):
                if SCANNER_COLUMN not in block.columns:
                    break
                names.extend(name for name in dict.fromkeys(block.texts(SCANNER_COLUMN)) if name not in names)
        if len(names) > 1 and (self.path / SCANS).exists():
            found = f"is of one scanner, {DETECTIONS} of {', '.join(names)}"
            raise FileFormatError(self.path / SCANS, "", found, f"a file {scans_file(tuple(names), 0)} for each")
        return tuple(names) or (ONLY_NAME,)

    def _loaded_scans(self) -> tuple[ScanStore, ...]:
        found = (load_scans(archive, index) for index, archive in enumerate(self._archives))
        return tuple(scans for scans in found if scans is not None)

    @staticmethod
    def recognizes(path: Path) -> bool:
        """Whether a path is such a folder, complete or not."""
        if not path.is_dir():
            return False
        return any((path / name).exists() for name in (ODOMETRY, DETECTIONS, SCANS, REFERENCE, TAGS, BEARINGS)) or any(
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
        streams = (self._tables().records(), *scans)
        return heapq.merge(*streams, key=lambda record: (record.stamp_ns, ORDER_WITHIN_A_STAMP[type(record)]))

    def load(self) -> RecordLog:
        """Read everything into columns; raises FileFormatError like `records`."""
        scans, tables = self._loaded_scans(), self._tables()
        mended = (f"{archive.path.name}: {note}" for archive in self._archives for note in archive.notes)
        return replace(tables, scans=scans, notes=(*tables.notes, *mended))

    def _tables(self) -> RecordLog:
        """All but the scans: motion, detections and reference are small, and sorted whole."""
        rows = _joined(self._odometry_rows(), 3)
        odometry = motion.composed(rows.stamps_ns, rows.values)
        rows = _joined(self._reference_rows(), 3)
        reference = motion.in_order(rows.stamps_ns, rows.values)
        detections, late = self._sorted_detections(_joined(self._detection_rows(), 2))
        starts = np.flatnonzero(
            np.diff(detections.stamps_ns, prepend=detections.stamps_ns[:1] - 1)
            | np.diff(detections.scanners, prepend=detections.scanners[:1])
        )
        seen = np.isfinite(detections.values[:, 0])
        offsets = np.concatenate([[0], np.cumsum(seen)]).astype(np.int64)
        return RecordLog(
            odometry_stamps_ns=odometry.stamps_ns,
            displacements=odometry.rows,
            scanners=self.scanners,
            detection_stamps_ns=detections.stamps_ns[starts],
            detection_offsets=np.append(offsets[starts], offsets[-1]),
            range_bearing=detections.values[seen],
            detection_scanners=detections.scanners[starts],
            tags=read_tags(self.path / TAGS),
            bearings=read_reflexes(self.path / BEARINGS),
            reference_stamps_ns=reference.stamps_ns,
            reference_poses=reference.rows,
            truth=self.truth(),
            reference_mount=self.reference_mount(),
            notes=(
                *_mended(ODOMETRY, odometry.disordered, odometry.repeated, "one motion after the other"),
                *_mended(REFERENCE, reference.disordered, reference.repeated, "left out but for the last of each"),
                *_mended(DETECTIONS, late, 0, ""),
                *filter(None, (_unended(self.path / name) for name in _TABLES)),
            ),
        )

    def _sorted_detections(self, rows: _Rows) -> tuple[_Rows, int]:
        """Rows scan by scan in order of stamps, and how many came after a later one; raises FileFormatError."""
        order = np.lexsort((rows.scanners, rows.stamps_ns))
        found = _Rows(rows.stamps_ns[order], rows.values[order], rows.scanners[order], rows.lines[order])
        empty = np.isnan(found.values[:, 0])
        same = (np.diff(found.stamps_ns) == 0) & (np.diff(found.scanners) == 0)
        mixed = np.flatnonzero(same & (empty[1:] | empty[:-1]))
        if len(mixed):
            where = f"line {found.lines[mixed[0] : mixed[0] + 2].max()}, column range"
            problem = "an empty row and another row have one stamp"
            raise FileFormatError(
                self.path / DETECTIONS, where, problem, "one empty row for a scan that saw no reflector"
            )
        return found, motion.count_disordered(rows.stamps_ns)

    def truth(self) -> Truth | None:
        """Read the constants of a virtual drive; None of a real vehicle. Raises FileFormatError."""
        return read_truth(self.path / TRUTH) if (self.path / TRUTH).exists() else None

    def reference_mount(self) -> ReferenceMount:
        """Read where on the vehicle the reference measures; base where nothing is said. Raises FileFormatError."""
        path = self.path / REFERENCE_MOUNT
        return read_reference_mount(path) if path.exists() else BASE

    def _scan_records(self, scanner: int) -> Iterator[Record]:
        for block in self._archives[scanner].blocks():
            named = replace(block, scanner=scanner)
            for index in range(len(named)):
                scan: Scan = named.scan(index)
                yield scan

    def _odometry_rows(self) -> Iterator[_Rows]:
        is_empty = True
        for block in _table(self.path / ODOMETRY, ODOMETRY_COLUMNS):
            is_empty = False
            columns = [block.numbers("dx", "m"), block.numbers("dy", "m"), block.numbers("dtheta", "rad")]
            yield _Rows(block.stamps(), np.stack(columns, axis=1))
        if is_empty:
            raise FileFormatError(self.path / ODOMETRY, "", "has no rows", "at least one row of odometry")

    def _reference_rows(self) -> Iterator[_Rows]:
        if not (self.path / REFERENCE).exists():
            return
        for block in _table(self.path / REFERENCE, REFERENCE_COLUMNS):
            stamps = block.stamps()
            theta = block.numbers("theta", "rad", empty=np.nan)
            yield _Rows(stamps, np.stack([block.numbers("x", "m"), block.numbers("y", "m"), theta], axis=1))

    def _detection_rows(self) -> Iterator[_Rows]:
        if not (self.path / DETECTIONS).exists():
            return
        numbers = {name: index for index, name in enumerate(self.scanners)}
        for block in _table(self.path / DETECTIONS, DETECTION_COLUMNS):
            stamps = block.stamps()
            values = np.stack(
                [block.numbers(c, u, empty=np.nan) for c, u in (("range", "m"), ("bearing", "rad"))], axis=1
            )
            _check_detections(block, values, np.isnan(values[:, 0]))
            yield _Rows(stamps, values, _scanners_of(block, numbers), np.array(block.lines, dtype=np.int64))


def _scanners_of(block: Block, numbers: dict[str, int]) -> IntArray:
    """(N,) scanner of each row; raises FileFormatError where a cell is no name of one."""
    if SCANNER_COLUMN not in block.columns:
        return np.zeros(len(block), np.int64)
    names = block.texts(SCANNER_COLUMN)
    for row, name in enumerate(names):
        if not is_name(name):
            raise block.error(row, SCANNER_COLUMN, f"is {name!r}", "the name of a scanner: letters, digits, - and _")
    return np.array([numbers[name] for name in names], dtype=np.int64)


def _mended(file: str, disordered: int, repeated: int, fate: str) -> Iterator[str]:
    """Say what was mended in a table."""
    if disordered:
        yield f"{file}: {disordered} rows came after a later one and are sorted"
    if repeated:
        yield f"{file}: {repeated} rows have a stamp that is taken and are {fate}"


def _unended(path: Path) -> str:
    """Say that the last row of a table may be cut; empty where it is not, or there is no table."""
    try:
        with path.open("rb") as file:
            if not file.seek(0, SEEK_END):
                return ""
            file.seek(-1, SEEK_END)
            if file.read(1) in b"\r\n":
                return ""
    except OSError:
        return ""
    return f"{path.name}: the last line has no end; if the file was cut there, its last number may lack digits"


def _name_in(path: Path) -> str:
    """Name of the scanner in `scans_NAME.npz`."""
    name = path.stem.partition("_")[2]
    if not is_name(name):
        raise FileFormatError(path, "", "names no scanner", "scans_NAME.npz: letters, digits, blanks inside, - and _")
    return name


def _table(path: Path, columns: tuple[str, ...]) -> Iterator[Block]:
    # Other columns are passed over: a recording is often exported from a table that holds more.
    return read_table(path, columns, (SCANNER_COLUMN,), ignore_unknown=True, bytes_at_once=_AT_ONCE)


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
    stamps, values = Growing(np.int64), Growing(np.float64, width)
    scanners, lines = Growing(np.int64), Growing(np.int64)
    for block in blocks:
        stamps.append(block.stamps_ns)
        values.append(block.values)
        scanners.append(block.scanners)
        lines.append(block.lines)
    return _Rows(stamps.array(), values.array(), scanners.array(), lines.array())
