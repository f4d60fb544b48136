"""What edits of parameters and reflectors act on: the whole drive, or what lies behind the cursor."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.panel import BasePanel, Post, clock, posting
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.run.actions import EditFromHereOn, MoveOnlyTheMap
from commission.app.run.state import RunState
from commission.app.run.view import DrivenHall, RunView

NO_RUN = "Acts on the next drive."
WHOLE = "Acts on the whole drive: it is localized again from its start."
FROM_HERE = "Acts from the cursor on; what lies before it stays as it was lived."
HALLS = {
    DrivenHall.RECORDED: "",
    DrivenHall.AS_DRIVEN: "Where reflectors, walls, vehicle or scanner change, it is driven again.",
    DrivenHall.DRIVING_AGAIN: "The hall has changed: the drive is simulated again; until then the one before is shown.",
    DrivenHall.OTHER: "The hall stays as it was driven: only the map, and what the localizer believes, has changed.",
}
"""What is said of the hall of the drive."""
KEEPS = "An edit of the site moves only the map; the hall of the virtual drive stays."


def note(view: PageView) -> str:
    """Say what an edit acts on, in which hall, and from where on those before do."""
    run = view.part(RunView)
    if run is None:
        return NO_RUN
    asked = view.state.part(RunState)
    parts = [FROM_HERE if asked.from_here_on else WHOLE]
    keeps = run.hall is DrivenHall.AS_DRIVEN and (asked.only_the_map or asked.from_here_on)
    parts.append(KEEPS if keeps else HALLS[run.hall])
    if run.edits:
        parts.append(f"Changed on the way at {', '.join(clock(time) for time in run.edits)}.")
    return " ".join(filter(None, parts))


class EditsPanel(BasePanel):
    """The switch, and what it means now."""

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        self._switch = gui.add_checkbox(
            "Edits from here on",
            state.part(RunState).from_here_on,
            hint="Edits act from the cursor on, and not on the whole drive; the curves show from where.",
        )
        self._switch.on_update(posting(post, lambda event: EditFromHereOn(bool(event.target.value))))
        self._only_map = gui.add_checkbox(
            "Survey error: move only the map",
            state.part(RunState).only_the_map,
            hint="The hall of a virtual drive stays as it was driven while reflectors, vehicle and scanners of the "
            "project change: what a wrong survey or mounting does. Off, the drive is simulated again.",
        )
        self._only_map.on_update(posting(post, lambda event: MoveOnlyTheMap(bool(event.target.value))))
        self._note = gui.add_html("")
        self._shown = ""

    def draw_slowly(self, view: PageView) -> None:
        """Follow the switch and the run."""
        asked = view.state.part(RunState)
        for switch, wanted in ((self._switch, asked.from_here_on), (self._only_map, asked.only_the_map)):
            if switch.value is not wanted:
                switch.value = wanted
        text = note(view)
        if text != self._shown:
            self._shown = text
            self._note.content = f"<div class='c-note' style='padding:2px 4px'>{text}</div>"
