"""What the recorder wrote, read back: every record to the last bit, whole or cut anywhere."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from commission.cli import main
from commission.errors import CommissionError, FileFormatError
from commission.io.recordings import mcap_recording
from commission.io.recordings.base import load_log, open_recording
from commission.io.recordings.channels import ChannelOptions
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.mcap_scans import McapScans
from commission.io.recordings.recorder import Recorder, write_mcap
from commission.site.disturbances import ScannerError
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan
from commission.site.reference_mount import ReferenceMount
from commission.site.truth import Truth

NAMES = ("front left", "rear")
COUNT = 24
"""Steps of a drive."""


def assert_same(found: Iterable[Record], expected: Iterable[Record]) -> None:
    for one, other in zip(found, expected, strict=True):
        assert type(one) is type(other)
        for each in fields(one):
            mine, theirs = getattr(one, each.name), getattr(other, each.name)
            assert (mine is None) == (theirs is None), each.name
            if mine is not None:
                np.testing.assert_array_equal(mine, theirs, each.name)


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


@st.composite
def drives(draw: st.DrawFn) -> list[Record]:
    """Random records of two scanners, in order of their stamps, from before 1970 on."""
    begin = draw(st.integers(-(10**15), 4 * 10**18 // 2))
    beams = [draw(st.integers(1, 9)) for _ in NAMES]
    has_strengths, has_flags = draw(st.booleans()), draw(st.booleans())
    found: list[Record] = []
    for step in range(draw(st.integers(1, 6))):
        stamp = begin + step * 40_000_001
        found.append(Odometry(stamp, np.array([draw(floats(-1, 1)), draw(floats(-1, 1)), draw(floats(-3, 3))])))
        theta = draw(st.one_of(st.just(math.nan), floats(-4, 4)))
        found.append(ReferencePose(stamp, np.array([draw(floats(-1e6, 1e6)), 2.0, theta])))
        for scanner in range(len(NAMES)):
            pairs = draw(st.lists(st.tuples(floats(0.01, 99), floats(-4, 4)), max_size=3))
            found.append(Detections(stamp, np.array(pairs).reshape(-1, 2), scanner))
        for scanner, count in enumerate(beams):
            ranges = draw(arrays(np.float32, count, elements=st.floats(0, 300, width=32) | st.just(math.nan)))
            strengths = draw(arrays(np.float32, count, elements=st.floats(0, 60000, width=32)))
            flags = draw(arrays(np.bool_, count))
            found.append(
                Scan(
                    stamp_ns=stamp,
                    ranges=ranges,
                    angle_min=draw(floats(-4, 4)),
                    angle_increment=draw(floats(0.001, 0.1)),
                    intensities=strengths if has_strengths else None,
                    reflector=flags if has_flags else None,
                    scanner=scanner,
                )
            )
    return found


@settings(max_examples=60, deadline=None)
@given(drives())
def test_every_record_comes_back_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, records: list[Record]
) -> None:
    path = tmp_path_factory.mktemp("drive") / "drive.mcap"
    write_mcap(path, records, scanners=NAMES)

    log = load_log(path)

    assert (log.scanners, log.notes) == (NAMES, ())
    assert_same(log.records(), records)


def test_truth_and_place_of_the_reference_come_back(tmp_path: Path) -> None:
    truth = Truth(seed=7, route="Ä loop", scanners=(ScannerError(scanner="rear", clock_offset=0.0123),))
    mount = ReferenceMount(antenna=(0.1, -0.2, 1.0), clock_offset=0.05)
    write_mcap(tmp_path / "drive.mcap", steps(), truth, scanners=NAMES, reference_mount=mount)

    recording = open_recording(tmp_path / "drive.mcap")

    assert (recording.truth(), recording.reference_mount()) == (truth, mount)
    assert (recording.load().truth, recording.load().reference_mount) == (truth, mount)


def steps(count: int = COUNT) -> list[Record]:
    """A drive that is long enough for several chunks of a second."""
    found: list[Record] = []
    for step in range(count):
        stamp = 10**18 + step * 250_000_000
        found.append(Odometry(stamp, np.array([0.1, 0.0, 0.01]) * (step > 0)))
        found.append(ReferencePose(stamp, np.array([0.1 * step, 0.0, 0.01 * step])))
        found.append(Detections(stamp, np.array([[2.0 + step, 0.5]])))
        for scanner in range(2):
            ranges = np.full(5, 1.0 + step + scanner, np.float32)
            flags = np.arange(5) == step % 5
            found.append(
                Scan(
                    stamp_ns=stamp, ranges=ranges, angle_min=-1.1, angle_increment=0.3, reflector=flags, scanner=scanner
                )
            )
    return found


def cut_after(path: Path, size: int) -> list[Record]:
    """Records of a file of which the first bytes are left; none where it says that it holds none."""
    cut = path.with_name("cut.mcap")
    cut.write_bytes(path.read_bytes()[:size])
    try:
        return list(load_log(cut).records())
    except FileFormatError as error:
        assert "\n" not in str(error)
        return []


def test_file_cut_at_any_byte_gives_what_was_complete(tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    write_mcap(path, steps(), scanners=NAMES)
    size = path.stat().st_size
    # Every byte of the last chunk's index, and some of all others.
    sizes = [*range(0, size, 211), *range(size - 100, size)]

    most = 0
    for kept in sizes:
        found = cut_after(path, kept)
        assert len(found) >= most, kept
        most = len(found)
        by_kind = {kind: [each for each in found if type(each) is kind] for kind in (Odometry, Scan, Detections)}
        for kind, records in by_kind.items():
            assert_same(records, [each for each in steps() if type(each) is kind][: len(records)])

    assert most == len(steps())


def test_cut_file_says_so_and_loses_the_last_second_only(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "live.mcap", NAMES)
    for record in steps():
        recorder.append(record)

    log = load_log(tmp_path / "live.mcap")

    assert log.notes == ("live.mcap was cut while it was recorded; it is read up to there",)
    assert log.last_ns >= steps()[-1].stamp_ns - 10**9
    assert_same(log.records(), steps()[: len(log)])
    recorder.close()


def test_records_out_of_order_are_sorted_and_equal_stamps_composed_and_both_told(tmp_path: Path) -> None:
    records = steps(4)
    again = [
        records[0],
        *records[5:10],
        *records[1:5],
        *records[10:],
        Odometry(records[-1].stamp_ns, np.array([0.2, 0, 0])),
    ]
    write_mcap(tmp_path / "drive.mcap", [*again, records[-1]], scanners=NAMES)

    log = load_log(tmp_path / "drive.mcap")

    assert log.odometry_stamps_ns.tolist() == [record.stamp_ns for record in records if isinstance(record, Odometry)]
    np.testing.assert_allclose(log.displacements[-1], [0.1 + 0.2 * math.cos(0.01), 0.2 * math.sin(0.01), 0.01])
    assert log.notes == (
        "1 rows of odometry have a stamp that is taken and are composed",
        "1 reference poses came after a later one and are sorted",
        "1 scans came after a later one and are sorted",
        "1 scans came after a later one and are sorted",
        "1 scans have a stamp that is taken and are left out",
    )


def test_scans_of_a_large_file_stay_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_recording, "IN_MEMORY", 100)
    write_mcap(tmp_path / "drive.mcap", steps(), scanners=NAMES)

    log = load_log(tmp_path / "drive.mcap")

    assert all(isinstance(scans, McapScans) for scans in log.scans)
    assert_same(log.records(), steps())
    expected = [record for record in steps() if isinstance(record, Scan) and record.scanner == 1]
    block = log.scans[1].chosen(np.array([20, 3]))
    assert_same([block.scan(0), block.scan(1)], [expected[20], expected[3]])
    assert len(log.scans[1].block(5, 5)) == 0


def test_what_all_scans_have_alike_takes_the_memory_of_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_recording, "IN_MEMORY", 0)
    alike = [
        Scan(stamp_ns=step, ranges=np.ones(5, np.float32), angle_min=-1.0, angle_increment=0.5) for step in range(9)
    ]
    write_mcap(tmp_path / "alike.mcap", alike)
    write_mcap(tmp_path / "two.mcap", [*alike[:8], replace(alike[8], angle_min=-1.5)])

    (store,), (other,) = (load_log(tmp_path / name).scans for name in ("alike.mcap", "two.mcap"))

    for values in (store.angle_min, store.angle_increment, store.beams):
        assert values.strides == (0,)
    assert [store.scan(step).angle_min for step in (0, 8)] == [-1.0, -1.0]
    assert [other.scan(step).angle_min for step in (0, 8)] == [-1.0, -1.5]


def test_topics_of_an_own_recording_can_be_named(tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", steps(), scanners=NAMES)

    log = load_log(tmp_path / "drive.mcap", ChannelOptions(channels=("scan=/rear/scan", "reference=none")))

    assert len(log.scans) == 1
    assert log.scans[0].scan(3).ranges.tolist() == [5.0] * 5
    assert not len(log.reference_stamps_ns)


@settings(max_examples=150, deadline=None)
@given(
    changes=st.lists(st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=4),
    kept=st.sampled_from([1.0, 1.0, 0.9, 0.5]),
)
def test_damaged_file_is_an_error_in_one_line_or_valid_records(
    tmp_path_factory: pytest.TempPathFactory, whole: bytes, changes: list[tuple[float, int]], kept: float
) -> None:
    content = bytearray(whole)
    for place, value in changes:
        content[int(place * len(content))] = value
    path = tmp_path_factory.mktemp("damaged") / "drive.mcap"
    path.write_bytes(content[: int(kept * len(content))])

    try:
        log: RecordLog = load_log(path)
    except CommissionError as error:
        assert "\n" not in str(error)
    else:
        stamps = [record.stamp_ns for record in log.records()]
        assert stamps == sorted(stamps)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("whole") / "drive.mcap"
    write_mcap(path, steps(), Truth(seed=3), scanners=NAMES)
    return path.read_bytes()


def run(*words: str) -> int:
    """Exit code of a command."""
    with pytest.raises(SystemExit) as ended:
        main(words)
    return int(str(ended.value.code))


def test_csv_folder_becomes_mcap_and_mcap_the_same_csv_folder(tmp_path: Path, capsys: Any) -> None:
    write_recording(tmp_path / "one", steps(), Truth(seed=3), scanners=NAMES)

    assert run("convert", str(tmp_path / "one"), str(tmp_path / "drive.mcap")) == 0
    assert run("convert", str(tmp_path / "drive.mcap"), str(tmp_path / "two")) == 0

    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "two").iterdir())
    for name in names:
        if name.endswith(".npz"):
            with np.load(tmp_path / "one" / name) as one, np.load(tmp_path / "two" / name) as two:
                assert sorted(one.files) == sorted(two.files)
                for array in one.files:
                    np.testing.assert_array_equal(one[array], two[array])
        else:
            assert (tmp_path / "one" / name).read_text() == (tmp_path / "two" / name).read_text()
    assert run("convert", str(tmp_path / "one"), str(tmp_path / "drive.mcap")) == 2
    assert "drive.mcap exists" in capsys.readouterr().err
    assert run("convert", str(tmp_path / "one"), str(tmp_path / "drive.pcap")) == 2
    assert "is read only; expected a folder for tables" in capsys.readouterr().err


def test_virtual_drive_is_written_as_mcap_and_localized_as_from_a_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for out in ("drive", "drive.mcap"):
        assert run("simulate", "maps/laboratory", "--seed", "3", "--out", str(tmp_path / out)) == 0
        assert run("localize", "maps/laboratory", str(tmp_path / out), "--out", str(tmp_path / f"{out} result")) == 0

    capsys.readouterr()
    one, two = ((tmp_path / f"{out} result" / "estimates.csv").read_bytes() for out in ("drive", "drive.mcap"))
    assert one == two


def test_memory_does_not_grow_with_the_scans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_recording, "IN_MEMORY", 0)
    beams, count = 1081, 8000
    ranges = np.random.default_rng(1).uniform(1.0, 30.0, beams).astype(np.float32)
    scans = (
        Scan(stamp_ns=step * 40_000_000, ranges=ranges, angle_min=-2.0, angle_increment=0.004) for step in range(count)
    )
    write_mcap(tmp_path / "long.mcap", scans)
    size = (tmp_path / "long.mcap").stat().st_size

    tracemalloc.start()
    try:
        log = load_log(tmp_path / "long.mcap")
        for first in range(0, count, 500):
            assert log.scans[0].block(first, first + 500).ranges[-1, -1] == ranges[-1]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()

    assert size > count * beams * 4
    # Three chunks of 4 MB are kept, and a block of 2 MB is made.
    assert peak < 22_000_000 < size / 1.5


def test_damaged_scan_in_a_large_file_is_told_when_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_recording, "IN_MEMORY", 0)
    path = tmp_path / "drive.mcap"
    write_mcap(path, steps(), scanners=NAMES)
    content = bytearray(path.read_bytes())
    place = content.index(np.full(5, 4.0, np.float32).tobytes())
    content[place] ^= 1
    path.write_bytes(content)

    log = load_log(path)

    with pytest.raises(FileFormatError, match="its checksum is another"):
        log.scans[0].scan(3)
