"""Asks the browser that saves a copy, and no other, whether what lies in that folder is to be replaced."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import actions, theme
from commission.app.base.inputs import show, write_html
from commission.app.base.panel import BasePanel, Post, escaped, posting
from commission.app.base.view import PageView
from commission.app.project.actions import AskToReplace, KeepOther, Save
from commission.app.project.state import CopyQuestion


class CopyQuestionPanel(BasePanel):
    """The question and its two answers, above everything else of the tab; nothing while there is none."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._asked: AskToReplace | None = None
        self._text = gui.add_html("", order=-1.0, visible=False)
        self._answers = (
            gui.add_button("Replace it", color="red", hint="Write over it.", order=-0.9, visible=False),
            gui.add_button("Keep it", color="gray", hint="Write nothing.", order=-0.8, visible=False),
        )
        replace, keep = self._answers
        replace.on_click(posting(post, lambda _event: self._replace()))
        keep.on_click(posting(post, lambda _event: KeepOther()))

    def _replace(self) -> actions.Action:
        return KeepOther() if self._asked is None else Save(self._asked.folder, overwrite=True)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what the browser asks for."""
        self._asked = asked = view.state.of_browser(self._browser, CopyQuestion).asked
        text = "" if asked is None else f"{escaped(asked.folder)} holds {escaped(asked.holds)}. Replace it?"
        style = f"font-size:12px;padding:2px 8px;color:{theme.css(theme.REFUSED)};overflow-wrap:anywhere"
        write_html(self._text, text and f"<div style='{style}'>{text}</div>")
        for answer in self._answers:
            show(answer, visible=asked is not None)
