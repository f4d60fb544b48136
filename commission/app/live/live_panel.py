"""Connections to a vehicle that drives now: which, how they are doing, and what to look at when one is silent."""

from __future__ import annotations

import math

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.actions import Action
from commission.app.base.drive_now import DriveNow
from commission.app.base.inputs import show, write_html
from commission.app.base.panel import BasePanel, Post, escaped, posting
from commission.app.base.reach import typed_path
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.live.actions import Connect, Disconnect, LocateVehicle, Record, RecordDrive, StopRecording
from commission.app.live.state import LiveState
from commission.app.live.view import LiveView, SourceView
from commission.io.live.accounts import RecordAccount, counted
from commission.io.live.registry import KINDS
from commission.io.live.session_recorder import RecordingStatus
from commission.io.live.status import SourceState, SourceStatus
from commission.site.quantity import DEGREES, MILLISECONDS, PERCENT, X, Y

FIRST = "json:127.0.0.1:6061"
NUMBERS = 3


class LivePanel(BasePanel):
    """Widgets of the connections."""

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        asked = state.part(LiveState)
        kinds = ", ".join(KINDS)
        self._sources = gui.add_text(
            "Sources",
            ", ".join(asked.sources) or FIRST,
            hint=f"NAME[@SCANNER]:HOST:PORT, several with commas between; NAME is one of {kinds}. Of this computer's "
            "address 127.0.0.1 nobody else is heard.",
        )
        self._start = gui.add_text(
            "Start at [m, m, deg]",
            "" if asked.start is None else pose_text(asked.start),
            hint="Pose of base now: x, y, heading. Empty: the start of the first route; without a route the vehicle "
            "looks where it is.",
        )
        self._connect = gui.add_button("Connect", hint="Listen to the sources and localize what they say.")
        self._connect.on_click(posting(post, lambda _event: self._asked()))
        self._disconnect = gui.add_button(
            "Disconnect", color="gray", hint="Listen no longer; the run so far stays.", visible=False
        )
        self._disconnect.on_click(posting(post, lambda _event: Disconnect()))
        self._locate = gui.add_button(
            "Locate the vehicle",
            color="gray",
            hint="Throw the pose away: the vehicle looks where it is by the reflectors that it sees, without output "
            "until one place is left.",
            visible=False,
        )
        self._locate.on_click(posting(post, lambda _event: LocateVehicle()))
        self._table = gui.add_html("", visible=False)
        self._path = gui.add_text(
            "Record to",
            "",
            hint="A new file that ends in .mcap, on the computer that serves this page; it opens in Foxglove, ros2 bag "
            "and here. Empty: one in the folder recordings of the project. Nothing is overwritten.",
            visible=False,
        )
        self._record = gui.add_button(
            "Record", color="red", hint="Scans, odometry, estimate, detections and mode from now on.", visible=False
        )
        self._record.on_click(posting(post, lambda _event: self._recorded()))
        self._whole = gui.add_button(
            "Record this drive",
            color="gray",
            hint="The drive on the page from end to end: scans, odometry, estimate, detections and mode.",
            visible=False,
        )
        self._whole.on_click(posting(post, lambda _event: self._recorded()))
        self._drive: DriveNow | None = None
        self._connected = False
        self._stop = gui.add_button("Stop recording", color="gray", hint="Close the file.", visible=False)
        self._stop.on_click(posting(post, lambda _event: StopRecording()))
        self._recording = gui.add_html("", visible=False)

    def _recorded(self) -> Action:
        """Return what is asked for by the button."""
        path = typed_path(self._path.value) if self._path.value.strip() else None
        return Record(path) if self._connected or self._drive is None else RecordDrive(self._drive, path)

    def _asked(self) -> Action:
        """Return what the fields ask for; raises ValueError where the pose is none."""
        sources = tuple(text.strip() for text in self._sources.value.split(",") if text.strip())
        return Connect(sources, start_pose(self._start.value))

    def draw_slowly(self, view: PageView) -> None:
        """Show how the sources are doing."""
        connected = view.state.part(LiveState).connected
        show(self._disconnect, visible=connected)
        show(self._locate, visible=connected)
        live = view.part(LiveView) if connected else None
        shown = view.part(LiveView)
        # What became of the records is said of the run that is over, too.
        over = "" if shown is None or not shown.account.received else account_html(shown.account, "Last connection: ")
        write_html(self._table, over if live is None else live_table(live))
        recording = None if shown is None else shown.recording
        records = connected and recording is not None and not recording.is_over
        self._connected, self._drive = connected, view.part(DriveNow)
        show(self._whole, visible=not connected and self._drive is not None)
        show(self._path, visible=not records and (connected or self._drive is not None))
        show(self._record, visible=connected and not records)
        show(self._stop, visible=records)
        write_html(self._recording, "" if recording is None else recording_html(recording))


