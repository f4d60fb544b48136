"""A live run is the run over the recording of the same session, to the last bit."""

from __future__ import annotations

import itertools
import json
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.io.bundled import bundled_folder
from commission.io.live.connection import Arrival
from commission.io.live.live_run import LiveResult, LiveRun
from commission.io.live.registry import SourceAddress
from commission.io.live.runner import LiveRunner, LiveSnapshot
from commission.io.live.session import Session
from commission.io.live.spooled_scans import SpooledScans
from commission.io.live.status import Arrivals, SourceStatus, Tally
from commission.io.live.virtual_vehicle import addresses_of, send_drive
from commission.io.project_file import load_project
from commission.io.recordings.base import load_log
from commission.io.recordings.csv_writer import write_recording
from commission.io.vda5050_states import StateFile, StateStream, StateVersion, state_messages
from commission.localization import growing_run
from commission.localization.estimate import Estimate, Mode
from commission.simulation.scenario import records
from commission.site.project import Project
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.start import StartOrigin
from tests.io.live.virtual import ALL, scan, until

SPEED = 4.0
SECONDS = 8
OWN_CLOCK = "sick-safety", "cola", "nav350", "compact"
SECONDS_OF_OWN_CLOCK = 4


@pytest.fixture(scope="module")
def warehouse() -> Project:
    return load_project(bundled_folder("maps") / "warehouse")


@pytest.fixture(scope="module")
def drive(warehouse: Project) -> list[Record]:
    whole = records(warehouse, warehouse.routes[0].name, 1)
    return list(itertools.takewhile(lambda record: record.stamp_ns < SECONDS * 10**9, whole))


def names_of(project: Project) -> tuple[str, ...]:
    return tuple(scanner.name for scanner in project.scanners)


def assert_same_run(live: RunResult, replayed: RunResult) -> None:
    for name in ("means", "covariances", "modes", "status", "reflector", "d2", "range_bearing", "stamps_ns", "offsets"):
        a, b = getattr(live.columns, name), getattr(replayed.columns, name)
        assert a.tobytes() == b.tobytes(), name
    assert live.columns.final == replayed.columns.final
    assert live.errors.tobytes() == replayed.errors.tobytes()
    assert live.statistics == replayed.statistics


def listening_to(name: str, project: Project, free: Iterator[int]) -> Session:
    """A session of a virtual vehicle's sources, each at a free port."""
    wanted = addresses_of(SourceAddress(name, "127.0.0.1", next(free)), names_of(project), None)
    here = [
        SourceAddress(each.name, each.host, 0 if each.kind.transport == "udp" else each.port, each.scanner)
        for each in wanted
    ]
    # Under the load of other tests a thread may stand still for long.
    return Session.of(here, names_of(project), patience_ns=3 * 10**9)


@pytest.mark.parametrize("name", ALL)
def test_live_estimate_is_that_of_the_recording_of_the_same_session(
    name: str, warehouse: Project, drive: list[Record], tmp_path: Path
) -> None:
    session = listening_to(name, warehouse, itertools.count(20_000))
    run, kept = LiveRun(warehouse), list[Record]()
    snapshots: list[LiveSnapshot] = []
    runner = LiveRunner(session, run, snapshots.append, kept.append)
    runner.start()
    # Where scanner and odometry have each a clock of its own, clocks that run fast are no such as are put side by side.
    speed = 1.0 if name in OWN_CLOCK else SPEED
    drive = [record for record in drive if record.stamp_ns < SECONDS_OF_OWN_CLOCK * 10**9] if speed == 1.0 else drive
    sent = send_drive(drive, [source.address for source in session.sources], names_of(warehouse), speed=speed)
    came = until(lambda: sum(source.status().records for source in session.sources) >= sent.records)
    assert came, (sent, [source.status() for source in session.sources])
    last = runner.stop()

    live = last.run.result
    assert live is not None
    missing = sent.scans - sum(isinstance(record, Scan) for record in kept)
    assert sent.scans == (SECONDS_OF_OWN_CLOCK if speed == 1.0 else SECONDS) * 25
    # That the first turn of a picoScan is over is known when the second begins: later than odometry waits for it.
    assert 0 <= missing <= (name == "compact"), (last.told, last.account)
    assert all(source.status.lost == source.status.undecodable == 0 for source in last.sources), last.sources
    # It follows the drive that it saw.
    assert live.operational_fraction > 0.9
    write_recording(tmp_path / "session", kept, scanners=names_of(warehouse))
    log = load_log(tmp_path / "session")
    assert_same_run(live, judged_run(RunInput.of(warehouse, log, live.inputs.start)))
    assert snapshots


