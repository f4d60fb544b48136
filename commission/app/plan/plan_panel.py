"""What keeps the jobs of the step Plan waiting, above all of its parts."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, escaped
from commission.app.base.view import PageView
from commission.app.plan.planner import JOBS
from commission.app.plan.view import plan_of


class PlanNote(BasePanel):
    """One line."""

    def __init__(self, gui: GuiApi) -> None:
        self._note = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Say what has to end first."""
        busy = [job for job in view.jobs if not job.name.startswith(JOBS)]
        waits = bool(busy) and plan_of(view).waiting
        note = f"first: {escaped(busy[0].name)} {busy[0].fraction:.0%}" if waits else ""
        write_html(self._note, note and f"<div class='c-note' style='padding:2px 6px'>{note}</div>")
