from __future__ import annotations

import dataclasses
import io
import pickle
import tracemalloc
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError
from commission.io.recordings.base import load_log, open_recording
from commission.io.recordings.csv_writer import write_recording
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan
from commission.site.reference_mount import ReferenceMount

START = 1_700_000_000_000_000_000
"""A stamp of today: floating point does not hold such numbers of nanoseconds exactly."""


def drive(count: int, beams: int = 7, *, intensities: bool = True) -> Iterator[Record]:
    random = np.random.default_rng(1)
    for step in range(count):
        stamp = START + step * 40_000_000
        yield Odometry(stamp, random.normal(size=3))
        yield ReferencePose(stamp, np.array([1.0, 2.0, np.nan if step % 3 else 0.1]))
        yield Detections(stamp, np.abs(random.normal(size=(step % 4, 2))))
        ranges = np.abs(random.normal(size=beams)).astype(np.float32)
        ranges[step % beams] = np.nan
        strength = random.normal(size=beams).astype(np.float32) if intensities else None
        yield Scan(
            stamp_ns=stamp,
            ranges=ranges,
            angle_min=-1.0,
            angle_increment=0.01,
            intensities=strength,
            reflector=ranges > 1.0,
        )


def equal(first: object, second: object) -> bool:
    """Equal to the bit, types included; NaN equals NaN."""
    if type(first) is not type(second):
        return False
    if dataclasses.is_dataclass(first):
        return all(equal(getattr(first, f.name), getattr(second, f.name)) for f in dataclasses.fields(first))
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        same_bits = np.array_equal(first, second, equal_nan=first.dtype.kind == "f")
        return first.dtype == second.dtype and same_bits
    if isinstance(first, tuple) and isinstance(second, tuple):
        return len(first) == len(second) and all(map(equal, first, second))
    return first == second


def write(folder: Path, **files: str) -> Path:
    folder.mkdir(exist_ok=True)
    for name, text in {"odometry": "stamp_ns,dx,dy,dtheta\n0,0,0,0\n10,0.1,0,0\n", **files}.items():
        if text:
            (folder / f"{name}.csv").write_text(text)
    return folder


def write_scans(folder: Path, **changes: object) -> Path:
    arrays = {
        "stamp_ns": np.array([5, 15], dtype=np.int64),
        "ranges": np.ones((2, 3), dtype=np.float32),
        "angle_min": np.float64(-1.0),
        "angle_increment": np.float64(1.0),
        "reflector": np.zeros((2, 3), dtype=np.bool_),
    }
    arrays = {name: value for name, value in {**arrays, **changes}.items() if value is not None}
    np.savez(write(folder) / "scans.npz", **arrays)  # type: ignore[arg-type]
    return folder


@pytest.mark.parametrize("intensities", [False, True])
def test_recording_that_is_written_and_read_again_is_equal_to_the_bit(tmp_path: Path, intensities: bool) -> None:
    records = list(drive(3000, intensities=intensities))
    write_recording(tmp_path / "drive", records)
    read = list(open_recording(tmp_path / "drive").records())
    assert len(read) == len(records)
    assert all(equal(a, b) for a, b in zip(records, read, strict=True))


def test_loaded_columns_equal_the_collected_records(tmp_path: Path) -> None:
    write_recording(tmp_path, drive(500))
    assert equal(load_log(tmp_path), RecordLog.collect(open_recording(tmp_path).records()))


def test_streaming_needs_memory_that_does_not_grow_with_the_recording(tmp_path: Path) -> None:
    def peak(count: int) -> int:
        write_recording(tmp_path / str(count), drive(count, beams=500))
        tracemalloc.start()
        for _ in open_recording(tmp_path / str(count)).records():
            pass
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    # 12,000 scans of 500 beams are 54 MB; the reader holds blocks of about 4 MB, before and after conversion.
    assert peak(12_000) < 1.5 * peak(6_000) < 45e6


def test_failing_source_leaves_the_old_recording(tmp_path: Path) -> None:
    write_recording(tmp_path, drive(10))
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def broken() -> Iterator[Record]:
        yield from drive(5)
        raise FileFormatError("source", "", "ends early", "more")

    with pytest.raises(FileFormatError, match="ends early"):
        write_recording(tmp_path, broken())
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_new_recording_without_scans_removes_the_old_scans(tmp_path: Path) -> None:
    write_recording(tmp_path, drive(3))
    write_recording(tmp_path, (record for record in drive(3) if isinstance(record, Odometry)))
    assert [path.name for path in tmp_path.iterdir()] == ["odometry.csv"]


