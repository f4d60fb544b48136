"""A run that is interrupted, resumed or given another setup on the way is the uninterrupted one, to the last bit."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from commission.errors import JobCancelled
from commission.localization import growing_run, run_loop, whole_run
from commission.localization.detection_log import cycle_stamps, extract_detections
from commission.localization.estimate import Estimate, Mode, Status
from commission.localization.growing_run import GrowingRun
from commission.localization.localizer import Localizer
from commission.localization.run_columns import RunColumns, RunSegment
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_at_start
from commission.localization.whole_run import run, run_segments, state_before
from commission.simulation.faults import cover
from commission.site.parameters import (
    AssociationParameters,
    DetectorParameters,
    FilterParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Record, Scan
from commission.site.scanner import Scanner
from tests.localization.drives import Drive, Plan, random_drive, random_map

PLANS = {
    "equal stamps": Plan(scans=40),
    "scans between odometry": Plan(scans=40, scan_offset_ns=7_000_000),
    "scans faster than odometry": Plan(scans=40, odometry_ns=100_000_000, scan_ns=30_000_000),
    "rates that never meet": Plan(scans=40, odometry_ns=17_000_001, scan_ns=41_000_003, scan_offset_ns=5),
    "raw scans": Plan(scans=30, beams=720, scan_offset_ns=3_000_000),
    "the sensor starts to detect": Plan(scans=30, beams=720, both_after=10),
}
TIGHT = SupervisorParameters(position_limit=0.01)
"""A limit that a drive among twelve reflectors passes now and then, so that the output is withheld."""


def setup_of(seed: int = 3, count: int = 2, **groups: object) -> LocalizerSetup:
    front = Scanner(mounting=np.array([0.3, 0.1, 0.2]))
    scanners = (front, Scanner(name="rear", mounting=np.array([-0.4, -0.2, 2.8])))[:count]
    parameters = Parameters(**{"supervisor": TIGHT, **groups})  # type: ignore[arg-type]
    return LocalizerSetup(
        reflectors=random_map(np.random.default_rng(seed), 12), scanners=scanners, parameters=parameters
    )


SETUPS = {
    "drive": setup_of(),
    "narrow gate": setup_of(association=AssociationParameters(gate_probability=0.3)),
    "another map": setup_of(seed=4),
    "white noise alone": setup_of(filter=FilterParameters(consider=False)),
    "constants considered": setup_of(filter=FilterParameters(consider=True)),
    "constants and a narrow gate": setup_of(
        filter=FilterParameters(consider=True), association=AssociationParameters(gate_probability=0.3)
    ),
    "another detector": setup_of(detector=DetectorParameters(min_model_error=0, max_model_error=0)),
}


@pytest.fixture(scope="module", params=PLANS.values(), ids=PLANS.keys())
def drive(request: pytest.FixtureRequest) -> Drive:
    return random_drive(SETUPS["drive"], np.random.default_rng(8), request.param)


@pytest.fixture(autouse=True)
def checkpoints_every_seven_cycles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whole_run, "CHECKPOINT_CYCLES", 7)


def assert_same(a: RunColumns, b: RunColumns, *, after: int = 0) -> None:
    """Every column of `a` equals that of `b` from a cycle on, and both end in one state."""
    first = int(b.offsets[after])
    for mine, other in zip(a.priors.rows(), b.priors.rows(), strict=True):
        assert mine.tobytes() == other[after:].tobytes()
    for name in ("means", "covariances", "modes", "stamps_ns"):
        assert getattr(a, name).tobytes() == getattr(b, name)[after:].tobytes(), name
    for name in ("status", "reflector", "d2", "range_bearing", "beams", "expected_beams"):
        assert getattr(a, name).tobytes() == getattr(b, name)[first:].tobytes(), name
    assert (a.offsets + first).tolist() == b.offsets[after:].tolist()
    assert a.final == b.final


def cycles_of(records: Iterable[Record]) -> Iterator[bool]:
    """Whether each record is a cycle: of a sensor that detects, its scans are none."""
    detects = False
    for record in records:
        detects = detects or isinstance(record, Detections)
        yield isinstance(record, Detections) or (isinstance(record, Scan) and not detects)


def fed(drive: Drive, segments: tuple[RunSegment, ...]) -> tuple[Localizer, list[Estimate]]:
    """The live localizer over a drive, its setup replaced and its reflectors covered as the segments say."""

    def segment(cycle: int) -> RunSegment:
        return next(s for s in reversed(segments) if s.first <= cycle)

    localizer = Localizer(segments[0].setup, drive.initial)
    estimates: list[Estimate] = []

    def pull() -> None:
        while (estimate := localizer.pull()) is not None:
            estimates.append(estimate)
            localizer.replace_setup(segment(len(estimates)).setup)

    records, came = list(drive.log.records()), 0
    for record, is_cycle in zip(records, cycles_of(records), strict=True):
        localizer.push(cover(record) if segment(came).covered else record)
        came += is_cycle
        pull()
    for estimate in localizer.flush():
        estimates.append(estimate)
    return localizer, estimates


def assert_is_fed(columns: RunColumns, drive: Drive, segments: tuple[RunSegment, ...]) -> None:
    localizer, estimates = fed(drive, segments)
    assert len(estimates) == len(columns) > 0
    for cycle, live in enumerate(estimates):
        whole = columns.estimate(cycle)
        for name in (
            "detections",
            "beams",
            "expected_beams",
            "points_map",
            "status",
            "reflector",
            "d2",
            "mode",
            "gate",
            "stamp_ns",
        ):
            given, expected = np.asarray(getattr(whole, name)), np.asarray(getattr(live, name))
            assert given.tobytes() == expected.tobytes(), f"{name} of cycle {cycle}"
        for name in ("prior", "posterior", "output"):
            one, other = getattr(whole, name), getattr(live, name)
            assert one.stamp_ns == other.stamp_ns, f"{name} of cycle {cycle}"
            assert one.mean.tobytes() == other.mean.tobytes(), f"{name} of cycle {cycle}"
            assert one.covariance.tobytes() == other.covariance.tobytes(), f"{name} of cycle {cycle}"
    assert localizer.state == columns.final


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0.0, 1.0))
def test_split_at_any_record_the_rest_goes_on_as_if_nothing_had_happened(drive: Drive, share: float) -> None:
    setup = SETUPS["drive"]
    records = list(drive.log.records())
    position = round(share * len(records))
    before = Localizer(setup, drive.initial)
    cycles = sum(len(before.feed(record)) for record in records[:position])
    whole = run(drive.log, setup, drive.initial)
    to_come = [*before.waiting, *records[position:]]
    rest = run(RecordLog.collect(to_come, drive.scanners), setup, before.state)
    assert_same(rest, whole, after=cycles)
    live = Localizer(setup, before.state)
    for record in to_come:
        live.feed(record)
    live.flush()
    assert live.state == whole.final


def test_the_state_before_any_cycle_is_that_of_the_live_localizer(drive: Drive) -> None:
    setup = SETUPS["drive"]
    whole = run(drive.log, setup, drive.initial)
    localizer = Localizer(setup, drive.initial)
    states = [localizer.state]
    for record in drive.log.records():
        localizer.push(record)
        while localizer.pull() is not None:
            states.append(localizer.state)
    if localizer.flush():
        states.append(localizer.state)
    assert [state_before(whole, drive.log, cycle) for cycle in range(len(whole) + 1)] == states
    assert whole.final == localizer.state


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_run_of_segments_is_the_live_localizer_whose_setup_is_replaced(drive: Drive, data: st.DataObject) -> None:
    kinds = st.sampled_from(sorted(SETUPS))
    firsts = sorted(data.draw(st.sets(st.integers(1, len(cycle_stamps(drive.log)) - 1), max_size=3)))
    segments = tuple(
        RunSegment(first, SETUPS[data.draw(kinds)], covered=data.draw(st.booleans())) for first in (0, *firsts)
    )
    columns = run_segments(drive.log, segments, drive.initial)
    assert_is_fed(columns, drive, segments)
    # Whatever another run of the same log was made with, what is taken over from it changes nothing.
    others = tuple(RunSegment(s.first, SETUPS[data.draw(kinds)], covered=data.draw(st.booleans())) for s in segments)
    earlier = run_segments(drive.log, others, drive.initial)
    again = run_segments(drive.log, segments, drive.initial, earlier=earlier)
    assert_same(again, columns)
    assert again.segments == segments


def test_from_here_on_goes_on_from_the_state_there_and_leaves_what_was_lived(drive: Drive) -> None:
    setup, other = SETUPS["drive"], SETUPS["narrow gate"]
    before = run(drive.log, setup, drive.initial)
    cycle = 17
    segments = (RunSegment(0, setup), RunSegment(cycle, other))
    after = run_segments(drive.log, segments, drive.initial, earlier=before)
    assert after.means[:cycle].tobytes() == before.means[:cycle].tobytes()
    assert after.means[cycle:].tobytes() != before.means[cycle:].tobytes()
    assert after.estimate(cycle - 1).gate == setup.filter.gate.d2
    assert after.estimate(cycle).gate == other.filter.gate.d2
    assert_is_fed(after, drive, segments)


def test_covered_reflectors_are_not_detected_until_they_are_uncovered(drive: Drive) -> None:
    setup = SETUPS["drive"]
    segments = (RunSegment(0, setup), RunSegment(5, setup, covered=True), RunSegment(20, setup))
    columns = run_segments(drive.log, segments, drive.initial)
    seen = sum(columns.counts(status) for status in Status)
    assert seen[:5].sum() > 0
    assert seen[5:20].sum() == 0
    assert seen[20:].sum() > 0


def test_detections_are_kept_while_the_detector_stays_and_made_anew_when_it_does_not() -> None:
    drive = random_drive(SETUPS["drive"], np.random.default_rng(8), Plan(scans=30, beams=720))
    first = run_segments(drive.log, (RunSegment(0, SETUPS["drive"]),), drive.initial)
    moved_gate = run_segments(drive.log, (RunSegment(0, SETUPS["narrow gate"]),), drive.initial, earlier=first)
    assert moved_gate.detected is first.detected
    other = SETUPS["another detector"]
    stricter = run_segments(drive.log, (RunSegment(0, other),), drive.initial, earlier=first)
    fresh = extract_detections(drive.log, other)
    assert stricter.detected.status.tolist() == fresh.status.tolist()
    assert first.detected.status.tolist() != fresh.status.tolist()


def test_another_start_takes_no_cycle_from_an_earlier_run(drive: Drive) -> None:
    segments = (RunSegment(0, SETUPS["drive"]),)
    earlier = run_segments(drive.log, segments, drive.initial)
    start = dataclasses.replace(drive.initial, covariance=4.0 * drive.initial.covariance)
    fresh = run_segments(drive.log, segments, start)
    assert_same(run_segments(drive.log, segments, start, earlier=earlier), fresh)
    assert fresh.means[0].tobytes() != earlier.means[0].tobytes()


def test_a_segment_behind_the_last_cycle_is_left_out(drive: Drive) -> None:
    setup = SETUPS["drive"]
    count = len(run(drive.log, setup, drive.initial))
    segments = tuple(RunSegment(first, setup) for first in (0, count - 1, count))
    assert run_segments(drive.log, segments, drive.initial).segments == segments[:2]


@pytest.mark.parametrize("firsts", [(), (1,), (0, 3, 3), (0, 5, 2)])
def test_segments_that_do_not_follow_each_other_are_refused(drive: Drive, firsts: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="segments begin at cycles"):
        run_segments(drive.log, tuple(RunSegment(first, SETUPS["drive"]) for first in firsts), drive.initial)


def test_a_run_says_how_far_it_is_and_stops_where_it_is_told_to(drive: Drive) -> None:
    told: list[tuple[float, str]] = []
    segments = (RunSegment(0, SETUPS["drive"]),)
    run_segments(drive.log, segments, drive.initial, progress=lambda share, text: told.append((share, text)))
    shares = [share for share, _ in told]
    assert shares == sorted(shares)
    assert {text for _, text in told} == {"detecting reflectors", "localizing"}
    assert 0.0 <= shares[0] < shares[-1] <= 1.0

    def cancelled(share: float, text: str) -> None:
        if share > 0.8:
            raise JobCancelled("nobody wants it")

    with pytest.raises(JobCancelled):
        run_segments(drive.log, segments, drive.initial, progress=cancelled)


def test_a_log_without_cycles_still_moves_the_state(drive: Drive) -> None:
    log = RecordLog.collect(record for record in drive.log.records() if not isinstance(record, Scan | Detections))
    setup = SETUPS["drive"]
    columns = run_segments(log, (RunSegment(0, setup),), drive.initial)
    assert len(columns) == 0
    localizer = Localizer(setup, drive.initial)
    for record in log.records():
        localizer.feed(record)
    localizer.flush()
    assert columns.final == localizer.state != state_at_start(drive.initial)


def test_a_run_that_grows_while_it_is_driven_is_the_whole_run(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growing_run, "FIRST_ROWS", 3)
    segments = (
        RunSegment(0, SETUPS["drive"]),
        RunSegment(12, SETUPS["narrow gate"]),
        RunSegment(13, SETUPS["another map"]),
    )
    growing = GrowingRun(segments[0].setup, drive.initial)
    for record in drive.log.records():
        growing.push(record)
        while growing.pull() is not None:
            for segment in segments[1:]:
                if segment.first == len(growing):
                    growing.begin_segment(segment.setup)
    growing.flush()
    columns, whole = growing.columns(), run_segments(drive.log, segments, drive.initial)
    assert_same(columns, whole)
    assert columns.segments == segments
    assert columns.detected.status.tobytes() == whole.detected.status.tobytes()
    assert columns.points_map().tobytes() == whole.points_map().tobytes()
    assert state_before(columns, drive.log, 20) == state_before(whole, drive.log, 20)


def test_what_a_growing_run_has_shown_never_changes_again(drive: Drive) -> None:
    growing = GrowingRun(SETUPS["drive"], drive.initial)
    records = list(drive.log.records())
    for record in records[: len(records) // 2]:
        growing.feed(record)
    shown = growing.columns()
    means, d2 = shown.means.tobytes(), shown.d2.tobytes()
    assert not shown.means.flags.writeable
    for record in records[len(records) // 2 :]:
        growing.feed(record)
    assert (shown.means.tobytes(), shown.d2.tobytes()) == (means, d2)
    assert growing.columns().means[: len(shown)].tobytes() == means


def test_a_setup_that_is_replaced_before_a_cycle_comes_begins_no_segment_of_its_own(drive: Drive) -> None:
    growing = GrowingRun(SETUPS["drive"], drive.initial)
    growing.begin_segment(SETUPS["another map"])
    growing.begin_segment(SETUPS["narrow gate"])
    assert growing.columns().segments == (RunSegment(0, SETUPS["narrow gate"]),)


def test_cycles_of_a_flush_are_checkpoints_like_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growing_run, "CHECKPOINT_CYCLES", 1)
    drive = random_drive(SETUPS["drive"], np.random.default_rng(8), PLANS["scans between odometry"])
    growing = GrowingRun(SETUPS["drive"], drive.initial)
    records = list(drive.log.records())
    last = max(index for index, record in enumerate(records) if isinstance(record, Detections))
    for record in records[: last + 1]:
        growing.feed(record)
    before = len(growing)
    assert len(growing.flush()) == len(growing) - before == 1
    assert growing.columns().checkpoints[-1] == (len(growing), growing.state)


def thrown_away(drive: Drive) -> tuple[tuple[RunSegment, ...], RunColumns]:
    """Segments of a drive whose pose is thrown away at cycle 9, and its run, grown live."""
    segments = (RunSegment(0, SETUPS["drive"]), RunSegment(9, SETUPS["drive"], locate=True))
    growing = GrowingRun(segments[0].setup, drive.initial)
    for record in drive.log.records():
        growing.push(record)
        while growing.pull() is not None:
            if len(growing) == 9:
                growing.begin_segment(SETUPS["drive"], locate=True)
    growing.flush()
    return segments, growing.columns()


def test_a_growing_run_whose_pose_is_thrown_away_is_the_whole_run_and_tells_its_hypotheses(drive: Drive) -> None:
    segments, columns = thrown_away(drive)
    whole = run_segments(drive.log, segments, drive.initial)
    assert_same(columns, whole)
    assert columns.segments == segments
    assert (whole.modes[:9] != Mode.INITIALIZING).all()
    assert whole.modes[9] == Mode.INITIALIZING
    told = [(moment.cycle, moment.hypotheses.tobytes()) for moment in whole.searches]
    assert told == [(moment.cycle, moment.hypotheses.tobytes()) for moment in columns.searches]
    assert told[0][0] == 9
    assert whole.search(9) is whole.searches[0]
    assert whole.search(8) is None
    # Another gate behind it is computed from there on, and is the same as computed at once.
    later = (*segments, RunSegment(30, SETUPS["narrow gate"]))
    resumed = run_segments(drive.log, later, drive.initial, earlier=whole)
    assert_same(resumed, run_segments(drive.log, later, drive.initial))
    assert resumed.searches[0].cycle == 9
    assert state_before(resumed, drive.log, 12) == state_before(whole, drive.log, 12)
    # To look where it is at another time is another run.
    assert_same(
        run_segments(drive.log, segments[:1], drive.initial, earlier=whole),
        run(drive.log, SETUPS["drive"], drive.initial),
    )


@pytest.mark.parametrize("chunk", [4, 1000])
def test_what_was_believed_while_a_vehicle_searched_is_told_without_a_second_search(
    drive: Drive, chunk: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    segments, grown = thrown_away(drive)
    expected = grown.priors.rows()
    monkeypatch.setattr(whole_run, "CHECKPOINT_CYCLES", chunk)
    whole = run_segments(drive.log, segments, drive.initial)
    # Another gate behind the middle of a stretch between two checkpoints.
    resumed = run_segments(drive.log, (*segments, RunSegment(14, SETUPS["narrow gate"])), drive.initial, earlier=whole)

    def searches_again(*_: object) -> None:
        raise AssertionError("searched again")

    monkeypatch.setattr(run_loop, "sought", searches_again)
    for mine, its, other in zip(whole.priors.rows(), resumed.priors.rows(), expected, strict=True):
        assert mine.tobytes() == other.tobytes()
        assert its[:14].tobytes() == other[:14].tobytes()
