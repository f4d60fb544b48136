"""Shares of scans in which reflectors are seen, by distance: of a drive with known shares, and of real poles."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from commission.io.project_file import load_project
from commission.io.recordings.base import load_log
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.detection_rates import DetectionRate, detection_rates, wilson
from commission.studies.run import RunInput, judged_run
from commission.studies.start import start_of


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    # Newcombe 1998, Statistics in Medicine 17, 857, table I, method 3; none and no trial by the formula's limits.
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_interval_of_a_share_is_that_of_the_literature(successes: int, trials: int, low: float, high: float) -> None:
    assert wilson(successes, trials) == pytest.approx((low, high), abs=5e-5)
    assert wilson(trials - successes, trials) == pytest.approx((1.0 - high, 1.0 - low), abs=5e-5)


def test_of_nothing_counted_nothing_is_known() -> None:
    assert wilson(0, 0) == (0.0, 1.0)
    assert math.isnan(DetectionRate(scanner="s", nearest=0.0, farthest=1.0, expected=0, seen=0).share)


PLACES = ((2.0, 1.0), (2.0, -2.0), (-3.0, 0.5), (6.0, 3.0), (-7.0, -4.0), (1.0, 9.0), (12.0, 0.0))
SHARES = {5.0: 0.8, 10.0: 0.3, 15.0: 0.1}
"""Probability of detection up to a distance [m]."""


def standing(folder: Path, scans: int = 600) -> tuple[Path, list[int]]:
    """A recording of a vehicle that stands at the origin; how often it sees a reflector up to each distance."""
    rng, folder, counts = np.random.default_rng(3), folder / "standing", dict.fromkeys(SHARES, 0)
    folder.mkdir()
    odometry, detections = ["stamp_ns,dx,dy,dtheta"], ["stamp_ns,range,bearing"]
    for k in range(scans):
        odometry.append(f"{k * 100_000_000},0,0,0")
        before = len(detections)
        for x, y in PLACES:
            distance = math.hypot(x, y)
            farthest = next(each for each in SHARES if distance < each)
            if rng.random() < SHARES[farthest]:
                counts[farthest] += 1
                noise = rng.normal(0.0, (0.01, 0.001))
                detections.append(f"{k * 100_000_000},{distance + noise[0]},{math.atan2(y, x) + noise[1]}")
        if len(detections) == before:
            detections.append(f"{k * 100_000_000},,")
    for name, lines in (("odometry", odometry), ("detections", detections)):
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder, list(counts.values())


def test_shares_of_a_drive_are_those_that_it_was_made_with(tmp_path: Path) -> None:
    scanner = Scanner(field_of_view_deg=(-180.0, 180.0), range=(0.05, 30.0), reflector_range=7.0)
    reflectors = ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(PLACES)))
    recording, counts = standing(tmp_path)
    project, log = Project(reflectors=reflectors, scanners=(scanner,)), load_log(recording)
    columns = judged_run(RunInput.of(project, log, start_of(project, log, (0.0, 0.0, 0.0), None))).columns
    rates = detection_rates(project, columns, (0.0, 5.0, 10.0, 15.0, 20.0))
    # Farther than its range for reflectors is looked at, too: that range is what one wants to know.
    assert [(rate.nearest, rate.farthest) for rate in rates] == [(0.0, 5.0), (5.0, 10.0), (10.0, 15.0)]
    assert [rate.expected for rate in rates] == [3 * len(columns), 3 * len(columns), len(columns)]
    assert [rate.seen for rate in rates] == counts
    for rate, share in zip(rates, SHARES.values(), strict=True):
        # Four sigmas of the rarest are 0.05.
        assert rate.share == pytest.approx(share, abs=0.05)


def test_real_poles_are_seen_often_near_by_and_hardly_ever_far_away(shared_data: Path) -> None:
    folder = shared_data / "car_park"
    project, log = load_project(folder), load_log(folder / "recording")
    given = [float(word) for word in (folder / "initial_pose").read_text(encoding="utf-8").split(",")]
    start = start_of(project, log, (given[0], given[1], given[2]), (given[3], given[4], given[5]))
    columns = judged_run(RunInput.of(project, log, start)).columns
    near, between, far, beyond = detection_rates(project, columns, (0.0, 5.0, 10.0, 15.0, 40.0))
    # Counted by others along the satellites' track: 81 % up to 5 m, 12 % at 10 to 15 m.
    low, high = near.interval
    assert low < 0.81 < high
    assert near.share == pytest.approx(0.81, abs=0.01)
    assert 0.10 < far.share < 0.20
    assert near.share > between.share > far.share > beyond.share == 0.0