def test_scan_of_another_scanner_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="scan 3 has other arrays than the first"):
        write_recording(tmp_path, [*drive(2), *drive(1, intensities=False)])


def test_records_of_one_stamp_begin_with_motion(tmp_path: Path) -> None:
    folder = write(
        tmp_path,
        detections="stamp_ns,range,bearing\n10,1,0\n10,2,0.5\n20,,\n",
        reference="stamp_ns,x,y,theta\n10,1,2,\n",
    )
    records = list(open_recording(folder).records())
    assert [type(r).__name__ for r in records] == ["Odometry", "Odometry", "ReferencePose", "Detections", "Detections"]
    assert [len(r.range_bearing) for r in records if isinstance(r, Detections)] == [2, 0]
    assert equal(load_log(folder), RecordLog.collect(records))


def test_one_row_and_long_pauses_are_a_recording(tmp_path: Path) -> None:
    assert len(load_log(write(tmp_path / "one", odometry="stamp_ns,dx,dy,dtheta\n0,0,0,0\n"))) == 1
    pause = "stamp_ns,dx,dy,dtheta\n0,0,0,0\n3600000000000,0,0,0\n"
    assert len(load_log(write(tmp_path / "pause", odometry=pause))) == 2


def test_table_of_a_european_spreadsheet_is_read(tmp_path: Path) -> None:
    table = "\ufeffdtheta;extra;dx;dy;stamp_ns\n0;x;0;0;0\n0,1;;0,5;-1e-3;10\n"
    assert load_log(write(tmp_path, odometry=table)).displacements[1].tolist() == [0.5, -0.001, 0.1]


ODOMETRY_ERRORS = [
    ("", "odometry.csv: does not exist; expected the recording's odometry"),
    ("stamp_ns,dx,dy,dtheta\n", "has no rows; expected at least one row of odometry"),
    ("stamp_ns,dx,dy\n0,0,0\n", "line 1: the header 'stamp_ns,dx,dy' has no column dtheta"),
    ("stamp_ns,dx,dy,dtheta\n0,0,nan,0\n", "line 2, column dy: is nan; expected a finite number [m]"),
    ("stamp_ns,dx,dy,dtheta\n0,0,0,left\n", "line 2, column dtheta: is 'left'; expected a number [rad]"),
    (
        "stamp_ns,dx,dy,dtheta\n0,0,0,0\n1.5,0,0,0\n",
        "line 3, column stamp_ns: is '1.5'; expected a whole number of nano",
    ),
    ("stamp_ns,dx,dy,dtheta\n0,0,0\n", "line 2: has 3 cells; expected 4 cells, one for each of: stamp_ns, dx, dy, d"),
    (f"stamp_ns,dx,dy,dtheta\n{10**30},0,0,0\n", "expected a whole number of nanoseconds"),
    *(
        (f"stamp_ns,dx,dy,dtheta\n{stamp},0,0,0\n", f"is '{stamp}'; expected a whole number of nanoseconds, less than")
        for stamp in (2**62, -(2**62), 2**63 - 1, -(2**63), 2**64 - 1)
    ),
]
DETECTION_ERRORS = [
    ("0,1,\n", "line 2, column bearing: is empty; expected range and bearing, or neither"),
    ("0,,1\n", "line 2, column range: is empty; expected range and bearing, or neither"),
    ("0,-1,0\n", "line 2, column range: is -1; expected more than 0 m"),
    ("0,0,0\n", "line 2, column range: is 0; expected more than 0 m, or an empty range and bearing"),
    ("0,1,0\n0,,\n", "line 3, column range: an empty row and another row have one stamp"),
    ("0,,\n0,,\n", "line 3, column range: an empty row and another row have one stamp"),
    ("0,1,inf\n", "line 2, column bearing: is inf; expected a finite number [rad]"),
]


