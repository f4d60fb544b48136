"""Live sources on the page: connect, see the run grow, silence told, disconnect, restart twenty times; page alive."""

from __future__ import annotations

import functools
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.app.base.state import AppState
from commission.app.live import service
from commission.app.live.actions import Connect, Disconnect, Record
from commission.app.live.effects import OpenSources
from commission.app.live.live_panel import account_html, live_table, start_pose
from commission.app.live.service import LiveService
from commission.app.live.state import LiveState
from commission.app.live.view import LiveView, SourceView
from commission.app.run.actions import ChooseSource, RecordedDrive, Seek
from commission.app.run.playback import Playback
from commission.app.run.service import RunService
from commission.app.run.state import RunState
from commission.app.tune.actions import SetParameter
from commission.errors import CommissionError, UsageError
from commission.io.live.accounts import RecordAccount
from commission.io.live.checklist import checklist
from commission.io.live.live_run import LiveRun
from commission.io.live.permission import Permission
from commission.io.live.registry import SourceAddress
from commission.io.live.status import SourceState, SourceStatus
from commission.io.live.virtual_vehicle import send_drive
from commission.localization import growing_run, localizer
from commission.simulation.scenario import records
from commission.site.records import Odometry
from commission.studies import run
from commission.studies.run import judged_run
from tests.app.asking import after
from tests.app.sites import room
from tests.browser.serving import Served


@pytest.fixture(scope="module")
def drive() -> list[object]:
    run.warm_up()
    localizer.warm_up()
    project = room()
    return list(records(project, project.routes[0].name, 1))


@pytest.fixture
def served() -> Iterator[Served]:
    opened = Served(room())
    yield opened
    opened.close()


def live_of(served: Served) -> LiveView:
    parts = served.runtime.service(LiveService).parts(slowly=True)
    return parts[0] if parts else LiveView(sources=(), told=())  # type: ignore[return-value]


def playback_of(served: Served) -> Playback | None:
    return served.runtime.service(RunService).playback


def connected(served: Served, *kinds: str) -> list[SourceAddress]:
    served.runtime.post(Connect(tuple(f"{kind}:127.0.0.1:0" for kind in kinds)))
    served.until(lambda: len(live_of(served).sources) == len(kinds))
    return [source.address for source in live_of(served).sources]


def sending(drive: list[object], addresses: list[SourceAddress], speed: float = 10.0) -> threading.Thread:
    thread = threading.Thread(target=send_drive, args=(drive, addresses, ("scanner",)), kwargs={"speed": speed})
    thread.start()
    return thread


def test_a_vehicle_that_drives_now_is_shown_grows_and_stays_as_a_run_that_can_be_tuned(
    served: Served, drive: list[object]
) -> None:
    sender = sending(drive, connected(served, "sick-safety", "json"), speed=2.0)
    served.until(lambda: served.view is not None and served.view.result.cycles > 10)
    assert served.state.part(RunState).live
    first = served.view
    assert first is not None
    served.until(lambda: served.view is not None and served.view.result.cycles > first.result.cycles + 10)
    view = served.view
    assert view is not None
    assert view.at_end, "the cursor goes along"
    assert len(view.scan_map) > 100
    assert live_of(served).sources[0].status.state is SourceState.RECEIVING
    # Whoever looks back stays there.
    served.runtime.post(Seek(0.5))
    served.until(lambda: served.view is not None and served.view.time == pytest.approx(0.5))
    sender.join()
    served.runtime.post(Disconnect())
    served.until(lambda: not served.state.part(LiveState).connected)
    # The last cycles, and the account of them all, come with the end of the connection.
    served.until(lambda: live_of(served).account.received == len(drive))
    served.until(lambda: served.runtime.service(RunService)._live is None)
    served.until(lambda: served.view is not None and served.view.duration > view.duration)
    over = served.view
    assert over is not None
    assert over.time == pytest.approx(0.5)
    account = live_of(served).account
    assert account.received == account.taken + account.lost
    replayed = judged_run(over.result.inputs)
    assert replayed.columns.means.tobytes() == over.result.columns.means.tobytes()
    served.runtime.post(SetParameter("association.gate_probability", 0.6))
    served.until(lambda: served.view is not None and served.view.result is not over.result)


