"""The fuzzing of readers finds what it shall: recordings that are read, and others that are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from commission.io.recordings.base import load_log
from tests.tools.fuzz_readers import check, fuzz, sound

NAMES = tuple(
    "pcap|pcapng|pcap of TCP|pcap of JSON|pcap of rosbridge|CARMEN|.mcap of others|own .mcap|.db3 of others|own .db3|"
    ".bag of others|own .bag|ROS 1, cut|odometry.csv|detections.csv|reference.csv|scans_rear.npz".split("|")
)


@pytest.mark.parametrize("name", NAMES)
def test_sound_recording_of_each_kind_is_read(tmp_path: Path, name: str) -> None:
    path = sound(tmp_path)[name]

    check(load_log(path.parent if path.suffix in (".csv", ".npz") else path))


def test_changed_recordings_are_read_or_refused_and_both_happen() -> None:
    told = fuzz(20 * len(NAMES), 3)

    assert {f"{name}: refused" for name in NAMES} <= set(told)
    assert sum(count for line, count in told.items() if line.endswith(": read")) > 40
    assert not any("slower" in line for line in told)