@pytest.mark.parametrize("whole", [False, True], ids=["streamed", "loaded"])
@pytest.mark.parametrize(
    ("file", "text", "message"),
    [("odometry", text, message) for text, message in ODOMETRY_ERRORS]
    + [("detections", "stamp_ns,range,bearing\n" + text, message) for text, message in DETECTION_ERRORS]
    + [
        (
            "reference",
            "stamp_ns,x,y,theta\n0,1,,0\n",
            "reference.csv: line 2, column y: is empty; expected a number [m]",
        )
    ],
)
def test_wrong_table_is_one_line_with_line_and_column(
    tmp_path: Path, file: str, text: str, message: str, whole: bool
) -> None:
    folder = write(tmp_path, **{"detections": "stamp_ns,range,bearing\n", file: text})
    with pytest.raises(FileFormatError) as caught:
        recording = open_recording(folder)
        if whole:
            recording.load()
        else:
            list(recording.records())
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ranges": None}, "array ranges: is missing"),
        ({"angle_min": None}, "array angle_min: is missing"),
        ({"ranges": np.ones((2, 3))[:, :2]}, "array reflector: has shape (2, 3); expected (2, 2) like ranges"),
        ({"ranges": np.ones(6)}, "array ranges: has shape (6,)"),
        ({"ranges": np.full((2, 3), -1.0)}, "array ranges: is -1 in row 0, beam 0; expected 0 m or more"),
        ({"ranges": np.ones((2, 3), dtype=np.int32)}, "array ranges: is int32; expected floats"),
        ({"ranges": np.array([[1, None, 2]] * 2, dtype=object)}, "array ranges: is pickled"),
        ({"stamp_ns": np.array([5.0, 15.0])}, "array stamp_ns: is float64 (2,); expected int64 (N,) nanoseconds"),
        *(
            (
                {"stamp_ns": np.array([5, stamp], kind)},
                f"array stamp_ns: is {stamp} in row 1; expected nanoseconds, less",
            )
            for stamp, kind in ((2**62, np.int64), (2**63 - 1, np.int64), (2**64 - 1, np.uint64), (2**62, np.uint64))
        ),
        ({"stamp_ns": np.array([-(2**63), 5])}, f"array stamp_ns: is {-(2**63)} in row 0; expected nanoseconds, less"),
        ({"angle_min": np.float64(np.nan)}, "array angle_min: is nan; expected an angle in radians"),
        ({"angle_min": np.zeros(3)}, "array angle_min: is float64 (3,); expected one number, or one for each scan"),
        ({"angle_min": np.array([0.0, 99.0])}, "array angle_min: is 99 in row 1; expected an angle in radians"),
        ({"angle_increment": np.array([0.1, 0.0])}, "array angle_increment: is 0; expected the step"),
        ({"beams": np.array([3, 4])}, "array beams: is 4 in row 1; expected 1 to 3, as many as ranges has columns"),
        ({"beams": np.array([0, 3])}, "array beams: is 0 in row 0; expected 1 to 3"),
        ({"beams": np.array([3.0, 3.0])}, "array beams: is float64 (2,); expected whole numbers, one for each scan"),
        ({"angle_increment": np.float64(0.0)}, "array angle_increment: is 0"),
    ],
)
def test_wrong_scans_are_one_line_with_array_found_and_expected(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    with pytest.raises(FileFormatError) as caught:
        load_log(write_scans(tmp_path, **changes))
    assert message in str(caught.value)


def test_the_first_and_the_last_stamp_that_is_taken_keep_their_order(tmp_path: Path) -> None:
    first, last = 1 - 2**62, 2**62 - 1
    folder = write_scans(tmp_path, stamp_ns=np.array([first, last]))
    (folder / "odometry.csv").write_text(f"stamp_ns,dx,dy,dtheta\n{first},0,0,0\n{last},0,0,0\n")
    log = load_log(folder)
    assert log.odometry_stamps_ns.tolist() == [first, last]
    (scans,) = log.scans
    assert scans.stamps_ns.tolist() == [first, last]
    assert np.diff(log.odometry_stamps_ns).tolist() == [last - first]


def test_infinite_range_means_that_nothing_came_back(tmp_path: Path) -> None:
    scans = load_log(write_scans(tmp_path, ranges=np.full((2, 3), np.inf, dtype=np.float64))).scans[0]
    assert scans is not None
    assert scans.ranges.dtype == np.float32
    assert np.isnan(scans.ranges).all()


def test_pickle_in_place_of_an_archive_is_refused(tmp_path: Path) -> None:
    (write(tmp_path) / "scans.npz").write_bytes(pickle.dumps({"ranges": [1.0]}))
    with pytest.raises(FileFormatError, match=r"is damaged .* expected a complete npz archive"):
        open_recording(tmp_path)


def test_header_that_promises_more_than_the_archive_holds_is_refused(tmp_path: Path) -> None:
    write_scans(tmp_path)
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (10**12, 3)})
    with zipfile.ZipFile(tmp_path / "scans.npz") as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(tmp_path / "scans.npz", "w") as archive:
        for name, content in {**members, "ranges.npy": header.getvalue()}.items():
            archive.writestr(name, content)
    with pytest.raises(FileFormatError, match="has another size than its shape"):
        open_recording(tmp_path)


