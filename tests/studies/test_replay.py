import json
import math

import numpy as np
import pytest

from commission.errors import UsageError
from commission.localization.detection_log import extract_detections
from commission.localization.estimate import Mode, Status
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import AssociationParameters, OdometryParameters, Parameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, ReferencePose
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.replay import judge, localize, replay, summary
from commission.studies.start import start_of

CENTERS = np.array([[2.0, 3.0], [6.0, -3.0], [9.0, 3.5], [-4.0, -2.5], [0.0, -3.0]])
PERIOD_NS = 100_000_000
ALWAYS = [
    *("cycles", "duration_s", "inliers", "outliers_detector", "outliers_association", "operational_fraction"),
    *("fail_episodes", "nis_mean", "microseconds_per_cycle"),
]
WITH_REFERENCE = [
    *("position_rmse_m", "position_median_m", "position_p95_m", "position_max_m", "heading_rmse_rad"),
    *("anees", "anees_position", "wrong_while_operational"),
]


def hall(**groups):
    reflectors = tuple(Reflector(id=f"R{index}", x=x, y=y) for index, (x, y) in enumerate(CENTERS))
    return Project(
        reflectors=ReflectorMap(reflectors),
        scanner=Scanner(mounting=[0.0, 0.0, 0.0], field_of_view_deg=(-180.0, 180.0)),
        parameters=Parameters(**groups),
    )


def standing_still(cycles, *, reference=True, blind=(), heading=0.0):
    """Records of a vehicle at the origin that sees every reflector, except in the cycles in which it is blind."""
    rng = np.random.default_rng(5)
    exact = np.stack([np.hypot(*CENTERS.T), np.arctan2(CENTERS[:, 1], CENTERS[:, 0])], axis=1)
    for cycle in range(cycles):
        stamp = cycle * PERIOD_NS
        yield Odometry(stamp, np.zeros(3))
        if reference:
            yield ReferencePose(stamp, [0.0, 0.0, heading])
        seen = exact + rng.normal(size=exact.shape) * [0.02, 0.004]
        yield Detections(stamp, np.empty((0, 2)) if cycle in blind else seen)


def replayed(project, records):
    log = RecordLog.collect(records)
    return replay(project, log, start_of(project, log, (0.0, 0.0, 0.0)).belief)


def test_a_summary_has_the_keys_of_its_format_in_their_order_and_is_json():
    project = hall()
    entries = summary(replayed(project, standing_still(50)), 1.5)
    assert list(entries) == ALWAYS + WITH_REFERENCE
    assert entries["cycles"] == 50
    assert entries["duration_s"] == 4.9
    assert entries["inliers"] + entries["outliers_association"] == 250
    assert entries["microseconds_per_cycle"] == 1.5
    assert json.loads(json.dumps(entries, allow_nan=False)) == entries
    assert list(summary(replayed(project, standing_still(5, reference=False)), 1.0)) == ALWAYS


def test_what_is_undefined_is_none_in_the_summary():
    records = [Odometry(0, np.zeros(3)), ReferencePose(0, [0.0, 0.0, math.nan]), Detections(0, np.empty((0, 2)))]
    entries = summary(replayed(hall(), records), 1.0)
    assert [key for key, value in entries.items() if value is None] == ["nis_mean", "heading_rmse_rad", "anees"]


def test_the_result_is_that_of_the_live_localizer_cycle_by_cycle():
    project = hall()
    log = RecordLog.collect(standing_still(40, blind=range(10, 15)))
    start = start_of(project, log)
    result = replay(project, log, start.belief)
    localizer = Localizer(LocalizerSetup.of(project), start.belief)
    estimates = [estimate for record in log.records() if (estimate := localizer.feed(record)) is not None]
    assert [e.mode for e in estimates] == [Mode(int(mode)) for mode in result.run.modes]
    assert np.array_equal([e.posterior.mean for e in estimates], result.run.means)
    for status in Status:
        assert sum(e.count(status) for e in estimates) == result.count(status)
    errors = [math.hypot(*e.posterior.mean[:2]) for e in estimates]
    assert result.statistics is not None
    assert result.statistics.position_max == pytest.approx(max(errors), rel=1e-12)


def test_a_standing_vehicle_that_sees_well_is_consistent_and_operational():
    result = replayed(hall(association=AssociationParameters(gate_probability=0.95)), standing_still(2000))
    assert result.operational_fraction == 1.0
    assert result.episodes == ()
    # Of a gate of 95 %: mean of a chi-square (2 degrees of freedom) cut off at 5.99. 6 sigma of 9,500 values is 0.1.
    assert result.nis_mean == pytest.approx(1.685, abs=0.1)


def test_a_blind_stretch_is_one_fail_episode_of_its_length():
    # 2-sigma along the axis after t seconds is 2 * 0.005 * sqrt(t): it passes 0.1 m after 100 s of 200.
    project = hall(odometry=OdometryParameters(forward_per_sqrt_s=0.005))
    result = replayed(project, standing_still(3000, blind=range(500, 2500)))
    assert len(result.episodes) == 1
    episode = result.episodes[0]
    assert episode.recovered
    assert episode.start_ns == pytest.approx(1500 * PERIOD_NS, abs=20 * PERIOD_NS)
    # Five reflectors at once are enough for the first scan to end it.
    assert episode.end_ns == 2500 * PERIOD_NS
    assert result.operational_fraction == pytest.approx(1.0 - (2500 - episode.start_ns / PERIOD_NS) / 3000)


def test_a_moved_gate_may_use_the_detections_extracted_before():
    log = RecordLog.collect(standing_still(100))
    strict, usual = (hall(association=AssociationParameters(gate_probability=p)) for p in (0.5, 0.95))
    belief = start_of(usual, log).belief
    detected = extract_detections(log, LocalizerSetup.of(usual))
    again = replay(strict, log, belief, detected=detected)
    assert np.array_equal(again.run.means, replay(strict, log, belief).run.means)
    assert again.count(Status.INLIER) < replay(usual, log, belief, detected=detected).count(Status.INLIER)


def test_judging_a_finished_run_is_replaying_it():
    project = hall()
    log = RecordLog.collect(standing_still(20))
    belief = start_of(project, log).belief
    assert judge(project, log, localize(project, log, belief)).statistics == replay(project, log, belief).statistics


def test_a_recording_in_which_nothing_could_be_seen_is_refused():
    with pytest.raises(UsageError, match="no scan and no detection"):
        replayed(hall(), [Odometry(0, np.zeros(3))])
