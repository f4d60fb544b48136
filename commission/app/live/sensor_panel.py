"""The raw-sensor view: the scan at the cursor as its sensor saw it, where the threshold is chosen.

Each browser has its own. It is drawn with the pictures of the floor, and not while it is hidden.
"""

from __future__ import annotations

import math

import msgspec
from viser import GuiApi

from commission.app.base import viser_private
from commission.app.base.actions import Action, LookAgain
from commission.app.base.drive_now import DriveNow
from commission.app.base.inputs import Text
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.shown_run import ShownRun
from commission.app.base.view import PageView
from commission.app.live.actions import FindShiny, MarkSeen, SetThreshold, WatchSensor
from commission.app.live.sensor_picture import beams_picture, head, intensity_picture
from commission.app.live.shiny_list import list_text
from commission.app.live.shiny_service import ShinyView
from commission.app.live.state import SensorWatch
from commission.localization.setup import LocalizerSetup
from commission.studies.sensor_view import SensorInput, SensorView, sensor_view

FIRST: str = "scanner"
"""What is offered before the scanners of the project are known."""
FARTHEST = 1e8
"""Largest coordinate of a place [m]; national grids reach 1e7."""
NOTHING = "The scan appears with the first record of a drive."


class FromScript(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the page's script says: the line was dragged, something was clicked, or the list is asked for."""

    n: int
    """Counts up."""
    threshold: float | None = None
    """Where the line was let go [sensor's unit]."""
    at: tuple[float, float] | None = None
    """Where what was clicked stands [m], map frame."""
    reflector: str = ""
    """What it is taken for."""


class SensorPanel(BasePanel):
    """Pictures of one scan, and the list of shiny things of the drive.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    browser : number of the connection.
    """

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._drive: DriveNow | None = None
        # The page's script ticks it while the picture can be seen (web_assets/shown.js).
        self._seen = gui.add_checkbox("Sensor view is seen", False, visible=False)
        self._seen.on_update(posting(post, lambda event: WatchSensor(bool(event.target.value))))
        inbox = gui.add_text("Asked of the sensor view", "", visible=False)
        inbox.on_update(posting(post, lambda event: said(event.target.value, self._drive)))
        self._inbox = viser_private.identifier(inbox)
        self._scanner = gui.add_dropdown("Sensor of", (FIRST,), visible=False)
        self._scanner.on_update(posting(post, lambda _event: LookAgain()))
        self._names: tuple[str, ...] = ()
        self._html = gui.add_html(self._framed(f"<div class='c-note'>{NOTHING}</div>"))
        self._list = Text(gui)
        self._drawn: tuple[object, ...] = ()

    def _framed(self, content: str) -> str:
        return f"<div class='c-sensor' data-seen='{viser_private.identifier(self._seen)}'>{content}</div>"

    def draw(self, view: PageView) -> None:
        """Show the scan at the cursor."""
        self._follow_names(tuple(scanner.name for scanner in view.state.project.scanners))
        drive = self._drive = view.part(DriveNow)
        marked = view.state.of_browser(self._browser, SensorWatch).marked
        if not self._seen.value or drive is None:
            return
        project = view.state.project
        drawn = (id(drive.columns), drive.stamp_ns, self._scanner.value, project.parameters, project.reflectors, marked)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        found = scan_of(view, self._names.index(self._scanner.value))
        threshold = project.parameters.detector.intensity_threshold
        if found is None:
            self._html.content = self._framed(f"<div class='c-note'>{NOTHING}</div>")
            return
        plots = intensity_picture(found, threshold, self._inbox, marked) + beams_picture(found, self._inbox, marked)
        self._html.content = self._framed(head(found, threshold) + f"<div class='c-s-plots'>{plots}</div>")

    def draw_slowly(self, view: PageView) -> None:
        """Show the list of shiny things."""
        watch, found = view.state.of_browser(self._browser, SensorWatch), view.part(ShinyView)
        is_live = view.state.part(ShownRun).result is None and view.part(DriveNow) is not None
        self._list.write(
            (found, watch.marked, is_live),
            lambda: list_text(found, watch.marked, is_live=is_live, inbox=self._inbox),
        )

    def _follow_names(self, names: tuple[str, ...]) -> None:
        """Offer the scanners of the project."""
        if names == self._names:
            return
        chosen = self._scanner.value
        self._names = names
        self._scanner.options = names
        self._scanner.value = chosen if chosen in names else names[0]
        self._scanner.visible = len(names) > 1


def scan_of(view: PageView, scanner: int) -> SensorView | None:
    """Return the newest scan of a scanner up to the cursor, judged by what is set now; None where there is none.

    Parameters
    ----------
    view : of the page.
    scanner : index in the project.
    """
    drive = view.part(DriveNow)
    if drive is None:
        return None
    project = view.state.project
    return sensor_view(
        SensorInput(
            log=drive.inputs.log,
            columns=drive.columns,
            setup=LocalizerSetup(
                reflectors=project.reflectors, scanners=project.scanners, parameters=project.parameters
            ),
            stamp_ns=drive.stamp_ns,
            scanner=scanner,
        )
    )


def said(text: str, drive: DriveNow | None) -> Action:
    """Return what a line of the script asks for; raises ValueError where it is none.

    Parameters
    ----------
    text : JSON of `FromScript`.
    drive : on the page; none: there is none.
    """
    try:
        asked = msgspec.json.decode(text, type=FromScript)
    except msgspec.MsgspecError as error:
        raise ValueError(f"the sensor view says {text[:60]!r}; expected what its script says ({error})") from error
    if asked.threshold is not None:
        if not math.isfinite(asked.threshold):
            raise ValueError(f"the threshold is {asked.threshold}; expected a finite intensity")
        return SetThreshold(asked.threshold)
    if asked.at is not None:
        if not all(math.isfinite(each) and abs(each) < FARTHEST for each in asked.at):
            raise ValueError(f"the place clicked is {asked.at}; expected one within {FARTHEST:g} m")
        return MarkSeen(asked.at, asked.reflector)
    return LookAgain() if drive is None else FindShiny(drive)
