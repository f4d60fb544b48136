"""Clocks of the scanners against the vehicle's: set by hand, by motion, by arrival, and what they do to a scan."""

from __future__ import annotations

import math
from typing import Any

from viser import GuiApi

from commission.app.base.actions import Action
from commission.app.base.drive_now import DriveNow
from commission.app.base.inputs import Inputs, show, write_html
from commission.app.base.panel import BasePanel, Post, escaped, posting, write_label
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.live.actions import FindClocks, SetClock, UseArrivalClocks, UseClocks
from commission.app.live.state import ClockState
from commission.app.live.view import LiveView
from commission.errors import UsageError
from commission.site.quantity import MILLIMETRES, MILLISECONDS
from commission.studies.arrival import ArrivalOffset
from commission.studies.clock import ClockOffset, ClockVerdict, displacement, speed_at

LONG = 10.0
"""Time from which on an offset is told in seconds [s]."""
STANDING = 0.02
"""Speed below which the effect is told for another one [m/s]."""
REMARK = "What this scanner's clock shows more than the vehicle's: positive where scans are stamped late."


class ClockPanel(BasePanel):
    """Widgets of the clocks.

    Parameters
    ----------
    gui, post : where they are made, what takes their actions.
    state : what they begin with.
    """

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        self._gui, self._post = gui, post
        self._folder = gui.add_folder("Scanner clocks", expand_by_default=False)
        self._drive: DriveNow | None = None
        self._fields: list[Any] = []
        self._build(state)
        with self._folder:
            self._find = gui.add_button(
                "Find by motion",
                hint="Compares how scans and odometry saw the vehicle move, over the whole drive on the page.",
            )
            self._find.on_click(posting(post, lambda _event: self._asked()))
            self._use = gui.add_button(
                "Use what motion says", color="gray", hint="Sets the clocks that the drive shows.", visible=False
            )
            self._use.on_click(posting(post, lambda _event: UseClocks()))
            self._take = gui.add_button(
                "Use what arrival says",
                color="gray",
                hint="Sets the clocks of scanners whose scans are stamped as they arrive, and so later than odometry.",
                visible=False,
            )
            self._take.on_click(posting(post, lambda _event: UseArrivalClocks(self._arrival)))
            self._arrival: tuple[ArrivalOffset, ...] = ()
            self._html = gui.add_html("")

    def _build(self, state: AppState) -> None:
        """Make a field for each scanner; another name does not make another field: it may be typed into by then."""
        for each in self._fields:
            each.remove()
        self._inputs = Inputs(self._gui, self._post, self._set, clock_of)
        with self._folder:
            self._fields = [
                self._gui.add_number("", 0.0, min=-10_000.0, max=10_000.0, step=0.001, hint=REMARK)
                for _ in state.project.scanners
            ]
        self._call(state)
        for index, field in enumerate(self._fields):
            self._inputs.connect(str(index), field, lambda value: float(value) / MILLISECONDS.scale, self._shown(index))

    def _call(self, state: AppState) -> None:
        """Write on each field which scanner it is of."""
        self._names = tuple(scanner.name for scanner in state.project.scanners)
        for name, field in zip(self._names, self._fields, strict=True):
            write_label(field, "By hand [ms]" if len(self._names) == 1 else f"{name} by hand [ms]")

    def _set(self, index: str, offset: Any) -> Action:
        return SetClock(self._names[int(index)], offset)

    def _shown(self, index: int) -> Any:
        def shown(state: AppState) -> float | None:
            offset = clock_of(state, self._names[index])
            return None if offset is None else round(MILLISECONDS.of(offset), 6)

        return shown

    def _asked(self) -> Action:
        """Return what is asked for by the button; raises UsageError where nothing has been driven."""
        if self._drive is None:
            raise UsageError("nothing has been driven; expected a recording, a virtual drive or a connected vehicle")
        return FindClocks(self._drive.inputs)

    def draw_slowly(self, view: PageView) -> None:
        """Show the clocks and what they do."""
        self._drive = view.part(DriveNow)
        names = tuple(scanner.name for scanner in view.state.project.scanners)
        if len(names) != len(self._names):
            self._build(view.state)
        elif names != self._names:
            self._call(view.state)
        self._inputs.follow(view.state)
        found = view.state.part(ClockState).found
        clocks = {scanner.name: scanner.clock_offset for scanner in view.state.project.scanners}
        usable = (each.differs_from(clocks[each.scanner]) for each in found if each.scanner in clocks)
        show(self._use, visible=any(usable))
        live = view.part(LiveView)
        self._arrival = () if live is None else live.clocks
        show(
            self._take,
            visible=any(each.scanner in clocks and each.differs_from(clocks[each.scanner]) for each in self._arrival),
        )
        write_html(self._html, clocks_html(view))


