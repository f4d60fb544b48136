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
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.view import PageView
from commission.app.live.actions import SetThreshold
from commission.app.live.sensor_picture import beams_picture, head, intensity_picture
from commission.localization.setup import LocalizerSetup
from commission.studies.sensor_view import SensorInput, SensorView, sensor_view

FIRST: str = "scanner"
"""What is offered before the scanners of the project are known."""
NOTHING = "The scan appears with the first record of a drive."


class Dragged(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the page's script says when the line was dragged."""

    n: int
    """Counts up."""
    threshold: float
    """Where it was let go [sensor's unit]."""


class SensorPanel(BasePanel):
    """Pictures of one scan.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    """

    def __init__(self, gui: GuiApi, post: Post) -> None:
        # The page's script ticks it while the picture can be seen (web_assets/shown.js).
        self._seen = gui.add_checkbox("Sensor view is seen", False, visible=False)
        self._seen.on_update(posting(post, lambda _event: LookAgain()))
        inbox = gui.add_text("Threshold dragged", "", visible=False)
        inbox.on_update(posting(post, lambda event: dragged(event.target.value)))
        self._inbox = viser_private.identifier(inbox)
        self._scanner = gui.add_dropdown("Sensor of", (FIRST,), visible=False)
        self._scanner.on_update(posting(post, lambda _event: LookAgain()))
        self._names: tuple[str, ...] = ()
        self._html = gui.add_html(self._framed(f"<div class='c-note'>{NOTHING}</div>"))
        self._drawn: tuple[object, ...] = ()

    def _framed(self, content: str) -> str:
        return f"<div class='c-sensor' data-seen='{viser_private.identifier(self._seen)}'>{content}</div>"

    def draw(self, view: PageView) -> None:
        """Show the scan at the cursor."""
        self._follow_names(tuple(scanner.name for scanner in view.state.project.scanners))
        drive = view.part(DriveNow)
        if not self._seen.value or drive is None:
            return
        project = view.state.project
        drawn = (id(drive.columns), drive.stamp_ns, self._scanner.value, project.parameters, project.reflectors)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        found = scan_of(view, self._names.index(self._scanner.value))
        threshold = project.parameters.detector.intensity_threshold
        if found is None:
            self._html.content = self._framed(f"<div class='c-note'>{NOTHING}</div>")
            return
        plots = intensity_picture(found, threshold, self._inbox) + beams_picture(found)
        self._html.content = self._framed(head(found, threshold) + f"<div class='c-s-plots'>{plots}</div>")

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


def dragged(text: str) -> Action:
    """Return what a line of the script asks for; raises ValueError where it is none."""
    try:
        asked = msgspec.json.decode(text, type=Dragged)
    except msgspec.MsgspecError as error:
        raise ValueError(f"the sensor view says {text[:60]!r}; expected what its script says ({error})") from error
    if not math.isfinite(asked.threshold):
        raise ValueError(f"the threshold is {asked.threshold}; expected a finite intensity")
    return SetThreshold(asked.threshold)