def test_archive_that_would_unpack_into_far_more_than_it_is_is_refused_before_that(tmp_path: Path) -> None:
    # 400 MB of "nothing came back" in 400 kB, made without ever holding them.
    rows, beams = 100_000, 1000
    write_scans(tmp_path)
    with zipfile.ZipFile(tmp_path / "scans.npz") as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(tmp_path / "scans.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            if name != "ranges.npy":
                archive.writestr(name, content)
        with archive.open("ranges.npy", "w", force_zip64=True) as file:
            np.lib.format.write_array_header_1_0(file, {"descr": "<f4", "fortran_order": False, "shape": (rows, beams)})
            zeros = bytes(4 * beams * 1000)
            for _ in range(rows // 1000):
                file.write(zeros)
    tracemalloc.start()
    with pytest.raises(FileFormatError, match=r"would unpack \d+ bytes into 4\d+; expected at most 200 times its size"):
        open_recording(tmp_path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5_000_000


def test_array_whose_header_is_longer_than_any_is_refused_before_it_is_read(tmp_path: Path) -> None:
    write_scans(tmp_path)
    with zipfile.ZipFile(tmp_path / "scans.npz") as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    # Version 2 announces the length of its header in 32 bits.
    members["ranges.npy"] = b"\x93NUMPY\x02\x00" + (2**32 - 1).to_bytes(4, "little") + b"{"
    with zipfile.ZipFile(tmp_path / "scans.npz", "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    with pytest.raises(FileFormatError, match=r"array ranges: is no array \(version 2\.0 of the npy format\)"):
        open_recording(tmp_path)


@pytest.mark.parametrize("path", ["absent", "empty", "file"])
def test_what_is_no_recording_is_said_in_one_line(tmp_path: Path, path: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("x")
    with pytest.raises(FileFormatError, match=r"does not exist|is no recording"):
        open_recording(tmp_path / path)


@given(data=st.data())
@settings(max_examples=150)
def test_damaged_recording_is_one_line_or_records(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("drive")
    write_recording(folder, drive(3, beams=3))
    path = folder / data.draw(st.sampled_from(["odometry.csv", "detections.csv", "reference.csv", "scans.npz"]))
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(0, 5))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)) | st.just(len(content)))])
    for read in (load_log, lambda folder: list(open_recording(folder).records())):
        try:
            read(folder)
        except CommissionError as error:
            assert "\n" not in str(error)


BOTH = ("front left", "rear right")


def of_two(count: int) -> Iterator[Record]:
    """Scans and detections of two scanners with different beams; at every third stamp both have detected."""
    for k in range(count):
        stamp = 10 * k
        yield Odometry(stamp, np.array([0.01, 0.0, 0.001]))
        for scanner in (0, 1) if k % 3 == 0 else (k % 2,):
            yield Detections(stamp, np.array([[1.0 + k, 0.1 * scanner]] * (k % 4)).reshape(-1, 2), scanner)
        for scanner in (0, 1):
            beams = 5 + scanner
            yield Scan(
                stamp_ns=stamp,
                ranges=np.full(beams, 1.0 + k, dtype=np.float32),
                angle_min=-1.0 - scanner,
                angle_increment=0.01,
                reflector=np.zeros(beams, dtype=np.bool_),
                scanner=scanner,
            )


