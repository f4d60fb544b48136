"""The command `vision`, with a camera on a simulated drive of the bundled laboratory."""

import json

import numpy as np
import pytest

from commission.cli import main
from tests.conftest import REPOSITORY
from tests.virtual_camera import Camera, board, increments, place, seen

SITE = REPOSITORY / "maps" / "laboratory"
PIXELS = ("--focal-length", "1000", "--principal-point", "320", "240")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("vision") / "drive"
    with pytest.raises(SystemExit) as finished:
        main(["simulate", str(SITE), "--route", "P0-P1-P2-P3-P0", "--seed", "1", "--out", str(folder)])
    assert finished.value.code == 0
    return folder


def frames_of(recording):
    """Stamps and true poses of base for nine seconds."""
    rows = np.loadtxt(recording / "reference.csv", delimiter=",", skiprows=1)
    return rows[(rows[:, 0] >= 4e9) & (rows[:, 0] <= 13e9)][::3]


def write(path, stamps, pixels):
    lines = [
        f"{int(stamp)},p{i},{u + 320.0!r},{v + 240.0!r}\n"
        for stamp, frame in zip(stamps, pixels.tolist(), strict=True)
        for i, (u, v) in enumerate(frame)
    ]
    path.write_text("stamp_ns,point,u,v\n" + "".join(lines), encoding="utf-8")
    return path


def test_a_drive_tells_the_camera_and_its_motion(commission, recording, tmp_path):
    rows, camera = frames_of(recording), Camera()
    contour = write(recording / "contour.csv", rows[:, 0], seen(rows[:, 1:], camera, np.random.default_rng(7)))
    code, told, err = commission("vision", SITE, recording, "--out", tmp_path / "out", *PIXELS)
    assert (code, err) == (0, "")
    assert "of the motion" in told
    found = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    for name, unit, true in (("forward", "m", 0.235), ("left", "m", 0.03), ("depth", "m", 7.7), ("yaw", "rad", 0.02)):
        assert abs(found[f"{name}_{unit}"] - true) < 3.0 * found[f"{name}_sigma_{unit}"], name
    assert found["depth_sigma_m"] < 0.02
    assert found["difference_share_of_motion"] < 0.03 < found["closed_form_difference_share_of_motion"]
    table = np.genfromtxt(tmp_path / "out" / "vision.csv", delimiter=",", names=True)
    truth = increments(place(rows[:, 1:], camera))
    assert np.abs(table["vision_forward"] - truth[:, 0]).max() < 0.03 * 3.6
    assert np.abs(table["laser_left"] - truth[:, 1]).max() < 0.02
    contour.unlink()


@pytest.mark.parametrize(
    ("shape", "words", "reason"),
    [
        (board() * [1.0, 0.0], PIXELS, "is a line"),
        (board()[:3], PIXELS, "3 points"),
        (board() * 0.01, PIXELS, "focal lengths in extent"),
        (board(), (), "focal lengths from the axis"),
        (board(), ("--focal-length", "1000"), "--principal-point"),
    ],
)
def test_what_tells_no_motion_is_refused_with_its_reason(commission, recording, tmp_path, shape, words, reason):
    rows = frames_of(recording)[:20]
    pixels = seen(rows[:, 1:], Camera(), np.random.default_rng(1), contour=shape)
    contour = write(tmp_path / "contour.csv", rows[:, 0], pixels)
    code, _, err = commission("vision", SITE, recording, "--out", tmp_path / "out", "--contour", contour, *words)
    assert code == 2
    assert reason in err
    assert not (tmp_path / "out").exists()


def test_a_vehicle_that_stands_tells_no_depth(commission, recording, tmp_path):
    rows = np.loadtxt(recording / "reference.csv", delimiter=",", skiprows=1)[:30]
    contour = write(tmp_path / "contour.csv", rows[:, 0], seen(rows[:, 1:], Camera(), np.random.default_rng(2)))
    code, _, err = commission("vision", SITE, recording, "--out", tmp_path / "out", "--contour", contour, *PIXELS)
    assert code == 2
    assert "no depth" in err or "stands still" in err


def test_a_table_that_is_wrong_is_refused_where_it_is_wrong(commission, recording, tmp_path):
    path = tmp_path / "contour.csv"
    for text, reason in (
        ("stamp_ns,point,u,v\n", "has no rows"),
        ("stamp_ns,point,u,v\n1,a,0.1,\n", "line 2, column v"),
        ("stamp_ns,point,u,v\n1,a,0.1,0.1\n1,a,0.1,0.2\n", "line 3, column point"),
        ("stamp_ns,point,u\n1,a,0.1\n", "v"),
    ):
        path.write_text(text, encoding="utf-8")
        code, _, err = commission("vision", SITE, recording, "--out", tmp_path / "out", "--contour", path)
        assert code == 2
        assert reason in err
    assert "contour.csv" in commission("vision", SITE, recording, "--out", tmp_path / "out")[2]
