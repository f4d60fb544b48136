"""How many problems the site has, shown at their tab while another one is in front."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel
from commission.app.base.view import PageView
from commission.app.problems.view import inspection_of
from commission.studies.problems import Severity


class ProblemCount(BasePanel):
    """The number at the tab; the page's script `guide.js` writes it there. Notes are no problems."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what was found."""
        count = sum(problem.severity is not Severity.NOTE for problem in inspection_of(view).problems)
        write_html(self._html, f"<i hidden data-tab='Problems' data-count='{count or ''}'></i>")