def clock_of(state: AppState, name: str) -> float | None:
    """Return the offset of a scanner's clock in the project [s]; None where the scanner has gone."""
    return next((each.clock_offset for each in state.project.scanners if each.name == name), None)


def clocks_html(view: PageView) -> str:
    """Return what is known of the clocks, and what they do at the speed of now, as html."""
    drive, live = view.part(DriveNow), view.part(LiveView)
    speed = math.nan if drive is None else speed_at(drive.inputs.log, drive.stamp_ns)
    usual = max((route.speed for route in view.state.project.routes), default=1.0)
    found = {each.scanner: each for each in view.state.part(ClockState).found}
    lines: list[str] = []
    for scanner in view.state.project.scanners:
        lines.append(
            f"<div><b>{escaped(scanner.name)}</b>: {MILLISECONDS.text(scanner.clock_offset, '+.1f')} allowed for"
            f"{_effect(scanner.clock_offset, speed, usual)}</div>"
        )
        if scanner.name in found:
            lines.append(_motion(found[scanner.name], scanner.clock_offset, speed, usual))
        arrived = None if live is None else next((each for each in live.clocks if each.scanner == scanner.name), None)
        if arrived is not None:
            lines.append(_by_arrival(arrived, scanner.clock_offset, speed, usual))
    if live is not None:
        lines += [_arrival(str(each.address), each.status.latency_s) for each in live.sources]
    return f"<div style='font-size:12px;padding:2px 4px'>{''.join(lines)}</div>"


def _effect(offset: float, speed: float, usual: float) -> str:
    """Say how far off an offset [s] puts what is seen."""
    if offset == 0.0:
        return ""
    if speed > STANDING:
        return f": {MILLIMETRES.text(displacement(offset, speed), '.1f')} at {speed:.2f} m/s now"
    return f": {MILLIMETRES.text(displacement(offset, usual), '.1f')} at {usual:.2f} m/s"


def _motion(each: ClockOffset, allowed: float, speed: float, usual: float) -> str:
    """Say what motion told of a clock."""
    if each.verdict is ClockVerdict.NOT_SHOWN:
        return f"<div>By motion: {each.verdict}<div class='c-note'>{escaped(each.reason)}</div></div>"
    left = each.offset - allowed
    agrees = "" if each.differs_from(allowed) else ", agrees with what is allowed for"
    more = agrees or f"; not allowed for: {MILLISECONDS.text(left, '+.1f')}{_effect(left, speed, usual)}"
    note = f"<div class='c-note'>{escaped(each.reason)}</div>" if each.reason else ""
    value = f"{MILLISECONDS.number(each.offset, '+.1f')} ± {MILLISECONDS.text(each.sigma, '.1f')}"
    return f"<div>By motion: {value} (1σ), {each.verdict}{more}{note}</div>"


def _by_arrival(each: ArrivalOffset, allowed: float, speed: float, usual: float) -> str:
    """Say what arrival told of a clock."""
    sigma = MILLISECONDS.text(each.sigma, ".1f")
    if each.offset is None:
        own = each.clocks or 0.0
        size = MILLISECONDS.number(own, "+.1f") if abs(own) < LONG else f"{own:+.4f} s"
        told = f"its clock shows {size} ± {sigma} (1σ) more than the vehicle's, drift {1e6 * each.drift:+.0f} µs/s"
        return f"<div>By arrival: {told}; this connection takes that out</div>"
    left = each.offset - allowed
    more = f"; not allowed for: {MILLISECONDS.text(left, '+.1f')}{_effect(left, speed, usual)}"
    agrees = more if each.differs_from(allowed) else ", agrees with what is allowed for"
    late = MILLISECONDS.number(each.offset, "+.1f")
    return f"<div>By arrival: scans are stamped {late} ± {sigma} (1σ) later than odometry{agrees}</div>"


def _arrival(address: str, latency_s: float) -> str:
    """Say what arrival tells of a source."""
    if math.isnan(latency_s):
        told = "says no time: its records are stamped as they arrive"
    else:
        told = f"placed by the quickest arrivals; usual ones come {MILLISECONDS.text(latency_s, '.1f')} later"
    return f"<div>By arrival: {escaped(address)} {told}</div>"
