"""Scans one by one into a `scans.npz`, whose number is known at the end only. Memory does not grow with its length."""

from __future__ import annotations

import os
import shutil
import zipfile
from array import array
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from commission.errors import FileFormatError
from commission.site.records import Scan


class ScanWriter:
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
