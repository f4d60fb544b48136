"""What went wrong in this session, the newest first."""

from __future__ import annotations

from viser import GuiApi

from commission.app import actions
from commission.app.panels.base import BasePanel, Post, escaped, posting
from commission.app.view import PageView


class ProblemsPanel(BasePanel):
    """List of problems."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._html = gui.add_html("")
        self._clear = gui.add_button("Clear", color="gray", visible=False)
        self._clear.on_click(posting(post, lambda _event: actions.ClearProblems()))
        self._shown: tuple[str, ...] | None = None

    def draw_slowly(self, view: PageView) -> None:
        """Show the list."""
        problems = view.state.problems
        if problems == self._shown:
            return
        self._shown = problems
        lines = "".join(f"<li style='margin:3px 0'>{escaped(text)}</li>" for text in reversed(problems))
        self._html.content = (
            f"<ul class='c-problems' style='font-size:12px;padding:0 6px 0 20px;margin:4px 0'>{lines}</ul>"
            if problems
            else "<div class='c-note' style='padding:2px 6px'>None.</div>"
        )
        self._clear.visible = bool(problems)