class Pushed:
    """A source whose records have come as soon as it is started."""

    address = SourceAddress.parse("json:0")
    is_behind = False

    def __init__(self, records: list[Record]) -> None:
        self._records, self._tally = records, Tally()

    def start(self, deliver: Callable[[Arrival], bool]) -> None:
        for record in self._records:
            self._tally.arrived(record.stamp_ns, None)
            deliver(Arrival(record, record.stamp_ns, 1))

    def stop(self) -> None: ...

    def status(self) -> SourceStatus:
        return self._tally.status(0, Counter())

    def times(self) -> dict[int, Arrivals]:
        return {}


def runner_of_pushed(records: list[Record], run: LiveRun, kept: list[Record]) -> LiveRunner:
    """A runner to which records have come, of which none was taken yet."""
    session = Session([Pushed(records)])
    return LiveRunner(session, run, lambda _: None, kept.append)


def test_what_has_arrived_is_localized_at_the_end_however_busy_the_computer_is(
    warehouse: Project, drive: list[Record], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("commission.io.live.runner.STUCK_S", 1.0)
    run, kept = LiveRun(warehouse), list[Record]()
    run.prepare()
    take = run.take

    def slowly(record: Record) -> tuple[Estimate, ...]:
        threading.Event().wait(0.15)
        return take(record)

    monkeypatch.setattr(run, "take", slowly)
    runner = runner_of_pushed(drive[:20], run, kept)
    runner.start()
    last = runner.stop()
    assert len(kept) == 20
    assert last.account.taken == 20
    assert last.account.text == "20 records received, none lost"


def test_what_waits_behind_a_localizer_that_gets_nowhere_is_given_up_and_told(
    warehouse: Project, drive: list[Record], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("commission.io.live.runner.STUCK_S", 0.2)
    run, kept = LiveRun(warehouse), list[Record]()
    goes_on = threading.Event()
    monkeypatch.setattr(run, "prepare", goes_on.wait)
    runner = runner_of_pushed(drive[:20], run, kept)
    runner.start()
    last = runner.stop()
    assert last.account.given_up == 20
    assert last.account.text == "20 records received, 20 lost: 20 given up at the end"
    # Whoever stopped it has closed the recording.
    goes_on.set()
    assert until(lambda: not any(thread.name == "live localizer" for thread in threading.enumerate()))
    assert not kept


def test_parameters_that_change_on_the_way_act_from_the_next_record_on(warehouse: Project, drive: list[Record]) -> None:
    from commission.site.fields import with_field

    other = replace(warehouse, parameters=with_field(warehouse.parameters, "association.gate_probability", 0.6))
    run = LiveRun(warehouse)
    for index, record in enumerate(drive[:800]):
        if index == 400:
            run.use(other)
        run.take(record)
    run.end()
    found = run.so_far().result
    assert found is not None
    assert len(found.columns.segments) == 2
    assert_same_run(found, judged_run(found.inputs))


def test_two_sigma_goes_on_growing_while_nothing_is_heard(warehouse: Project, drive: list[Record]) -> None:
    run = LiveRun(warehouse)
    for record in drive[:400]:
        run.take(record)
    last_ns = drive[399].stamp_ns
    sigmas: list[FloatArray] = []
    for silent_ms in (0, 250, 500, 1000, 2000):
        belief = run.so_far(last_ns + silent_ms * 10**6).belief
        assert belief is not None
        sigmas.append(2.0 * np.sqrt(np.diagonal(belief.covariance)))
    assert (np.diff(np.array(sigmas), axis=0) > 0.0).all()
    # After 2 s it may be as far as its fastest route lets it drive.
    assert sigmas[-1][0] == pytest.approx(2.0 * max(route.speed for route in warehouse.routes), rel=0.1)
    # What it really is goes on as if nothing had been shown.
    again = LiveRun(warehouse)
    for record in drive[:800]:
        run.take(record) if record in drive[400:800] else None
    for record in drive[:800]:
        again.take(record)
    first, second = run.so_far().result, again.so_far().result
    assert first is not None
    assert second is not None
    assert first.columns.means.tobytes() == second.columns.means.tobytes()


def test_two_sigma_grows_by_odometry_alone_while_the_scanner_is_silent(warehouse: Project, drive: list[Record]) -> None:
    run = LiveRun(warehouse)
    for record in drive[:200]:
        run.take(record)
    before = run.so_far(drive[199].stamp_ns).belief
    newest = drive[199].stamp_ns
    for record in drive[200:400]:
        if isinstance(record, Odometry):
            run.take(record)
            newest = record.stamp_ns
    after = run.so_far(newest).belief
    assert before is not None
    assert after is not None
    assert np.linalg.det(after.covariance) > np.linalg.det(before.covariance)


def test_a_session_that_is_killed_and_restarted_twenty_times_goes_on(warehouse: Project, drive: list[Record]) -> None:
    rng = np.random.default_rng(4)
    names, kept = names_of(warehouse), list[Record]()
    session = Session.of([SourceAddress.parse("sick-safety:0"), SourceAddress.parse("json:0")], names)
    run = LiveRun(warehouse)
    runner = LiveRunner(session, run, lambda _: None, kept.append)
    runner.start()
    addresses = [source.address for source in session.sources]
    for _ in range(20):
        alive = threading.Event()
        alive.set()
        arguments = {"speed": 20.0, "stopped": lambda alive=alive: not alive.is_set()}
        sender = threading.Thread(target=send_drive, args=(drive, addresses, names), kwargs=arguments)
        before = len(kept)
        sender.start()
        assert until(lambda before=before: len(kept) > before + 10, 60.0)  # a kernel may have to be compiled
        alive.wait(0.0)
        threading.Event().wait(float(rng.uniform(0.0, 0.1)))
        alive.clear()
        sender.join()
    last = runner.stop()
    order = [(record.stamp_ns, type(record), getattr(record, "scanner", 0)) for record in kept]
    assert len(set(order)) == len(order)
    # References are in order among themselves: no estimate waits for them.
    for kinds in ((ReferencePose,), (Odometry, Scan)):
        stamps = [record.stamp_ns for record in kept if isinstance(record, kinds)]
        assert stamps
        assert stamps == sorted(stamps)
    assert all(source.status.connects == 20 for source in last.sources)
    result = last.run.result
    assert result is not None
    # Motion never jumps by a lap: a sender that begins again does not say where it was.
    assert max(np.hypot(*record.displacement[:2]) for record in kept if isinstance(record, Odometry)) < 1.0


def test_detections_that_a_sensor_reports_are_kept_too(warehouse: Project) -> None:
    run = LiveRun(warehouse, pose=(4.0, 4.0, 0.0))
    for step in range(50):
        run.take(Odometry(step * 40_000_000, np.array([0.01, 0.0, 0.0])))
        run.take(Detections(step * 40_000_000, np.array([[2.0 + 0.01 * step, 0.5]] * (step % 3)).reshape(-1, 2)))
    run.end()
    found = run.so_far().result
    assert found is not None
    assert len(found.columns) == 50
    assert_same_run(found, judged_run(found.inputs))


def test_a_run_of_days_holds_the_newest_part_of_itself_and_goes_on_as_if_it_held_all(
    warehouse: Project, drive: list[Record], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(growing_run, "CHECKPOINT_CYCLES", 16)
    whole, short = LiveRun(warehouse), LiveRun(warehouse, held=64)
    for record in drive:
        whole.take(record)
        short.take(record)
    every, kept = whole.so_far(), short.so_far()
    assert every.result is not None
    assert kept.result is not None
    count = len(kept.result.columns)
    assert 16 <= count < 64 < len(every.result.columns)
    np.testing.assert_array_equal(kept.result.columns.means, every.result.columns.means[-count:])
    first_s = (kept.result.columns.stamps_ns[0] - drive[0].stamp_ns) * 1e-9
    assert kept.forgotten_s == pytest.approx(first_s, abs=0.05)
    # It is a run as any other: localized again it is the same, and its scans are there.
    assert_same_run(kept.result, judged_run(kept.result.inputs))
    ends = (each.result.inputs.log.scans[0] for each in (kept, every) if each.result is not None)
    np.testing.assert_array_equal(*(store.scan(len(store) - 1).ranges for store in ends))


def test_scans_are_read_back_from_their_file_and_the_oldest_forgotten() -> None:
    spool = SpooledScans(0, limit=10 * 541 * 5)
    for number in range(25):
        spool.append(scan(number))
    store = spool.so_far()
    assert len(store) == 25
    for number in range(15, 25):
        found, sent = store.scan(number), scan(number)
        np.testing.assert_array_equal(found.ranges, sent.ranges)
        np.testing.assert_array_equal(found.reflector, sent.reflector)
        assert (found.stamp_ns, found.angle_min) == (sent.stamp_ns, sent.angle_min)
    assert np.isnan(store.scan(14).ranges).all()
    assert store.block(20, 23).ranges.shape == (3, 541)
    assert len(store.block(3, 3)) == 0


def test_a_vehicle_of_which_nobody_says_where_it_starts_is_found_and_again_after_its_pose_is_thrown_away(
    warehouse: Project, drive: list[Record]
) -> None:
    live = LiveRun(replace(warehouse, routes=()))
    estimates = []
    for record in drive:
        estimates += live.take(record)
        if len(estimates) == 50:
            live.locate()
    found = live.so_far().result
    assert found is not None
    assert found.inputs.start.origin is StartOrigin.SEARCH
    modes = found.columns.modes
    assert modes[0] == modes[50] == Mode.INITIALIZING
    assert modes[49] == modes[-1] == Mode.OPERATIONAL
    assert [segment.locate for segment in found.columns.segments] == [False, True]
    driving = modes == Mode.OPERATIONAL
    assert found.position_errors[driving].max() < 0.1


def test_state_messages_while_it_drives_are_those_of_the_finished_run(
    warehouse: Project, drive: list[Record], tmp_path: Path
) -> None:
    live = LiveRun(replace(warehouse, routes=()))
    path = tmp_path / "states.jsonl"
    stream = StateStream(StateFile(path=path, version=StateVersion.V3), warehouse.name)
    for record in drive:
        stream.append(live.take(record), live.supervisor)
        assert path.read_bytes().endswith(b"\n") or not path.read_bytes()
    told_at = path.read_text().count("\n")
    stream.append(live.end(), live.supervisor)
    stream.close()
    result = live.so_far().result
    assert result is not None
    expected = list(state_messages(result, warehouse.name, StateVersion.V3))
    written = [json.loads(line) for line in path.read_text().splitlines()]
    deviations = [
        [message["mobileRobotPosition"].pop("deviationRange") for message in each] for each in (written, expected)
    ]
    # Of one covariance at a time, numpy rounds a square root otherwise than of many.
    assert deviations[0] == pytest.approx(deviations[1], rel=1e-12)
    assert written == expected
    assert told_at >= SECONDS
    localized = [message["mobileRobotPosition"]["localized"] for message in expected]
    assert localized[0] is False
    assert localized[-1] is True
    with pytest.raises(UsageError, match="exists; expected a new file"):
        StateStream(StateFile(path=path), "again")


def test_how_sources_do_is_told_while_the_figures_of_a_long_run_are_not_due() -> None:
    told: list[Any] = []

    def so_far(_now_ns: int | None, *, judged: Any = None) -> LiveResult:
        time.sleep(0.0 if judged else 0.3)
        result: Any = judged or object()
        return LiveResult(result, None, Mode.OPERATIONAL)

    nothing = SimpleNamespace(told={}, too_late={}, overrun={})
    session: Any = SimpleNamespace(
        sorter=nothing,
        sources=(),
        clock=SimpleNamespace(now_ns=lambda: 0),
        clocks=lambda _names: (),
        start=lambda: None,
        stop=lambda: None,
        rest=lambda: (),
        records=lambda wait_s: time.sleep(wait_s) or (),
    )
    run: Any = SimpleNamespace(so_far=so_far, scanner_names=(), prepare=lambda: None, end=lambda: ())
    runner = LiveRunner(session, run, told.append)
    runner.start()
    time.sleep(1.5)
    results = [each.run.result for each in told]
    runner.stop()
    assert len(told) > 4
    assert len({id(each) for each in results}) == 1
