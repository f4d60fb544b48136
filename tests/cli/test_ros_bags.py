from __future__ import annotations

from pathlib import Path

import pytest

from commission.cli import main
from commission.io.recordings.base import load_log
from tests.io.recordings import ros_bags as bags
from tests.io.recordings.ros_bags import KINDS, START

SHOT = [2.0, 2.5, 3.0]


def run(*words: str) -> int:
    """Exit code of a command."""
    with pytest.raises(SystemExit) as ended:
        main(words)
    return int(str(ended.value.code))


def bag(folder: Path, kind: str, *, two: bool = False) -> Path:
    messages = [
        message
        for step in range(5)
        for message in (
            bags.odometry(START + step * 40_000_000, (0.02 * step, 0.0, 0.0)),
            bags.scan(START + step * 40_000_000, SHOT, intensities=[10.0, 300.0, 20.0]),
        )
    ]
    more = [bags.odometry(START, (0.0, 0.0, 0.0), topic="/odom_filtered")] if two else []
    return bags.write_bag(folder / f"drive{kind[1:]}{kind}", [*messages, *more])


@pytest.mark.parametrize("kind", KINDS)
def test_bag_is_localized_inspected_and_converted(
    tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = bag(tmp_path, kind)

    assert run("convert", str(path), str(tmp_path / "csv")) == 0
    assert run("inspect", str(path)) == 0
    assert (
        run("localize", "maps/laboratory", str(path), "--out", str(tmp_path / "out"), "--initial-pose", "2,2.2,0") == 0
    )

    told = capsys.readouterr().out
    assert "Scans        5 from 0.00 to 0.16 s, 25/s" in told
    assert "Note         the odometry is /odom (nav_msgs/msg/Odometry)" in told
    assert (tmp_path / "out" / "estimates.csv").is_file()
    converted, direct = load_log(tmp_path / "csv"), load_log(path)
    assert converted.displacements.tolist() == direct.displacements.tolist()
    assert converted.scans[0].scan(2).ranges.tolist() == SHOT


def test_choice_between_topics_is_asked_for_and_taken(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(bag(tmp_path, ".mcap", two=True))

    assert run("inspect", path) == 2
    assert "2 topics of odometry: /odom" in capsys.readouterr().err
    assert not run("inspect", path, "--channel", "odometry=/odom")
    assert run("inspect", path, "--channel", "odom") == 2
    assert "--channel is 'odom'; expected scan=TOPIC" in capsys.readouterr().err


def test_strict_inspection_ends_with_an_error_where_something_looks_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(bag(tmp_path, ".mcap"))

    assert not run("inspect", path)
    assert run("inspect", path, "--strict") == 2
    assert "things look wrong; the first:" in capsys.readouterr().err


def test_csv_folder_has_no_topics_to_choose_from(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("convert", str(bag(tmp_path, ".mcap")), str(tmp_path / "csv"))

    assert run("inspect", str(tmp_path / "csv"), "--channel", "odometry=/odom") == 2
    assert "is a CSV folder" in capsys.readouterr().err


def test_bag_without_odometry_is_no_standing_vehicle(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scans = [bags.scan(START + step * 40_000_000, SHOT, intensities=[10.0, 300.0, 20.0]) for step in range(5)]
    path = str(bags.write_bag(tmp_path / "still.mcap", scans))

    assert run("localize", "maps/laboratory", path, "--out", str(tmp_path / "out"), "--initial-pose", "2,2.2,0") == 2
    assert "holds no odometry" in capsys.readouterr().err
    assert run("inspect", path) == 0
    assert "how the vehicle moved is not known" in capsys.readouterr().out
    assert run("inspect", "--strict", path) == 2


def test_bag_without_scans_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    moves = [bags.odometry(START + step * 40_000_000, (0.02 * step, 0.0, 0.0)) for step in range(5)]
    path = str(bags.write_bag(tmp_path / "blind.mcap", moves))

    assert run("inspect", path) == 0
    assert "the recording holds no scan and no detection" in capsys.readouterr().out
    assert run("inspect", "--strict", path) == 2
