"""The association view: the selected reflector of this scan, or its worst one, with its gate at true scale.

Each browser has its own. It draws with each picture of the floor, so that both show one scan, and not while hidden.
"""

from __future__ import annotations

from typing import Literal

from viser import GuiApi

from commission.app.base import theme, viser_private
from commission.app.base.actions import Action, LookAgain
from commission.app.base.panel import BasePanel, Post, posting, table
from commission.app.base.view import PageView
from commission.app.editing.actions import SelectReflectors
from commission.app.editing.editor import editor_of
from commission.app.run.association_picture import head, picture, rows
from commission.app.run.view import RunView
from commission.studies.association import Association, AssociationInput, association

PREVIOUS, WORST, NEXT = "◀ Previous", "Worst", "Next ▶"
KEYS: tuple[tuple[str, Literal["H", "J"], str], ...] = (
    ("Previous reflector of the scan", "H", PREVIOUS),
    ("Next reflector of the scan", "J", NEXT),
)
LEGEND = (
    "<div class='c-note c-a-legend'>Ring: reflector at its true radius. Ellipse: gate. Dot: prediction. Cross: "
    "detection, from the belief before the scan; circle: after the correction. Small dots, dashed ellipse: the last "
    "innovations and their 1σ. North is up.</div>"
)


class AssociationPanel(BasePanel):
    """Picture and numbers of one reflector in the scan at the cursor.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    browser : number of its connection.
    """

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        # The page's script ticks it while the picture can be seen (web_assets/shown.js).
        self._seen = gui.add_checkbox("Association view is seen", False, visible=False)
        self._seen.on_update(posting(post, lambda _event: LookAgain()))
        gui.add_html(theme.WIDE.replace("c-wide", "c-wide c-tools"))
        buttons = gui.add_button_group("", (PREVIOUS, WORST, NEXT))
        buttons.on_click(posting(post, lambda event: self._turn_to(event.target.value)))
        for label, key, meaning in KEYS:
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(posting(post, lambda _event, meaning=meaning: self._turn_to(meaning)))
        self._html = gui.add_html(self._framed("<div class='c-note'>Numbers appear with the first scan.</div>"))
        self._table = gui.add_html("")
        self._ids: tuple[str, ...] = ()
        self._shown = ""
        self._drawn: tuple[object, ...] = ()

    def _framed(self, content: str) -> str:
        return f"<div class='c-association' data-seen='{viser_private.identifier(self._seen)}'>{content}</div>"

    def _turn_to(self, meaning: str) -> Action:
        """Return the action of a button: the reflector before or behind the one shown, or whatever is worst."""
        if meaning == WORST or not self._ids:
            return SelectReflectors(())
        at = self._ids.index(self._shown) if self._shown in self._ids else 0
        step = 1 if meaning == NEXT else -1
        return SelectReflectors((self._ids[(at + step) % len(self._ids)],))

    def draw(self, view: PageView) -> None:
        """Show the reflector that is selected, else the worst of the scan."""
        run = view.part(RunView)
        if run is None or not self._seen.value:
            return
        selected = editor_of(view.state, self._browser).selected
        wanted = selected[0] if selected else ""
        drawn = (run.result, run.newest, wanted)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        found = associated(run, wanted)
        self._ids = detected_ids(run, wanted)
        self._shown = wanted if found is None else found.reflector.id
        if found is None:
            self._html.content = self._framed(f"<div class='c-note'>{_nothing(run, wanted)}</div>")
            self._table.content = ""
            return
        time = float(run.result.times[run.newest])
        self._html.content = self._framed(head(found, time) + picture(found))
        self._table.content = f"<div class='c-a-rows'>{table(rows(found))}{LEGEND}</div>"


def associated(run: RunView, wanted: str) -> Association | None:
    """Return a reflector of the scan at the cursor; None where there is none.

    Parameters
    ----------
    run : at its cursor.
    wanted : id of the reflector; empty: the worst of the scan.
    """
    if run.estimate is None or run.estimate.bearing is not None:
        return None
    given = AssociationInput(
        columns=run.result.columns,
        cycle=run.seen,
        estimate=run.estimate,
        covariances=run.areas,
        reflector=wanted,
    )
    return association(given)


def detected_ids(run: RunView, wanted: str) -> tuple[str, ...]:
    """Return the ids of the reflectors that were detected in the scan, and the one that is looked at, as in the map."""
    if run.estimate is None:
        return ()
    reflectors = run.segment.setup.reflectors.reflectors
    found = {reflectors[index].id for index in run.estimate.reflector.tolist() if index >= 0} | {wanted}
    return tuple(reflector.id for reflector in reflectors if reflector.id in found)


def _nothing(run: RunView, wanted: str) -> str:
    """Say why there is nothing to look at."""
    if run.estimate is None:
        return "Numbers appear with the first scan."
    if run.estimate.bearing is not None:
        return "The goniometer tells bearings alone; what became of them is told with the numbers of now."
    if wanted:
        return "The selected reflector is not in the map of this scan."
    return "No detection of this scan lies near a reflector. Select a reflector to see where it was expected."
