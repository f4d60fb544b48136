"""Scans that stay in their file are those in memory, to the bit; scans may differ in angles and number of beams."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.errors import FileFormatError
from commission.io.recordings import scan_file
from commission.io.recordings.base import load_log, open_recording
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.scan_file import ScanFile
from commission.localization.detection_log import extract_detections
from commission.localization.detector import detect
from commission.localization.setup import LocalizerSetup
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanLog
from commission.site.records import Odometry, Record, Scan
from tests.simulation.halls import hall

COLUMNS = ("stamps_ns", "ranges", "angle_min", "angle_increment", "beams", "intensities", "reflector")


def uneven(count: int) -> Iterator[Record]:
    """Scans of 540 to 542 beams whose angles jitter, each with a post of 8 beams at 3 m, the last at its end."""
    random = np.random.default_rng(3)
    yield Odometry(0, np.zeros(3))
    for step in range(1, count + 1):
        beams = 540 + int(random.integers(3))
        ranges = random.uniform(6.0, 9.0, beams).astype(np.float32)
        ranges[random.integers(beams, size=20)] = np.nan
        flags = np.zeros(beams, dtype=np.bool_)
        first = beams - 8 if step == count else int(random.integers(beams - 8))
        ranges[first : first + 8], flags[first : first + 8] = 3.0, True
        increment = np.radians(0.5) + random.normal(0.0, 1e-5)
        yield Scan(
            stamp_ns=40_000_000 * step,
            ranges=ranges,
            angle_min=-2.35 + random.normal(0.0, 1e-4),
            angle_increment=increment,
            intensities=random.uniform(0.0, 1.0, beams).astype(np.float32),
            reflector=flags,
        )


def same(one: ScanLog, other: ScanLog) -> None:
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), strict=True)


@pytest.fixture(params=["stored", "compressed"])
def folder(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    write_recording(tmp_path, uneven(60))
    if request.param == "compressed":
        with np.load(tmp_path / "scans.npz") as arrays:
            np.savez_compressed(tmp_path / "scans.npz", **arrays)
    return tmp_path


def in_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> RecordLog:
    monkeypatch.setattr(scan_file, "IN_MEMORY", 0)
    log = load_log(folder)
    assert isinstance(log.scans[0], ScanFile)
    return log


def test_uneven_scans_are_read_as_they_were_written(tmp_path: Path) -> None:
    write_recording(tmp_path, uneven(60))
    given, found = list(uneven(60)), list(open_recording(tmp_path).records())
    for one, other in zip(given, found, strict=True):
        assert one.stamp_ns == other.stamp_ns
        if isinstance(one, Scan) and isinstance(other, Scan):
            for name in ("ranges", "angle_min", "angle_increment", "intensities", "reflector"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name), strict=True)
    same(load_log(tmp_path).scans[0].block(0, 60), RecordLog.collect(given).scans[0].block(0, 60))


def test_scans_in_a_file_are_those_in_memory_wherever_they_are_read(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (memory,) = load_log(folder).scans
    (file,) = in_file(folder, monkeypatch).scans
    assert isinstance(memory, ScanLog)
    assert len(file) == len(memory) == 60
    for first, last in ((0, 60), (17, 18), (40, 60), (5, 5)):
        same(file.block(first, last), memory.block(first, last))
    chosen = np.array([50, 3, 3, 59])
    same(file.chosen(chosen), memory.chosen(chosen))
    np.testing.assert_array_equal(file.scan(33).ranges, memory.scan(33).ranges, strict=True)


def test_detections_are_the_same_from_a_file_from_memory_and_scan_by_scan(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = LocalizerSetup.of(hall())
    memory = extract_detections(load_log(folder), setup)
    file = extract_detections(in_file(folder, monkeypatch), setup)
    for name in ("offsets", "range_bearing", "beams", "status"):
        np.testing.assert_array_equal(getattr(file, name), getattr(memory, name), strict=True)
    assert len(memory.status) >= 60
    singly = [
        detect(scan, setup.detectors[0], setup.parameters.detector) for scan in uneven(60) if isinstance(scan, Scan)
    ]
    np.testing.assert_array_equal(memory.range_bearing, np.concatenate([each.range_bearing for each in singly]))
    np.testing.assert_array_equal(memory.beams, np.concatenate([each.beams for each in singly]))


def test_what_stands_behind_the_last_beam_of_a_scan_is_none(tmp_path: Path) -> None:
    write_recording(tmp_path, uneven(20))
    with np.load(tmp_path / "scans.npz") as given:
        arrays = dict(given)
    beyond = np.arange(arrays["ranges"].shape[1]) >= arrays["beams"][:, np.newaxis]
    assert beyond.any()
    before = load_log(tmp_path).scans[0].block(0, 20)
    arrays["ranges"][beyond], arrays["reflector"][beyond] = 1.0, True
    np.savez(tmp_path / "scans.npz", **arrays)
    same(load_log(tmp_path).scans[0].block(0, 20), before)


def test_threads_that_read_at_once_get_the_scans_they_asked_for(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (memory,) = load_log(folder).scans
    (file,) = in_file(folder, monkeypatch).scans
    asked = [first for _ in range(100) for first in range(0, 60, 3)]
    with ThreadPoolExecutor(4) as pool:
        for first, block in zip(asked, pool.map(file.block, asked, [first + 3 for first in asked]), strict=True):
            same(block, memory.block(first, first + 3))


def test_a_recording_that_another_one_replaces_is_read_as_it_was(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = load_log(folder).scans[0].block(0, 60)
    (file,) = in_file(folder, monkeypatch).scans
    write_recording(folder, uneven(90))
    same(file.block(0, 60), before)


def test_a_file_that_was_cut_meanwhile_is_an_error_and_no_garbage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_recording(tmp_path, uneven(60))
    (scans,) = in_file(tmp_path, monkeypatch).scans
    os.truncate(tmp_path / "scans.npz", 2000)
    with pytest.raises(FileFormatError, match="ends early"):
        scans.block(50, 60)


def test_scans_of_another_scanner_keep_its_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rear = (replace(each, scanner=1) if isinstance(each, Scan) else each for each in uneven(5))
    front = (each for each in uneven(5) if isinstance(each, Scan))
    write_recording(tmp_path, sorted((*rear, *front), key=lambda each: each.stamp_ns), scanners=("front", "rear"))
    log = in_file(tmp_path, monkeypatch)
    assert [scans.scanner for scans in log.scans] == [0, 1]
    assert [scans.scan(2).scanner for scans in log.scans] == [0, 1]
