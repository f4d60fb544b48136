import dataclasses
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from commission.errors import UsageError
from commission.localization.estimate import Mode, Status
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import AssociationParameters, OdometryParameters, Parameters, SupervisorParameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, ReferencePose
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.run import RunInput, judge, judged_run, summary
from commission.studies.start import start_of

CENTERS = np.array([[2.0, 3.0], [6.0, -3.0], [9.0, 3.5], [-4.0, -2.5], [0.0, -3.0]])
PERIOD_NS = 100_000_000
ALWAYS = [
    *("cycles", "duration_s", "inliers", "outliers_detector", "outliers_association", "operational_fraction"),
    *("lost_fraction", "fail_episodes", "nis_mean", "nis_expected", "nis_before_gate_mean"),
    *("rejected_fraction", "unseen_fraction", "longest_unseen_s", "microseconds_per_cycle"),
]
WITH_REFERENCE = [
    *(
        "reference_cycles",
        "outside_reference_cycles",
        "reference_gap_cycles",
        "position_rmse_m",
        "position_median_m",
        "position_p95_m",
        "position_max_m",
        "heading_rmse_rad",
    ),
    *("anees", "anees_position", "wrong_while_operational"),
]


def hall(**groups):
    reflectors = tuple(Reflector(id=f"R{index}", x=x, y=y) for index, (x, y) in enumerate(CENTERS))
    return Project(
        reflectors=ReflectorMap(reflectors),
        scanners=(Scanner(mounting=[0.0, 0.0, 0.0], field_of_view_deg=(-180.0, 180.0)),),
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
    return judged_run(RunInput.of(project, log, start_of(project, log, (0.0, 0.0, 0.0))))


def test_a_summary_has_the_keys_of_its_format_in_their_order_and_is_json():
    project = hall()
    entries = summary(replace(replayed(project, standing_still(50)), microseconds_per_cycle=1.5))
    assert list(entries) == ALWAYS + WITH_REFERENCE
    assert entries["cycles"] == 50
    assert entries["duration_s"] == 4.9
    assert entries["inliers"] + entries["outliers_association"] == 250
    assert entries["microseconds_per_cycle"] == 1.5
    assert json.loads(json.dumps(entries, allow_nan=False)) == entries
    assert list(summary(replayed(project, standing_still(5, reference=False)))) == ALWAYS


def test_what_is_undefined_is_none_in_the_summary():
    records = [Odometry(0, np.zeros(3)), ReferencePose(0, [0.0, 0.0, math.nan]), Detections(0, np.empty((0, 2)))]
    entries = summary(replayed(hall(), records))
    undefined = ["nis_mean", "nis_before_gate_mean", "rejected_fraction", "heading_rmse_rad", "anees"]
    assert [key for key, value in entries.items() if value is None] == undefined


def test_the_result_is_that_of_the_live_localizer_cycle_by_cycle():
    project = hall()
    log = RecordLog.collect(standing_still(40, blind=range(10, 15)))
    start = start_of(project, log)
    result = judged_run(RunInput.of(project, log, start))
    localizer = Localizer(LocalizerSetup.of(project), start.belief)
    estimates = [estimate for record in log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    assert [e.mode for e in estimates] == [Mode(int(mode)) for mode in result.columns.modes]
    assert np.array_equal([e.posterior.mean for e in estimates], result.columns.means)
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
    assert result.consistency.nis_mean == pytest.approx(1.685, abs=0.1)


@pytest.mark.parametrize(("probability", "expected"), [(0.95, 1.6847), (0.99, 1.9070), (0.5, 0.6137)])
def test_expected_nis_is_the_mean_of_a_chi_square_cut_off_at_the_gate(probability, expected):
    # By integration of x e^(-x/2) / 2 over 0 ... gate (5.991, 9.210, 1.386), over the gate's probability.
    project = hall(association=AssociationParameters(gate_probability=probability))
    assert replayed(project, standing_still(3)).consistency.nis_expected == pytest.approx(expected, abs=1e-4)


def test_shares_are_those_of_the_detections_and_cycles():
    result = replayed(hall(), standing_still(400, blind=range(100, 150)))
    inliers, outliers = result.count(Status.INLIER), result.count(Status.OUTLIER_ASSOCIATION)
    assert result.consistency.rejected_fraction == pytest.approx(outliers / (inliers + outliers))
    assert result.consistency.unseen_fraction == pytest.approx(50 / 400)
    # From the last scan that saw something to the first one that does again.
    assert result.consistency.longest_unseen == pytest.approx(51 * PERIOD_NS * 1e-9)
    assert result.lost_fraction == 0.0


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


def test_a_moved_gate_goes_over_the_detections_of_the_run_before():
    log = RecordLog.collect(standing_still(100))
    strict, usual = (hall(association=AssociationParameters(gate_probability=p)) for p in (0.5, 0.95))
    start = start_of(usual, log)
    before = judged_run(RunInput.of(usual, log, start))
    again = judged_run(RunInput.of(strict, log, start), earlier=before)
    assert again.columns.detected is before.columns.detected
    fresh = judged_run(RunInput.of(strict, log, start))
    assert np.array_equal(again.columns.means, fresh.columns.means)
    assert again.statistics == fresh.statistics
    assert again.count(Status.INLIER) < before.count(Status.INLIER)


def test_a_run_over_another_drive_takes_nothing_from_the_one_before():
    project = hall()
    one, other = (RecordLog.collect(standing_still(20, heading=heading)) for heading in (0.0, 0.01))
    start = start_of(project, one)
    before = judged_run(RunInput.of(project, one, start))
    result = judged_run(RunInput.of(project, other, start), earlier=before)
    assert result.statistics == judged_run(RunInput.of(project, other, start)).statistics
    assert result.statistics != before.statistics


def test_every_curve_has_the_numbers_of_its_cycles():
    project = hall(association=AssociationParameters(gate_probability=0.7))
    result = replayed(project, standing_still(30, blind=(7, 29)))
    estimates = [result.columns.estimate(cycle) for cycle in range(30)]
    assert result.times.tolist() == pytest.approx([0.1 * cycle for cycle in range(30)], abs=1e-12)
    for cycle, estimate in enumerate(estimates):
        accepted = [d2 for d2, status in zip(estimate.d2, estimate.status, strict=True) if status == Status.INLIER]
        assert np.array_equal(result.nis[cycle], max(accepted, default=math.nan), equal_nan=True)
        assert result.counts[cycle].tolist() == [estimate.count(status) for status in Status]
        sigmas = [2.0 * math.sqrt(estimate.posterior.covariance[axis, axis]) for axis in range(3)]
        assert result.two_sigma[cycle].tolist() == pytest.approx(sigmas, rel=1e-15)
        assert result.position_errors[cycle] == pytest.approx(math.hypot(*estimate.posterior.mean[:2]), rel=1e-12)
    assert math.isnan(result.nis[7])
    assert math.isnan(result.nis[29])


def test_the_largest_nis_of_a_cycle_is_that_of_its_inliers_alone():
    result = replayed(hall(association=AssociationParameters(gate_probability=0.5)), standing_still(200))
    columns = result.columns
    assert (columns.d2 > columns.segments[0].setup.filter.gate.d2).any()
    assert np.nanmax(result.nis) <= columns.segments[0].setup.filter.gate.d2
    of_cycles = np.repeat(result.nis, np.diff(columns.offsets))[columns.status == Status.INLIER]
    assert (columns.d2[columns.status == Status.INLIER] <= of_cycles).all()


def test_from_here_on_another_limit_decides_what_is_wrong_while_operational():
    # 30 mm beside the reference in every cycle: between the two limits; 2-sigma is far below both.
    loose, tight = (hall(supervisor=SupervisorParameters(position_limit=limit)) for limit in (0.05, 0.025))
    records = [replace(r, pose=[0.03, 0.0, 0.0]) if isinstance(r, ReferencePose) else r for r in standing_still(40)]
    log = RecordLog.collect(records)
    inputs = RunInput.of(loose, log, start_of(loose, log, (0.0, 0.0, 0.0), (0.001, 0.001, 0.001)))
    whole = judged_run(inputs)
    assert whole.statistics.wrong_while_operational == 0
    later = judged_run(inputs.with_setup(LocalizerSetup.of(tight), 30), earlier=whole)
    assert [segment.first for segment in later.inputs.segments] == [0, 30]
    assert later.operational_fraction == 1.0
    assert later.statistics.wrong_while_operational == 10


def gate(probability):
    return LocalizerSetup.of(hall(association=AssociationParameters(gate_probability=probability)))


def planned(inputs):
    """First cycle, gate and cover of each segment."""
    return [(s.first, s.setup.parameters.association.gate_probability, s.covered) for s in inputs.segments]


@pytest.fixture
def inputs():
    log = RecordLog.collect(standing_still(40))
    project = hall(association=AssociationParameters(gate_probability=0.95))
    return RunInput.of(project, log, start_of(project, log))


def test_a_setup_from_here_on_replaces_those_that_were_planned_for_later(inputs):
    changed = inputs.with_setup(gate(0.5), 20).with_setup(gate(0.9), 30).with_setup(gate(0.8), 25)
    assert planned(changed) == [(0, 0.95, False), (20, 0.5, False), (25, 0.8, False)]


def test_a_setup_from_the_start_leaves_what_is_covered(inputs):
    covered = inputs.with_cover(10, covered=True).with_setup(gate(0.5), 15).with_cover(20, covered=False)
    assert planned(covered) == [(0, 0.95, False), (10, 0.95, True), (15, 0.5, True), (20, 0.5, False)]
    assert planned(covered.with_setup(gate(0.9))) == [(0, 0.9, False), (10, 0.9, True), (20, 0.9, False)]


def test_a_cover_from_here_on_leaves_the_setups(inputs):
    changed = inputs.with_setup(gate(0.5), 20).with_cover(10, covered=True)
    assert planned(changed) == [(0, 0.95, False), (10, 0.95, True), (20, 0.5, True)]
    assert planned(changed.with_cover(20, covered=False)) == [(0, 0.95, False), (10, 0.95, True), (20, 0.5, False)]
    assert planned(changed.with_cover(0, covered=False)) == [(0, 0.95, False), (20, 0.5, False)]


def test_a_change_that_changes_nothing_makes_no_segment(inputs):
    assert planned(inputs.with_setup(gate(0.95), 7)) == planned(inputs.with_cover(7, covered=False)) == planned(inputs)
    assert inputs.with_setup(gate(0.95), 7) == inputs


def test_covered_from_here_on_counts_no_detection_and_ends_in_a_fail_episode():
    project = hall(odometry=OdometryParameters(forward_per_sqrt_s=0.005))
    log = RecordLog.collect(standing_still(1500))
    inputs = RunInput.of(project, log, start_of(project, log)).with_cover(100, covered=True)
    result = judged_run(inputs)
    assert result.counts[:100].sum() == 500
    assert result.counts[100:].sum() == 0
    assert [episode.recovered for episode in result.episodes] == [False]


def test_the_time_per_cycle_is_that_of_the_localizer():
    ticks = iter([10.0, 10.5])
    log = RecordLog.collect(standing_still(50))
    result = judged_run(RunInput.of(hall(), log, start_of(hall(), log)), clock=lambda: next(ticks))
    assert result.microseconds_per_cycle == pytest.approx(0.5e6 / 50)
    assert summary(result)["microseconds_per_cycle"] == result.microseconds_per_cycle


def test_judging_a_finished_run_is_the_rest_of_running_it():
    log = RecordLog.collect(standing_still(20))
    result = judged_run(RunInput.of(hall(), log, start_of(hall(), log)))
    again = judge(result.inputs, result.columns, 1.0)
    assert again.statistics == result.statistics
    assert np.array_equal(again.nis, result.nis)


def test_a_run_says_how_far_it_is():
    told = []
    log = RecordLog.collect(standing_still(20))
    judged_run(RunInput.of(hall(), log, start_of(hall(), log)), lambda share, text: told.append((share, text)))
    shares = [share for share, _ in told]
    assert shares == sorted(shares)
    assert told[-1][1] == "judging the run"


def test_a_recording_in_which_nothing_could_be_seen_is_refused():
    with pytest.raises(UsageError, match="no scan and no detection"):
        replayed(hall(), [Odometry(0, np.zeros(3))])


def test_a_run_of_hours_keeps_few_bytes_for_each_cycle_and_each_detection():
    """What six hours keep: 540,000 cycles x 221 bytes and 1,400,000 detections x 50 are 190 MB of the 500 allowed."""
    result = replayed(hall(), standing_still(400))
    owners: dict[int, np.ndarray] = {}

    def gather(value):
        if isinstance(value, np.ndarray):
            while isinstance(value.base, np.ndarray):
                value = value.base
            owners[id(value)] = value
        elif isinstance(value, tuple):
            for part in value:
                gather(part)

    for holder in (result, result.columns, result.columns.detected):
        for field in dataclasses.fields(holder):
            if field.name not in {"inputs", "segments", "checkpoints", "columns", "detected", "final"}:
                gather(getattr(holder, field.name))
    kept = sum(array.nbytes for array in owners.values())
    cycles, detections = len(result.columns), len(result.columns.status)
    # The stamps of the cycles may be those of the log; a few bytes of offsets and segments come on top.
    assert kept <= 229 * cycles + 50 * detections + 64
