"""Plates of unknown direction: the button that finds it from the walls, before and after, and the answer to it."""

from __future__ import annotations

import numpy as np
from viser import GuiApi, SceneApi

from commission.app.base import theme
from commission.app.base.before_after import ComparedLine, compared
from commission.app.base.drawing import NO_SEGMENTS, stroke_segments
from commission.app.base.extent import extent_of
from commission.app.base.inputs import Text, show
from commission.app.base.marks import add_lines
from commission.app.base.panel import BasePanel, Post, escaped, posting
from commission.app.base.view import PageView
from commission.app.problems.actions import AcceptFacing, DropFacing, FaceFromWalls
from commission.app.problems.facing import Facing
from commission.geometry.arrays import FloatArray
from commission.site.editing.facing import Faced, left_said
from commission.site.quantity import DEGREES
from commission.site.reflectors import UNKNOWN

ACCEPT, DISCARD = "Accept", "Discard"
MOST_LISTED = 12
"""Plates whose directions are listed; the floor shows all."""
ARROW_MARKS = 4.0
"""Length of the arrow on a plate, in sizes of a mark."""


class FacePanel(BasePanel):
    """Asks first, shows what would become of each plate, and changes them when that is accepted.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    browser : number of the connection: what waits is each browser's own.
    """

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._face = gui.add_button(
            "Face plates from walls",
            color="gray",
            visible=False,
            order=-3.0,
            hint="Finds the walls that plates of unknown direction hang on, and shows where they would face.",
        )
        self._face.on_click(posting(post, lambda _event: FaceFromWalls()))
        self._found = Text(gui, order=-2.0)
        self._answer = gui.add_button_group("", (ACCEPT, DISCARD), visible=False, order=-1.0)
        self._answer.on_click(
            posting(post, lambda event: AcceptFacing() if event.target.value == ACCEPT else DropFacing())
        )

    def draw_slowly(self, view: PageView) -> None:
        """Follow what waits."""
        project = view.state.project
        found = view.state.of_browser(self._browser, Facing).of(project)
        lacks = found is None and any(r.lacks_direction for r in project.reflectors.reflectors)
        show(self._face, visible=lacks)
        show(self._answer, visible=found is not None)
        self._found.write((found,), lambda: "" if found is None else preview(found))


def preview(found: Faced) -> str:
    """Return each plate's direction before and after, and those that stay, as html; headings in degrees."""
    turned = frozenset(found.turned)
    plates = [each for each in found.reflectors.reflectors if each.id in turned]
    lines = [ComparedLine(each.id, UNKNOWN, DEGREES.text(each.heading or 0.0, ".1f")) for each in plates[:MOST_LISTED]]
    more = f"and {len(plates) - MOST_LISTED} more, shown on the floor. " if len(plates) > MOST_LISTED else ""
    note = f"{more}{left_said(found)} Nothing has changed yet."
    return (
        f"<div style='padding:2px 10px 4px 6px'>{compared(('now', 'would face'), lines)}"
        f"<div class='c-note' style='padding-top:3px'>{escaped(note.strip())}</div></div>"
    )


class FacingOverlay(BasePanel):
    """Arrows where plates would face, in the browser that looks at them; a panel without widgets.

    Parameters
    ----------
    scene : the browser's own.
    browser : number of its connection.
    """

    def __init__(self, scene: SceneApi, browser: int) -> None:
        self._browser = browser
        self._lines = add_lines(scene, "/problems/facing", theme.PREVIEW, 2.0)
        self._shown: Faced | None = None

    def draw(self, view: PageView) -> None:
        """Draw what waits."""
        found = view.state.of_browser(self._browser, Facing).of(view.state.project)
        if found is self._shown:
            return
        self._shown = found
        size = ARROW_MARKS * extent_of(view.state.project).mark_size()
        self._lines.points = (
            NO_SEGMENTS if found is None else stroke_segments(arrows(found, size), theme.Height.EDITING)
        )


def arrows(found: Faced, size: float) -> FloatArray:
    """Return the (3 N, 2, 2) strokes of an arrow from each plate that would turn, into its direction.

    Parameters
    ----------
    found : the plates.
    size : length of an arrow [m].
    """
    turned = frozenset(found.turned)
    strokes: list[FloatArray] = []
    for each in found.reflectors.reflectors:
        if each.id in turned and each.heading is not None:
            ahead = size * np.array([np.cos(each.heading), np.sin(each.heading)])
            aside = 0.25 * np.array([-ahead[1], ahead[0]])
            foot = np.array([each.x, each.y])
            tip, neck = foot + ahead, foot + 0.7 * ahead
            strokes += [np.array(pair) for pair in ((foot, tip), (tip, neck + aside), (tip, neck - aside))]
    return np.array(strokes).reshape(-1, 2, 2)
