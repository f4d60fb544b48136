"""Events of runs made by hand: each kind, on both sides of what makes it one."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry.arrays import read_only
from commission.localization.estimate import Mode, Status
from commission.localization.growing_run import GrowingRun
from commission.localization.priors import KeptPriors, PriorRows
from commission.localization.search_state import NOTHING, Agreed, SearchMoment
from commission.site.records import Detections, Odometry
from commission.studies.events import MOST_OF_A_KIND, EventKind, EventsInput, RunEvent, events, told
from commission.studies.run import RunResult
from tests.studies.test_run import CENTERS, hall, replayed, standing_still

PERIOD = 0.1
"""Time between two scans [s]."""


@pytest.fixture(scope="module")
def run() -> RunResult:
    """100 cycles in which a vehicle that stands still sees five reflectors."""
    return replayed(hall(), standing_still(100))


def of(run: RunResult, kind: EventKind) -> list[RunEvent]:
    return [event for event in events(EventsInput(run)).events if event.kind is kind]


def with_modes(run: RunResult, modes: Iterable[tuple[range, Mode]]) -> RunResult:
    column = np.full(run.cycles, int(Mode.OPERATIONAL), np.int8)
    for cycles, mode in modes:
        column[cycles.start : cycles.stop] = mode
    return replace(run, columns=replace(run.columns, modes=read_only(column)))


def with_inliers(run: RunResult, blind: range) -> RunResult:
    counts = run.counts.copy()
    counts[blind.start : blind.stop, Status.INLIER] = 0
    return replace(run, counts=read_only(counts))


def corrected(run: RunResult, cycle: int, move: float, turn: float = 0.0) -> RunResult:
    """The run in which only one scan corrected anything, by so much."""
    means = run.columns.means.copy()
    means[cycle] += [0.6 * move, 0.8 * move, turn]
    before = run.columns.means.copy()
    rows = PriorRows(read_only(before), read_only(run.columns.covariances))
    return replace(run, columns=replace(run.columns, means=read_only(means), priors=KeptPriors(rows)))


def test_a_good_drive_has_no_events(run: RunResult) -> None:
    assert events(EventsInput(run)).events == ()


def test_a_fail_and_its_end_are_told_with_their_figures(run: RunResult) -> None:
    failed = with_modes(run, [(range(30, 45), Mode.FAIL)])
    stopped, again = events(EventsInput(failed)).events
    assert (stopped.kind, again.kind) == (EventKind.FAIL, EventKind.RECOVERED)
    assert (stopped.time, again.time) == pytest.approx((30 * PERIOD, 45 * PERIOD))
    assert again.lasts == pytest.approx(15 * PERIOD)
    assert stopped.position == failed.position_two_sigma[30]
    assert stopped.limits == (0.1, 0.05236)
    assert told(again) == "after 1.50 s"
    assert told(stopped).endswith("/ 3.0°")


def test_lost_within_a_fail_is_told_and_the_recovery_counts_from_the_first_stop(run: RunResult) -> None:
    failed = with_modes(run, [(range(30, 45), Mode.FAIL), (range(35, 40), Mode.LOST)])
    found = [(event.kind, round(event.time, 6)) for event in events(EventsInput(failed)).events]
    assert found == [
        (EventKind.FAIL, 3.0),
        (EventKind.LOST, 3.5),
        (EventKind.FOUND, 4.0),
        (EventKind.RECOVERED, 4.5),
    ]
    assert of(failed, EventKind.RECOVERED)[0].lasts == pytest.approx(1.5)


def test_what_is_not_searched_for_is_not_found(run: RunResult) -> None:
    segment = run.columns.segments[0]
    supervisor = replace(segment.setup.parameters.supervisor, find_again=False)
    setup = replace(segment.setup, parameters=replace(segment.setup.parameters, supervisor=supervisor))
    run = replace(run, columns=replace(run.columns, segments=(replace(segment, setup=setup),)))
    failed = with_modes(run, [(range(30, 45), Mode.FAIL), (range(35, 40), Mode.LOST)])
    assert [event.kind for event in events(EventsInput(failed)).events] == [
        EventKind.FAIL,
        EventKind.LOST,
        EventKind.FAIL,
        EventKind.RECOVERED,
    ]


@pytest.mark.parametrize(
    ("agreed", "by"),
    [
        (Agreed(by_things=4), "the only place left in 5 attempts"),
        (Agreed(by_things=1, by_way=2), "the only place left in 3 attempts by the whole way"),
        (Agreed(by_things=1, by_contours=7), "the only place left in 8 views by the contours of the hall"),
    ],
)
def test_a_drive_that_nobody_has_located_says_so_and_when_and_how_it_was_found(
    run: RunResult, agreed: Agreed, by: str
) -> None:
    searches = (SearchMoment(24, read_only(np.empty((0, 13))), NOTHING, agreed),)
    run = replace(run, columns=replace(run.columns, searches=searches))
    found = with_modes(run, [(range(25), Mode.INITIALIZING), (range(25, 30), Mode.FAIL)])
    seeking, located, again = events(EventsInput(found)).events
    assert (seeking.kind, seeking.time) == (EventKind.SEARCHING, 0.0)
    assert (located.kind, located.time, located.lasts) == (EventKind.FOUND, 2.5, 2.5)
    assert (again.kind, again.lasts) == (EventKind.RECOVERED, 3.0)
    assert told(located) == f"after 2.50 s, {by}"


def test_a_drive_that_begins_stopped_and_ends_so_says_it_once(run: RunResult) -> None:
    (event,) = of(with_modes(run, [(range(100), Mode.LOST)]), EventKind.LOST)
    assert event.time == 0.0
    assert told(event) == "0 % rejected in 1 s"


@pytest.mark.parametrize(("scans", "is_blind"), [(9, False), (10, True)])
def test_a_stretch_without_an_accepted_detection_is_blind_beyond_a_second(
    run: RunResult, scans: int, is_blind: bool
) -> None:
    # Between the last scan before and the first after lie one more period than scans: 1.0 s and 1.1 s.
    found = of(with_inliers(run, range(20, 20 + scans)), EventKind.BLIND)
    assert len(found) == is_blind
    for event in found:
        assert event.time == pytest.approx(2.0)
        assert event.lasts == pytest.approx((scans + 1) * PERIOD)


def test_the_way_of_a_blind_stretch_is_what_was_driven(run: RunResult) -> None:
    means = np.zeros((100, 3))
    means[:, 0] = np.arange(100) * 0.05
    moved = replace(run, columns=replace(run.columns, means=read_only(means)))
    (event,) = of(with_inliers(moved, range(20, 40)), EventKind.BLIND)
    assert event.position == pytest.approx(21 * 0.05)
    assert told(event) == "nothing accepted for 2.10 s, 1.05 m"


@pytest.mark.parametrize(("pause", "is_gap"), [(0.29, False), (0.31, True)])
def test_a_time_without_a_scan_is_a_gap_from_three_periods_on(run: RunResult, pause: float, is_gap: bool) -> None:
    times = run.times.copy()
    times[50:] += pause - PERIOD
    found = of(replace(run, times=read_only(times)), EventKind.GAP)
    assert [round(event.time, 6) for event in found] == ([4.9] if is_gap else [])
    assert [round(event.lasts, 6) for event in found] == ([pause] if is_gap else [])


@pytest.mark.parametrize(
    ("move", "turn", "is_jump"),
    [(0.049, 0.0, False), (0.051, 0.0, True), (0.0, math.radians(1.49), False), (0.0, -math.radians(1.51), True)],
)
def test_a_correction_is_a_jump_beyond_half_of_a_limit(run: RunResult, move: float, turn: float, is_jump: bool) -> None:
    found = of(corrected(run, 60, move, turn), EventKind.JUMP)
    assert [round(event.time, 6) for event in found] == ([6.0] if is_jump else [])
    for event in found:
        assert event.position == pytest.approx(move, abs=1e-9)
        assert event.heading == pytest.approx(abs(turn), abs=1e-9)


def swapped(run: RunResult, cycle: int, one: int, other: int) -> RunResult:
    """The run in which what was one reflector is another one from a cycle on."""
    reflector = run.columns.reflector.copy()
    later = slice(int(run.columns.offsets[cycle]), None)
    reflector[later] = np.where(reflector[later] == one, other, reflector[later])
    return replace(run, columns=replace(run.columns, reflector=read_only(reflector)))


def test_a_thing_that_is_another_reflector_from_a_scan_on_is_told_once(run: RunResult) -> None:
    (event,) = of(swapped(run, 40, 1, 3), EventKind.CHANGED)
    assert event.time == pytest.approx(4.0)
    assert (event.names, told(event)) == (("R1", "R3"), "R1 → R3")


@pytest.mark.parametrize(("apart", "is_same"), [(0.09, True), (0.11, False)])
def test_only_what_lies_within_ten_centimetres_is_the_same_thing(run: RunResult, apart: float, is_same: bool) -> None:
    # Nothing but the first reflector is accepted, which lies a bit farther away from a scan on, and is another one.
    columns = run.columns
    first = columns.reflector == 0
    measured = np.tile([np.hypot(*CENTERS[0]), np.arctan2(*CENTERS[0][::-1])], (len(first), 1))
    measured[int(columns.offsets[40]) :, 0] += apart
    status = np.where(first, Status.INLIER, Status.OUTLIER_ASSOCIATION).astype(np.int8)
    still = PriorRows(read_only(np.zeros((100, 3))), columns.priors.rows().covariances)
    exact = replace(
        columns,
        range_bearing=read_only(measured),
        status=read_only(status),
        means=read_only(np.zeros((100, 3))),
        priors=KeptPriors(still),
    )
    changed = swapped(replace(run, columns=exact), 40, 0, 2)
    assert len(of(changed, EventKind.CHANGED)) == is_same


def test_what_lies_beside_the_place_of_another_reflector_is_no_change_while_both_are_seen() -> None:
    # Two reflectors 8 cm apart: each one's own detection of the scan before is nearer than the other's.
    twins = [[3.0, 0.0], [3.0, 0.08]]
    project = hall()
    seen = np.array([[math.hypot(*place), math.atan2(place[1], place[0])] for place in twins])
    records = [
        record
        for cycle in range(20)
        for record in (Odometry(cycle * 100_000_000, np.zeros(3)), Detections(cycle * 100_000_000, seen))
    ]
    made = replayed(project, records)
    reflector = np.tile([0, 1], 20)
    status = np.zeros(40, np.int8)
    twin = replace(made, columns=replace(made.columns, reflector=read_only(reflector), status=read_only(status)))
    assert of(twin, EventKind.CHANGED) == []


def test_a_live_run_and_a_whole_one_have_the_same_events(run: RunResult) -> None:
    inputs = run.inputs
    live = GrowingRun(inputs.segments[0].setup, inputs.start.belief)
    for record in inputs.log.records():
        live.feed(record)
    live.flush()
    shaken = [swapped(replace(run, columns=columns), 40, 1, 3) for columns in (run.columns, live.columns())]
    one, other = (events(EventsInput(each)).events for each in shaken)
    assert len(one) == 1
    assert one == other or str(one) == str(other)  # NaN is not itself


def test_of_thousands_of_a_kind_the_first_are_listed_and_the_rest_is_counted(run: RunResult) -> None:
    long = replayed(hall(), standing_still(2 * MOST_OF_A_KIND + 20))
    flicker = with_modes(long, [(range(cycle, cycle + 1), Mode.FAIL) for cycle in range(0, long.cycles, 2)])
    found = events(EventsInput(flicker))
    assert len(found.events) == 2 * MOST_OF_A_KIND
    assert found.left_out == 20
    assert all(one.time <= other.time for one, other in zip(found.events, found.events[1:], strict=False))
    assert run.cycles == 100