def test_recording_of_two_scanners_names_them_and_reads_back_to_the_bit(tmp_path: Path) -> None:
    records = list(of_two(40))
    write_recording(tmp_path / "drive", records, scanners=BOTH)
    names = sorted(path.name for path in (tmp_path / "drive").iterdir())
    assert names == ["detections.csv", "odometry.csv", "scans_front left.npz", "scans_rear right.npz"]
    recording = open_recording(tmp_path / "drive")
    assert recording.scanners == BOTH
    read = list(recording.records())
    assert len(read) == len(records)
    assert all(equal(a, b) for a, b in zip(records, read, strict=True))
    assert equal(recording.load(), RecordLog.collect(records, BOTH))


def test_recording_of_one_scanner_replaces_that_of_two(tmp_path: Path) -> None:
    write_recording(tmp_path, of_two(3), scanners=BOTH)
    write_recording(tmp_path, drive(3))
    assert [path.name for path in sorted(tmp_path.glob("scans*"))] == ["scans.npz"]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("0,1,0,a\n0,,,a\n", "an empty row and another row have one stamp"),
        ("0,1,0,\n", "line 2, column scanner: is ''"),
        ("0,1,0,a/b\n", "line 2, column scanner: is 'a/b'; expected the name of a scanner"),
    ],
)
def test_rows_of_scanners_that_cannot_be_are_refused(tmp_path: Path, rows: str, message: str) -> None:
    write(tmp_path, detections=f"stamp_ns,range,bearing,scanner\n{rows}")
    for read in (load_log, lambda path: list(open_recording(path).records())):
        with pytest.raises(FileFormatError) as refused:
            read(tmp_path)
        assert message in str(refused.value)


def test_an_empty_row_of_one_scanner_may_stand_beside_rows_of_another(tmp_path: Path) -> None:
    write(tmp_path, detections="stamp_ns,range,bearing,scanner\n0,,,b\n0,2,0,a\n5,1,0,b\n")
    log = load_log(tmp_path)
    assert (log.scanners, log.detection_scanners.tolist()) == (("b", "a"), [0, 1, 0])
    assert log.detection_offsets.tolist() == [0, 0, 1, 2]


def test_scans_without_a_name_beside_detections_of_two_scanners_are_refused(tmp_path: Path) -> None:
    write_scans(tmp_path)
    write(tmp_path, detections="stamp_ns,range,bearing,scanner\n0,1,0,a\n5,1,0,b\n")
    with pytest.raises(FileFormatError, match=r"is of one scanner, detections\.csv of a, b"):
        load_log(tmp_path)


def test_scans_with_and_without_a_name_are_refused(tmp_path: Path) -> None:
    write_scans(tmp_path)
    (tmp_path / "scans.npz").rename(tmp_path / "scans_a.npz")
    assert load_log(tmp_path).scanners == ("a",)
    write_scans(tmp_path)
    with pytest.raises(FileFormatError, match=r"is there besides scans_a\.npz"):
        load_log(tmp_path)


def test_a_reference_says_where_it_measures_and_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    mount = ReferenceMount(antenna=(0.7, -0.125, 1.9), clock_offset=0.0125)
    write_recording(tmp_path, drive(3), reference_mount=mount)
    assert load_log(tmp_path).reference_mount == mount
    # Written anew without one, nothing of it is left.
    write_recording(tmp_path, drive(3))
    assert not (tmp_path / "reference.json").exists()
    assert load_log(tmp_path).reference_mount == ReferenceMount()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is no JSON"),
        ('{"antenna": [NaN, 1.0]}', "holds NaN, for which JSON has no word; expected finite numbers"),
        ('{"clock_offset": -Infinity}', "holds -Infinity, for which"),
        ("[1]", "an object with antenna"),
        ('{"antenna": [1.0]}', "has 1 numbers; expected x, y"),
        ('{"antenna": "left"}', "antenna"),
        ('{"lever": [1, 2]}', "lever"),
        ('{"schema": 2}', "schema: is 2"),
        ('{"clock_offset": 1e9}', "clock_offset is 1e"),
    ],
)
def test_a_description_of_a_reference_that_is_none_is_refused(tmp_path: Path, text: str, message: str) -> None:
    write_recording(tmp_path, drive(3))
    (tmp_path / "reference.json").write_text(text, encoding="utf-8")
    with pytest.raises(FileFormatError, match=message):
        load_log(tmp_path)
