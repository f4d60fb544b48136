"""What is wrong with the site, live, a click away from its place; and what went wrong in this session."""

from __future__ import annotations

from viser import GuiApi, GuiTabHandle

from commission.app.base import actions, theme
from commission.app.base.actions import ClearFaults
from commission.app.base.panel import BasePanel, Post, escaped, posting
from commission.app.base.rows import Rows
from commission.app.base.view import PageView
from commission.app.problems.actions import ShowProblem
from commission.app.problems.view import inspection_of
from commission.site.quantity import counted_text
from commission.studies.problems import Problem, Severity

COLORS: dict[Severity, theme.Color] = {
    Severity.ERROR: theme.ERROR_LINE,
    Severity.WARNING: theme.WARNING_LINE,
    Severity.NOTE: theme.LINE,
}
MOST_SHOWN = 60


class ProblemsPanel(BasePanel):
    """Two lists of problems.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    tab : the tab that holds the lists.
    """

    def __init__(self, gui: GuiApi, post: Post, tab: GuiTabHandle) -> None:
        self._html = gui.add_html("")
        self._clear = gui.add_button("Clear", color="gray", visible=False)
        self._clear.on_click(posting(post, lambda _event: ClearFaults()))
        self._found: tuple[Problem, ...] = ()
        self._rows = Rows(gui, tab, post, self._showing)
        self._shown: tuple[object, object] | None = None

    def _showing(self, index: int) -> actions.Action:
        """Return the action of a line; the list may have become shorter since it was drawn."""
        if index < len(self._found):
            return ShowProblem(self._found[index])
        return actions.Report("this problem is gone", failed=False)

    def draw_slowly(self, view: PageView) -> None:
        """Show both lists."""
        problems, found = view.state.faults, inspection_of(view).problems
        if self._shown is not None and self._shown[0] is problems and self._shown[1] is found:
            return
        self._shown = problems, found
        self._found = found[:MOST_SHOWN]
        lines = "".join(f"<li style='margin:3px 0'>{escaped(text)}</li>" for text in reversed(problems))
        self._html.content = (
            f"<ul class='c-problems' style='font-size:12px;padding:0 6px 0 20px;margin:4px 0'>{lines}</ul>"
            if problems
            else f"<div class='c-note' style='padding:2px 6px'>{summary(found)}</div>"
        )
        self._clear.visible = bool(problems)
        self._rows.show([(problem.text, COLORS[problem.severity]) for problem in self._found])


def summary(found: tuple[Problem, ...]) -> str:
    """Say how many problems there are.

    Parameters
    ----------
    found : problems and notes of the site.
    """
    if not found:
        return "None."
    notes = sum(problem.severity is Severity.NOTE for problem in found)
    # As the number at the tab, which counts no notes.
    count = ", ".join(counted_text(n, word) for n, word in ((len(found) - notes, "problem"), (notes, "note")) if n)
    shown = f" of the site; the first {MOST_SHOWN} shown" if len(found) > MOST_SHOWN else " of the site"
    return f"{count}{shown}; a click goes there."
