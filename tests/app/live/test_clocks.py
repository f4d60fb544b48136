"""Clocks of the scanners on the page: by hand, by motion, what they come to; an undo step each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from commission.app.base.drive_now import DriveNow
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.live.actions import ClocksFound, FindClocks, SetClock, UseArrivalClocks, UseClocks
from commission.app.live.clock_panel import clocks_html
from commission.app.live.state import ClockState
from commission.app.live.view import LiveView
from commission.app.run.actions import Play, VirtualDrive
from commission.errors import UsageError
from commission.studies.arrival import ArrivalOffset
from commission.studies.clock import ClockOffset, ClockVerdict
from commission.studies.run import RunInput, judged_run
from commission.studies.start import Start, StartOrigin
from tests.app.asking import after
from tests.app.sites import room
from tests.browser.serving import Served
from tests.studies.recorded import PROJECT, SECOND, drive, start


def offset(verdict: ClockVerdict = ClockVerdict.FOUND, value: float = 0.03) -> ClockOffset:
    return ClockOffset(
        scanner="scanner", before=0.0, offset=value, sigma=0.0009, verdict=verdict, reason="a reason" * (value > 1)
    )


def page(project=PROJECT) -> AppState:
    return AppState(project=project, saved=project)


def test_a_clock_is_set_by_hand_in_one_undo_step() -> None:
    state = after(page(), SetClock("scanner", 0.02)).state
    assert state.project.scanners[0].clock_offset == 0.02
    assert len(state.undo) == 1
    with pytest.raises(ValueError, match="clock_offset"):
        after(page(), SetClock("scanner", 11.0))


def test_what_motion_says_is_used_where_it_says_anything() -> None:
    found = after(page(), ClocksFound((offset(),))).state
    assert after(found, UseClocks()).state.project.scanners[0].clock_offset == 0.03
    hidden = after(page(), ClocksFound((offset(ClockVerdict.NOT_SHOWN),))).state
    with pytest.raises(UsageError, match="no clock that is another one"):
        after(hidden, UseClocks())
    # 1.7 ms to 0.9 ms are no other clock than 0.
    near = after(page(), ClocksFound((offset(value=0.0017),))).state
    with pytest.raises(UsageError, match="no clock that is another one"):
        after(near, UseClocks())
    assert "agrees with what is allowed for" in clocks_html(view_of(near))


def test_the_panel_says_what_a_clock_comes_to_at_the_speed_of_now() -> None:
    project = replace(PROJECT, scanners=(replace(PROJECT.scanners[0], clock_offset=0.01),))
    log = drive(20.0)
    inputs = RunInput.of(project, log, Start(start(), StartOrigin.GIVEN))
    state = page(project).with_part(ClockState((offset(),)))
    html = clocks_html(view_of(state, DriveNow(inputs, 7 * SECOND, judged_run(inputs).columns)))
    # By hand it goes at 0.1889 rad/s times 5.493 m = 1.037 m/s then: 10.4 mm in ten milliseconds, 20.7 in twenty.
    assert "+10.0 ms allowed for: 10.4 mm at 1.04 m/s now" in html
    assert "By motion: +30.0 ± 0.9 ms (1σ), found; not allowed for: +20.0 ms: 20.7 mm at 1.04 m/s now" in html


def arrival(clocks: float | None, late: float | None) -> ArrivalOffset:
    return ArrivalOffset(scanner="scanner", clocks=clocks, offset=late, sigma=0.0003, drift=2e-5)


def test_what_arrival_says_stands_beside_motion_with_its_effect_and_is_used_where_scans_are_stamped_late() -> None:
    late = arrival(None, 0.012)
    live = LiveView(sources=(), told=(), clocks=(late,))
    html = clocks_html(view_of(page(), live))
    # The fastest route of the site is driven at 1 m/s: 12 mm in twelve milliseconds.
    speed = max(route.speed for route in PROJECT.routes) if PROJECT.routes else 1.0
    assert "scans are stamped +12.0 ± 0.3 ms (1σ) later than odometry; not allowed for: +12.0 ms" in html
    assert f"{12.0 * speed:.1f} mm at {speed:.2f} m/s" in html
    used = after(page(), UseArrivalClocks((late,))).state
    assert used.project.scanners[0].clock_offset == 0.012
    assert len(used.undo) == 1
    assert "agrees with what is allowed for" in clocks_html(view_of(used, live))
    own = arrival(0.0372, None)
    html = clocks_html(view_of(page(), LiveView(sources=(), told=(), clocks=(own,))))
    assert "its clock shows +37.2 ± 0.3 ms (1σ) more than the vehicle's, drift +20 µs/s" in html
    with pytest.raises(UsageError, match="arrival shows no clock that is another one"):
        after(page(), UseArrivalClocks((own,)))


@pytest.fixture
def served() -> Iterator[Served]:
    project = room()
    opened = Served(project, source=VirtualDrive(project.routes[0].name))
    opened.until(lambda: opened.view is not None)
    opened.runtime.post(Play(playing=False))
    yield opened
    opened.close()


def test_the_drive_on_the_page_says_what_it_shows_of_its_clock(served: Served) -> None:
    view = served.view
    assert view is not None
    served.runtime.post(FindClocks(view.result.inputs))
    served.until(lambda: bool(served.state.part(ClockState).found) or bool(served.state.faults))
    (found,) = served.state.part(ClockState).found
    assert found.scanner == "scanner"
    assert abs(found.offset) < 4.0 * found.sigma
    # A drive of twenty seconds.
    assert found.verdict is not ClockVerdict.FOUND
    assert found.reason
