"""`localize` of a vehicle that nobody locates: it is looked for, and the messages say from when on it is known."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest


def test_a_vehicle_that_nobody_locates_is_looked_for_and_says_so_in_messages(
    commission: Callable[..., tuple[int, str, str]], project: Path, recording: Path, tmp_path: Path
) -> None:
    messages = tmp_path / "states.jsonl"
    options = ("--initial-pose", "auto", "--vda5050", messages)
    code, told, err = commission("localize", project, recording, "--out", tmp_path / "out", *options)
    assert (code, err) == (0, "")
    assert re.search(r"Start +x 0\.\d+ m, y -?0\.0\d+ m, heading .* \(not told: .*; found after \d\.\d s\)", told)
    with (tmp_path / "out" / "estimates.csv").open(encoding="utf-8", newline="") as file:
        estimates = list(csv.DictReader(file))
    modes = [row["mode"] for row in estimates]
    located = next(index for index, mode in enumerate(modes) if mode != "initializing")
    assert 0 < located < 20
    assert modes[-1] == "operational"
    # Half a metre a second along x, from the first record on.
    assert float(estimates[located]["x"]) == pytest.approx(0.5 * int(estimates[located]["stamp_ns"]) * 1e-9, abs=0.1)
    states = [json.loads(line) for line in messages.read_text(encoding="utf-8").splitlines()]
    assert [state["headerId"] for state in states] == list(range(len(states)))
    assert states[0]["errors"][0]["errorType"] == "LOCALIZATION_ERROR"
    assert states[-1]["errors"] == []
    assert states[-1]["agvPosition"]["mapId"] == "Small hall"
    assert f"{len(states)} state messages" in told
    named = ("--vda5050", tmp_path / "named.jsonl", "--vda5050-map-id", "floor 1")
    assert commission("localize", project, recording, "--out", tmp_path / "out", *named)[0] == 0
    assert '"mapId": "floor 1"' in named[1].read_text(encoding="utf-8").splitlines()[0]
    # A file that is there is not overwritten unasked.
    code, _, err = commission("localize", project, recording, "--out", tmp_path / "out", *options)
    assert code != 0
    assert "states.jsonl exists" in err


@pytest.mark.parametrize("force", [(), ("--force",)])
def test_messages_are_not_written_over_results_recording_or_project(
    refused: Callable[..., str], project: Path, recording: Path, tmp_path: Path, force: tuple[str, ...]
) -> None:
    out = tmp_path / "out"
    for path, among in ((out / "summary.json", "results"), (recording / "odometry.csv", "recording"), (project, "")):
        before = path.read_bytes() if path.is_file() else b""
        said = refused("localize", project, recording, "--out", out, "--vda5050", path, *force)
        assert among in said
        assert (path.read_bytes() if path.is_file() else b"") == before
    assert not out.exists()


def test_contours_without_a_floor_map_are_refused(
    refused: Callable[..., str], project: Path, recording: Path, tmp_path: Path
) -> None:
    words = ("localize", project, recording, "--out", tmp_path / "out", "--set", "contour.enabled=true")
    assert "has no floor map" in refused(*words)