def start_pose(text: str) -> tuple[float, float, float] | None:
    """Return x [m], y [m] and heading [rad] of a text with degrees; none of an empty one.

    Raises
    ------
    ValueError
        it is no pose: says what is expected.
    """
    if not text.strip():
        return None
    words = text.replace(",", " ").split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != NUMBERS or not all(map(math.isfinite, numbers)):
        raise ValueError(f"the start is {text!r}; expected x [m], y [m] and heading [deg] such as 4, 2.5, 90")
    return numbers[0], numbers[1], math.radians(numbers[2])


def pose_text(pose: tuple[float, float, float]) -> str:
    """Return a pose as the field holds it: x and y [m], heading [deg]; `start_pose` reads it."""
    # What is not changed in the field is read from it again: on a national grid, too, no millimetre may be lost.
    return f"{X.digits(pose[0])}, {Y.digits(pose[1])}, {DEGREES.of(pose[2]):g}"


def live_table(live: LiveView) -> str:
    """Return the sources as html: state, rate, loss, latency, and what to look at."""
    told = "".join(f"<div class='c-note'>{escaped(line)}</div>" for line in live.told)
    sources, account = "".join(map(_source, live.sources)), account_html(live.account)
    return f"<div style='font-size:12px;padding:2px 4px'>{sources}{account}{told}</div>"


def account_html(account: RecordAccount, what: str = "") -> str:
    """Return what became of the records, as html: a loss stands out.

    Parameters
    ----------
    account : of a connection.
    what : said before it.
    """
    color = f" style='color:{theme.FAIL_COLOR}'" if account.lost else ""
    return f"<div{color}>{what}{escaped(account.text)}</div>"


def _source(source: SourceView) -> str:
    status = source.status
    color = theme.OPERATIONAL_COLOR if status.state is SourceState.RECEIVING else theme.FAIL_COLOR
    head = f"<b>{escaped(source.address)}</b> <span style='color:{color}'>{escaped(state_words(status))}</span>"
    figures = (
        f"{status.records} records, {status.rate:.0f}/s, lost {PERCENT.of(status.loss):.1f} %, "
        f"latency {_milliseconds(status.latency_s)}, jitter {_milliseconds(status.jitter_s)}"
    )
    left_out = [f"{count} {words}" for words, count in (status.told or {}).items()]
    left_out += [f"{counted(kind, count)} came too late, left out" for kind, count in source.too_late.items()]
    left_out += [f"{status.overrun} dropped: this computer is too slow"] if status.overrun else []
    left_out += [f"{status.duplicates} came twice"] if status.duplicates else []
    left_out += [f"{status.undecodable} cannot be decoded"] if status.undecodable else []
    notes = "".join(f"<li>{escaped(line)}</li>" for line in (*source.checks, *left_out))
    return f"<div>{head}<br>{figures}{f'<ul style=margin:0>{notes}</ul>' if notes else ''}</div>"


def recording_html(recording: RecordingStatus) -> str:
    """Return how a recording is doing: where, how long, how large, and why it ended early."""
    head = "Recorded" if recording.is_over else f"<span style='color:{theme.FAIL_COLOR}'>● Recording</span>"
    figures = f"{recording.duration:.1f} s, {recording.size / 1e6:.1f} MB, {recording.records} records"
    trouble = f"<div class='c-note'>{escaped(recording.trouble)}</div>" if recording.trouble else ""
    where = escaped(str(recording.path))
    return f"<div style='font-size:12px;padding:2px 4px'>{head} {figures}<br>{where}{trouble}</div>"


def state_words(status: SourceStatus) -> str:
    """Return what a source is doing; of a silent one, for how long."""
    if status.state is SourceState.SILENT:
        return f"silent for {status.silent_s:.0f} s"
    return str(status.state)


def _milliseconds(seconds: float) -> str:
    return "unknown" if math.isnan(seconds) else MILLISECONDS.text(seconds, ".1f")