def test_a_drive_that_is_longer_than_the_page_holds_goes_on_and_says_what_is_gone(
    served: Served, drive: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(growing_run, "CHECKPOINT_CYCLES", 8)
    monkeypatch.setattr(service, "LiveRun", functools.partial(LiveRun, held=32))
    sender = sending(drive, connected(served, "sick-safety", "json"), speed=4.0)
    served.until(lambda: any("not on the page any more" in line for line in live_of(served).told))
    # Only the owner may ask for a view while the run goes on from a later start.
    served.until(lambda: (playing := playback_of(served)) is not None and playing.result.inputs.start.known is not None)
    playing = playback_of(served)
    assert playing is not None
    assert (playing.at_end, playing.result.cycles < 33) == (True, True)
    first_ns = playing.start_ns
    sender.join()
    served.runtime.post(Disconnect())
    served.until(lambda: served.runtime.service(RunService)._live is None)
    over = served.view
    assert over is not None
    assert over.result.columns.stamps_ns[0] > first_ns
    assert judged_run(over.result.inputs).columns.means.tobytes() == over.result.columns.means.tobytes()


def test_what_drives_now_is_recorded_and_opens_as_the_same_run(
    served: Served, drive: list[object], tmp_path: Path
) -> None:
    addresses = connected(served, "sick-safety", "json")
    path = tmp_path / "live.mcap"
    served.runtime.post(Record(path))
    served.until(path.exists)
    served.runtime.post(Record(path))
    served.until(lambda: any("never overwritten" in fault for fault in served.state.faults))
    sending(drive[:600], addresses, speed=4.0).join()
    served.until(lambda: live_of(served).sources[0].status.state is SourceState.SILENT, 5.0)
    recording = live_of(served).recording
    assert recording is not None
    assert recording.size > 100_000
    assert recording.duration > 1.0
    served.runtime.post(Disconnect())
    served.until(lambda: live_of(served).recording is not None and live_of(served).recording.is_over)  # type: ignore[union-attr]
    # The last cycles come with the end of the connection: the view of before has fewer.
    served.until(lambda: served.runtime.service(RunService)._live is None)
    live = served.view
    assert live is not None
    served.runtime.post(ChooseSource(RecordedDrive(path)))
    served.until(lambda: served.view is not None and served.view.result.inputs.log is not live.result.inputs.log)
    again = served.view
    assert again is not None
    assert again.result.columns.means.tobytes() == live.result.columns.means.tobytes()
    assert again.result.columns.covariances.tobytes() == live.result.columns.covariances.tobytes()


def test_a_recording_needs_a_connection_and_a_place(served: Served) -> None:
    state = AppState(project=room(), saved=room()).with_part(LiveState())
    with pytest.raises(UsageError, match="nothing is connected"):
        after(state, Record(Path("x.mcap")))
    with pytest.raises(UsageError, match="in no folder"):
        after(state.with_part(LiveState(connected=True)), Record())


def test_parameters_that_change_while_it_drives_act_from_then_on(served: Served, drive: list[object]) -> None:
    sender = sending(drive, connected(served, "json"), speed=2.0)
    served.until(lambda: served.view is not None and served.view.result.cycles > 5)
    served.runtime.post(SetParameter("association.gate_probability", 0.6))
    served.until(lambda: served.view is not None and len(served.view.result.columns.segments) == 2)
    sender.join()
    view = served.view
    assert view is not None
    assert view.segment.setup.parameters.association.gate_probability == 0.6


def test_a_silent_source_is_shown_within_a_second_while_two_sigma_goes_on_growing(
    served: Served, drive: list[object]
) -> None:
    sending(drive[:300], connected(served, "json")).join()
    served.until(lambda: live_of(served).sources[0].status.state is SourceState.SILENT, 3.0)
    source = live_of(served).sources[0]
    assert source.status.silent_s < 1.6
    assert any("records came, and none for" in line for line in source.checks)
    sigmas = []
    for _ in range(3):
        view = served.view
        assert view is not None
        sigmas.append(float(view.covariance[0, 0]))
        time.sleep(0.4)
    assert sigmas == sorted(set(sigmas))


def test_the_page_lives_while_senders_are_killed_and_restarted(served: Served, drive: list[object]) -> None:
    addresses = connected(served, "sick-safety", "json")
    for _ in range(5):
        before = live_of(served).sources[0].status.records
        sending(drive[:60], addresses, speed=20.0).join()
        served.until(lambda before=before: live_of(served).sources[0].status.records > before)
    assert served.runtime.silent_for() < 2.0
    assert not served.state.faults
    view = served.view
    assert view is not None
    assert (np.diff(view.result.columns.stamps_ns) > 0).all()


def test_an_address_that_cannot_be_listened_at_is_told_and_nothing_is_connected(served: Served) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        served.runtime.post(Connect((f"json:127.0.0.1:{taken.getsockname()[1]}",)))
        served.until(lambda: any("cannot be listened at" in fault for fault in served.state.faults))
    served.until(lambda: not served.state.part(LiveState).connected)


@pytest.mark.parametrize("sources", [(), ("lidar:1",), ("json:x:y",)])
def test_what_is_no_source_is_refused(served: Served, sources: tuple[str, ...]) -> None:
    served.runtime.post(Connect(sources))
    served.until(lambda: any("expected" in fault for fault in served.state.faults))
    assert not served.state.part(LiveState).connected


def test_start_is_entered_in_metres_and_degrees() -> None:
    assert start_pose("  ") is None
    assert start_pose("4, 2.5, 90") == pytest.approx((4.0, 2.5, np.pi / 2))
    assert start_pose("4 2.5 -180") == pytest.approx((4.0, 2.5, -np.pi))
    for text in ("4, 2", "a b c", "1 2 nan", "1 2 3 4"):
        with pytest.raises((CommissionError, ValueError), match="expected x"):
            start_pose(text)


def test_a_checklist_says_where_the_sender_has_to_send_to() -> None:
    address = SourceAddress.parse("sick-safety:6060")
    waiting = SourceStatus(state=SourceState.WAITING)
    lines = checklist(address, waiting, ("127.0.0.1", "192.168.0.7"))
    assert lines[0] == "nothing that is SICK microScan3, nanoScan3, outdoorScan3 arrives on UDP 127.0.0.1:6060"
    assert "this computer has 127.0.0.1, 192.168.0.7" in lines[1]
    assert any("does not write to the scanner" in line for line in lines)
    elsewhere = replace(address, host="10.0.0.1")
    assert "10.0.0.1 is none of these" in checklist(elsewhere, waiting, ("127.0.0.1",))
    assert checklist(address, SourceStatus(state=SourceState.RECEIVING), ()) == ()
    silent = SourceStatus(state=SourceState.SILENT, records=2250, bytes_received=9, silent_s=12.4)
    assert checklist(address, silent, ()) == (
        "2250 records came, and none for 12 s",
        "is the sender switched on, and its way to this computer unbroken?",
    )
    device = SourceAddress.parse("cola:192.168.0.1:2112")
    gone = replace(silent, state=SourceState.CONNECTING, records=1, trouble="connection refused")
    assert checklist(device, gone, ()) == (
        "1 record came, and none for 12 s",
        "connection refused",
        "is the sender switched on, and its way to 192.168.0.1:2112 unbroken?",
    )
    garbage = replace(waiting, bytes_received=90, undecodable=3, trouble="byte 0: no datagram")
    assert checklist(address, garbage, ())[1:] == (
        "90 bytes came and 3 pieces cannot be decoded",
        "the last one: byte 0: no datagram",
    )


def test_what_a_sender_says_is_shown_as_text() -> None:
    address = replace(SourceAddress.parse("json:6061"), scanner="<b>")
    shown = live_table(
        LiveView(sources=(SourceView(address, SourceStatus(state=SourceState.SILENT, silent_s=3.2), ()),), told=())
    )
    assert "<b>:" not in shown.replace("<b>json", "")
    assert "silent for 3 s" in shown


def test_what_was_lost_is_shown_with_its_cause_beside_the_source_and_in_all() -> None:
    address = SourceAddress.parse("json:6061")
    status = SourceStatus(state=SourceState.RECEIVING, records=50, overrun=2)
    source = SourceView(address, status, (), {Odometry: 1})
    account = RecordAccount.of([status], 47, {Odometry: 1})
    shown = live_table(LiveView(sources=(source,), told=(), account=account))
    assert "1 odometry record came too late, left out" in shown
    assert "2 dropped: this computer is too slow" in shown
    assert "50 records received, 3 lost" in shown
    assert "none lost" in account_html(RecordAccount(received=50, taken=50), "Last connection: ")


def test_a_browser_may_not_make_the_server_connect_anywhere() -> None:
    state = AppState(project=room(), saved=room()).with_part(LiveState())
    anywhere, here = Connect(("cola:169.254.169.254:2112",)), Connect(("cola:localhost:2112",))
    with pytest.raises(UsageError, match="not for a browser to name"):
        after(state, anywhere)
    outcome = after(state, here)
    assert outcome.effects == (OpenSources(("cola:127.0.0.1:2112",), None),)
    # What the program was started with is not questioned, and stays allowed.
    assert after(state, anywhere, browser=None).state.part(LiveState).connected
    named = Permission.of(anywhere.sources, (), is_shared=True)
    assert after(state.with_part(LiveState(permission=named)), anywhere).state.part(LiveState).connected
