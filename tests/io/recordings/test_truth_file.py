"""`truth.json`: what was drawn for a virtual drive, written with its recording and read back as the same value."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from commission.errors import FileFormatError
from commission.io.recordings.base import load_log, open_recording
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.truth_file import TRUTH, read_truth, write_truth
from commission.site.disturbances import ScannerError, WheelNoise
from commission.site.records import Odometry
from commission.site.truth import TruePlace, TrueWheels, Truth

DRAWN = Truth(
    seed=2**40,
    route="Out \u00e9 \U0001f600 \x7f back",
    wheels=TrueWheels(
        noise=WheelNoise(forward_per_sqrt_m=0.1 / 3.0), forward_scale=-1e-17, wheel_scales=(0.001, -0.002)
    ),
    scanners=(ScannerError(scanner="front", mounting=(0.001, 0.0, 0.1 / 3.0), range_bias=-0.004, clock_offset=1e-3),),
    reflectors=(TruePlace(id="R1", dx=0.1 / 3.0, dy=-0.002), TruePlace(id="1", dx=0.0, dy=1e-5)),
)


def test_truth_is_read_back_as_it_was_written_to_the_last_bit(tmp_path: Path) -> None:
    write_truth(tmp_path / TRUTH, DRAWN)
    assert read_truth(tmp_path / TRUTH) == DRAWN
    assert json.loads((tmp_path / TRUTH).read_text(encoding="utf-8"))["schema"] == 1


def test_truth_lies_in_the_recording_and_goes_when_another_is_written_without(tmp_path: Path) -> None:
    records = [Odometry(0, np.zeros(3))]
    write_recording(tmp_path, records, DRAWN)
    assert load_log(tmp_path).truth == open_recording(tmp_path).truth() == DRAWN
    write_recording(tmp_path, records)
    assert not (tmp_path / TRUTH).exists()
    assert load_log(tmp_path).truth is None


def _changed(**changes: object) -> str:
    return json.dumps({"schema": 1, "seed": 1, "route": "A", **changes})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no JSON"),
        ('{"schema": 1', "is no JSON"),
        ("[" * 100_000, "is no JSON"),
        ("[1]", "schema: is missing; expected an object that begins with schema 1"),
        ('{"seed": 1}', "schema: is missing"),
        (_changed(schema=2), "schema: is 2; expected 1, the version this program knows"),
        (_changed(schema=True), "schema: is True"),
        (_changed(seed="x"), "seed: is 'x'; expected a whole number (Seed of the drive)"),
        ('{"schema": 1, "seed": 1}', "route: is missing"),
        (_changed(weather="fine"), "weather: is no known key; expected one of: schema, seed, route, wheels"),
        (_changed(wheels={"scale": 1}), "wheels.scale: is no known key"),
        (_changed(wheels={"noise": {"forward_per_sqrt_m": -1}}), "wheels.noise.forward_per_sqrt_m: is -1; expected 0"),
        (_changed(scanners=[{"mounting": [0.0, 0.0]}]), "scanners[0].mounting: "),
        (_changed(scanners=[{"range_bias": 11.0}]), "scanners[0].range_bias: is 11; expected -10 to 10"),
        (_changed(reflectors=[{"id": "A", "dx": 0.1}]), "reflectors[0].dy: is missing"),
    ],
)
def test_what_is_no_truth_is_refused_and_says_where(tmp_path: Path, text: str, message: str) -> None:
    write_recording(tmp_path, [Odometry(0, np.zeros(3))])
    (tmp_path / TRUTH).write_text(text, encoding="utf-8")
    for read in (load_log, lambda folder: read_truth(folder / TRUTH)):
        with pytest.raises(FileFormatError) as caught:
            read(tmp_path)
        assert str(caught.value).startswith(str(tmp_path / TRUTH))
        assert message in str(caught.value)
