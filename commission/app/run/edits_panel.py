"""What edits of parameters and reflectors act on: the whole drive, or what lies behind the cursor."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.panel import BasePanel, Post, clock, posting
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.run.actions import EditFromHereOn
from commission.app.run.state import RunState
from commission.app.run.view import RunView

NO_RUN = "Acts on the next drive."
WHOLE = "Acts on the whole drive: it is localized again from its start."
FROM_HERE = "Acts from the cursor on; what lies before it stays as it was lived."


def note(view: PageView) -> str:
    """Say what an edit acts on, and from where on those before do."""
    run = view.part(RunView)
    if run is None:
        return NO_RUN
    text = FROM_HERE if view.state.part(RunState).from_here_on else WHOLE
    if run.edits:
        text += f" Changed on the way at {', '.join(clock(time) for time in run.edits)}."
    return text


class EditsPanel(BasePanel):
    """The switch, and what it means now."""

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        self._switch = gui.add_checkbox(
            "Edits from here on",
            state.part(RunState).from_here_on,
            hint="Edits act from the cursor on, and not on the whole drive; the curves show from where.",
        )
        self._switch.on_update(posting(post, lambda event: EditFromHereOn(bool(event.target.value))))
        self._note = gui.add_html("")
        self._shown = ""

    def draw_slowly(self, view: PageView) -> None:
        """Follow the switch and the run."""
        wanted = view.state.part(RunState).from_here_on
        if self._switch.value is not wanted:
            self._switch.value = wanted
        text = note(view)
        if text != self._shown:
            self._shown = text
            self._note.content = f"<div class='c-note' style='padding:2px 4px'>{text}</div>"
