"""Folders as real logs fill them: rows out of order, stamps that come twice, arrays that lie by columns."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from commission.io.recordings import scan_file
from commission.io.recordings.base import load_log, open_recording
from commission.site.records import Detections, Odometry, ReferencePose, Scan

QUARTER = math.pi / 2.0
RANGES = np.arange(1.0, 13.0).reshape(4, 3)


def folder(path: Path, **tables: str) -> Path:
    """A folder with tables by name; odometry of one row where none is given."""
    for name, text in {"odometry": "stamp_ns,dx,dy,dtheta\n0,0,0,0\n", **tables}.items():
        (path / f"{name}.csv").write_text(text, encoding="utf-8")
    return path


def with_scans(path: Path, **arrays: np.ndarray) -> Path:
    angles = {"angle_min": np.float64(-0.1), "angle_increment": np.float64(0.1)}
    np.savez(
        folder(path) / "scans.npz", **(angles | {"ranges": RANGES, "stamp_ns": np.array([10, 20, 30, 40])} | arrays)
    )
    return path


def scans_of(path: Path, *, streamed: bool) -> list[Scan]:
    if streamed:
        return [record for record in open_recording(path).records() if isinstance(record, Scan)]
    (scans,) = load_log(path).scans
    return [scans.scan(index) for index in range(len(scans))]


def test_motion_of_one_stamp_is_one_after_the_other_and_late_rows_are_sorted(tmp_path: Path) -> None:
    rows = f"0,0,0,0\n20,1,0,{QUARTER}\n20,2,0,0\n10,5,0,0\n30,1,0,0\n"
    log = load_log(folder(tmp_path, odometry=f"stamp_ns,dx,dy,dtheta\n{rows}"))
    assert log.odometry_stamps_ns.tolist() == [0, 10, 20, 30]
    # One metre ahead, a quarter turn to the left, two metres ahead: seen from where it began, one ahead and two left.
    assert log.displacements == pytest.approx(np.array([[0, 0, 0], [5, 0, 0], [1, 2, QUARTER], [1, 0, 0]]))
    assert log.notes == (
        "odometry.csv: 1 rows came after a later one and are sorted",
        "odometry.csv: 1 rows have a stamp that is taken and are one motion after the other",
    )
    streamed = [record for record in open_recording(tmp_path).records() if isinstance(record, Odometry)]
    assert [record.stamp_ns for record in streamed] == [0, 10, 20, 30]


def test_of_two_reference_poses_of_one_stamp_the_last_one_stands(tmp_path: Path) -> None:
    log = load_log(folder(tmp_path, reference="stamp_ns,x,y,theta\n5,1,0,0\n5,2,0,0\n3,9,0,0\n"))
    assert log.reference_stamps_ns.tolist() == [3, 5]
    assert log.reference_poses[:, 0].tolist() == [9, 2]
    assert log.notes == (
        "reference.csv: 1 rows came after a later one and are sorted",
        "reference.csv: 1 rows have a stamp that is taken and are left out but for the last of each",
    )
    streamed = [record for record in open_recording(tmp_path).records() if isinstance(record, ReferencePose)]
    assert [record.pose[0] for record in streamed] == [9, 2]


@pytest.mark.parametrize("streamed", [False, True])
def test_detections_out_of_order_are_gathered_scan_by_scan(tmp_path: Path, streamed: bool) -> None:
    rows = "20,1,0,a\n20,2,0,b\n20,3,0,a\n10,,,b\n10,4,0,a\n"
    folder(tmp_path, detections=f"stamp_ns,range,bearing,scanner\n{rows}")
    source = open_recording(tmp_path)
    records = source.records() if streamed else load_log(tmp_path).records()
    found = [
        (record.stamp_ns, source.scanners[record.scanner], record.range_bearing[:, 0].tolist())
        for record in records
        if isinstance(record, Detections)
    ]
    assert found == [(10, "a", [4]), (10, "b", []), (20, "a", [1, 3]), (20, "b", [2])]
    assert load_log(tmp_path).notes == ("detections.csv: 2 rows came after a later one and are sorted",)


def test_what_is_in_order_is_told_nothing_of(tmp_path: Path) -> None:
    with_scans(tmp_path)
    folder(
        tmp_path, detections="stamp_ns,range,bearing\n0,1,0\n0,2,0\n5,1,0\n", reference="stamp_ns,x,y,theta\n5,1,0,\n"
    )
    assert load_log(tmp_path).notes == ()


@pytest.mark.parametrize("streamed", [False, True])
@pytest.mark.parametrize("in_memory", [10**9, 0], ids=["in memory", "from the file"])
@pytest.mark.parametrize("at_once", [4_000_000, 1], ids=["at once", "row by row"])
def test_arrays_by_columns_and_scans_out_of_order_are_read_as_if_they_lay_right(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, streamed: bool, in_memory: int, at_once: int
) -> None:
    monkeypatch.setattr(scan_file, "IN_MEMORY", in_memory)
    monkeypatch.setattr("commission.io.recordings.scan_archive.BYTES_AT_ONCE", at_once)
    with_scans(
        tmp_path,
        ranges=np.asfortranarray(RANGES),
        intensities=RANGES * 10.0,
        stamp_ns=np.array([30, 10, 20, 30]),
        angle_min=np.array([-0.3, -0.1, -0.2, -0.3]),
        beams=np.array([3, 1, 2, 3]),
    )
    scans = scans_of(tmp_path, streamed=streamed)
    assert [scan.stamp_ns for scan in scans] == [10, 20, 30]
    assert [scan.ranges.tolist() for scan in scans] == [[4.0], [7.0, 8.0], [1.0, 2.0, 3.0]]
    assert [scan.intensities.tolist() for scan in scans] == [[40.0], [70.0, 80.0], [10.0, 20.0, 30.0]]
    assert [scan.angle_min for scan in scans] == [-0.1, -0.2, -0.3]
    assert load_log(tmp_path).notes == (
        "scans.npz: 2 scans came after a later one and are sorted",
        "scans.npz: 1 scans have a stamp that is taken and are left out",
    )


@pytest.mark.parametrize("compressed", [False, True])
def test_an_array_by_columns_is_that_by_rows(tmp_path: Path, compressed: bool) -> None:
    rows, columns = tmp_path / "rows", tmp_path / "columns"
    for path in (rows, columns):
        path.mkdir()
    with_scans(rows)
    save = np.savez_compressed if compressed else np.savez
    with np.load(with_scans(columns) / "scans.npz") as arrays:
        found = {name: np.asfortranarray(arrays[name]) for name in arrays.files}
    save(columns / "scans.npz", **found)
    for one, other in zip(scans_of(rows, streamed=False), scans_of(columns, streamed=False), strict=True):
        assert one.ranges.tolist() == other.ranges.tolist()
    assert load_log(columns).notes == ()
