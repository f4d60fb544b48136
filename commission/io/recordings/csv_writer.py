"""The writing side of a CSV folder: any source's records become a recording. Memory does not grow with its length."""

from __future__ import annotations

import math
import os
import shutil
import zipfile
from array import array
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from commission.errors import FileFormatError
from commission.io.atomic import cannot_write, staged
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
from commission.io.recordings.truth_file import TRUTH, write_truth
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan
from commission.site.reference_mount import BASE, ReferenceMount
from commission.site.scanner import ONLY_NAME
from commission.site.truth import Truth


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
            for kind, name in ((Odometry, ODOMETRY), (Detections, DETECTIONS), (ReferencePose, REFERENCE))
        }
        for kind, columns in (
            (Odometry, ODOMETRY_COLUMNS),
            (Detections, DETECTION_COLUMNS if len(scanners) == 1 else (*DETECTION_COLUMNS, SCANNER_COLUMN)),
            (ReferencePose, REFERENCE_COLUMNS),
        ):
            tables[kind].write(",".join(columns) + "\n")
        files = [scans_file(scanners, index) for index in range(len(scanners))]
        writers = [_ScanWriter(scratch, folder / file, stack) for file in files]
        cells = [""] if len(scanners) == 1 else [f",{name}" for name in scanners]
        names = {ODOMETRY}
        for record in records:
            if isinstance(record, Scan):
                writers[record.scanner].add(record)
                names.add(files[record.scanner])
            else:
                tables[type(record)].write(_rows(record, cells))
                names.add({Odometry: ODOMETRY, Detections: DETECTIONS, ReferencePose: REFERENCE}[type(record)])
        for table in tables.values():
            table.flush()
            os.fsync(table.fileno())
        for writer in writers:
            writer.finish()
    return names


def _rows(record: Odometry | Detections | ReferencePose, scanners: Sequence[str]) -> str:
    """Lines of a record, detections with the cell of their scanner; `repr` of a number reads back as the same."""
    if isinstance(record, Detections):
        end = f"{scanners[record.scanner]}\n"
        if len(record.range_bearing) == 0:
            return f"{record.stamp_ns},,{end}"
        return "".join(f"{record.stamp_ns},{r!r},{b!r}{end}" for r, b in record.range_bearing.tolist())
    values = record.displacement if isinstance(record, Odometry) else record.pose
    return ",".join([str(record.stamp_ns), *("" if math.isnan(v) else repr(v) for v in values.tolist())]) + "\n"


class _ScanWriter:
    """Collect the rows of each array in a plain file; pack them when their number, which comes first, is known."""

    def __init__(self, scratch: Path, target: Path, stack: ExitStack) -> None:
        self.scratch = scratch
        self.target = target
        self.stack = stack
        self.files: dict[str, IO[bytes]] = {}
        self.first: Scan | None = None
        self.count = 0
        self.beams = array("q")
        self.angles = {"angle_min": array("d"), "angle_increment": array("d")}

    def add(self, scan: Scan) -> None:
        """Append one scan."""
        rows: dict[str, NDArray[Any] | None] = {
            "stamp_ns": np.array([scan.stamp_ns], dtype="<i8"),
            "ranges": np.asarray(scan.ranges, dtype="<f4"),
            "intensities": None if scan.intensities is None else np.asarray(scan.intensities, dtype="<f4"),
            "reflector": None if scan.reflector is None else np.asarray(scan.reflector, dtype=np.bool_),
        }
        present = {name: row for name, row in rows.items() if row is not None}
        if self.first is None:
            self.first = scan
            for name in present:
                self.files[name] = self.stack.enter_context(
                    (self.scratch / f"{self.target.stem}.{name}.raw").open("w+b")
                )
        if present.keys() != self.files.keys() or any(
            len(row) != len(scan.ranges) for name, row in present.items() if name != "stamp_ns"
        ):
            found = f"scan {self.count + 1} has other arrays than the first"
            raise FileFormatError(self.target, "", found, "the same arrays in all scans of one scanner")
        for name, row in present.items():
            self.files[name].write(row.tobytes())
        self.beams.append(len(scan.ranges))
        for name in self.angles:
            self.angles[name].append(getattr(scan, name))
        self.count += 1

    def finish(self) -> None:
        """Pack what was added into `scans.npz`."""
        if self.first is None:
            return
        most = max(self.beams)
        shapes = {name: (self.count, most) for name in self.files} | {"stamp_ns": (self.count,)}
        types = {"stamp_ns": "<i8", "ranges": "<f4", "intensities": "<f4", "reflector": "|b1"}
        with (self.scratch / self.target.name).open("wb") as target:
            with zipfile.ZipFile(target, "w", allowZip64=True) as archive:
                for name, values in self._small(most):
                    with archive.open(f"{name}.npy", "w") as member:
                        npy.write_array(member, values)
                for name, source in self.files.items():
                    info = zipfile.ZipInfo(f"{name}.npy")
                    # Flags shrink to almost nothing; noisy ranges would only cost time.
                    info.compress_type = zipfile.ZIP_DEFLATED if name == "reflector" else zipfile.ZIP_STORED
                    with archive.open(info, "w", force_zip64=True) as member:
                        header = {"descr": types[name], "fortran_order": False, "shape": shapes[name]}
                        npy.write_array_header_1_0(member, header)
                        source.seek(0)
                        if name == "stamp_ns" or min(self.beams) == most:
                            shutil.copyfileobj(source, member, 1 << 20)
                        else:
                            self._pad(source, member, np.dtype(types[name]), most)
            target.flush()
            os.fsync(target.fileno())

    def _small(self, most: int) -> Iterator[tuple[str, NDArray[Any]]]:
        """Angles, one number where they are those of all scans; beams of each scan where they differ."""
        for name, values in self.angles.items():
            column = np.array(values, dtype="<f8")
            yield name, np.array(column[0]) if (column == column[0]).all() else column
        if min(self.beams) < most:
            yield "beams", np.array(self.beams, dtype="<i8")

    def _pad(self, source: IO[bytes], member: IO[bytes], kind: np.dtype[Any], most: int) -> None:
        """Copy rows of different lengths; behind the last beam of a scan nothing came back."""
        nothing = np.full(most, np.nan if kind.kind == "f" else 0).astype(kind).tobytes()
        for beams in self.beams:
            row = source.read(beams * kind.itemsize)
            member.write(row + nothing[len(row) :])
