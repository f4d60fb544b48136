"""The command `calibrate` with several recordings: what all say together, and each by itself, in one file."""

from __future__ import annotations

import shutil

import pytest
import yaml


def test_several_recordings_are_weighed_and_each_is_written(commission, project, recording, tmp_path):
    other = tmp_path / "again"
    shutil.copytree(recording, other)
    files = [tmp_path / "one.yaml", tmp_path / "two.yaml"]
    assert commission("calibrate", project, recording, "--out", files[0])[0] == 0
    code, told, err = commission("calibrate", project, recording, other, "--out", files[1])
    assert code == 0, err
    one, two = (yaml.safe_load(file.read_text(encoding="utf-8")) for file in files)
    assert [each["name"] for each in two["drives"]] == ["drive", "again"]
    assert "drives" not in one
    for drive in two["drives"]:
        assert drive["values"] == one["values"]
    alone = {each["key"]: each for each in one["values"]}
    shown = [each for each in two["values"] if each["verdict"] != "not shown by this drive"]
    assert shown
    for each in shown:
        # The same drive twice: the same value, sqrt(2) times as sure.
        assert each["value"] == pytest.approx(alone[each["key"]]["value"], rel=1e-6, abs=1e-12)
        assert each["sigma"] == pytest.approx(alone[each["key"]]["sigma"] / 2.0**0.5, rel=1e-4)
    assert "of 2 drives" in told


def test_no_recording_and_a_scheduler_that_nobody_is_are_refused(refused, project, recording, monkeypatch):
    assert "no recording is named; expected one or more" in refused("calibrate", project)
    pytest.importorskip("distributed", reason="the extra commission[cluster] is not installed")
    monkeypatch.setattr("commission.io.cluster.PATIENCE", 0.5)
    line = refused("calibrate", project, recording, "--scheduler", "tcp://127.0.0.1:9")
    assert "--scheduler tcp://127.0.0.1:9 does not answer" in line
