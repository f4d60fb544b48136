"""A list of lines to click on, made of as many buttons as were ever needed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from viser import GuiApi, GuiFolderHandle, GuiTabHandle

from commission.app.base import theme
from commission.app.base.actions import Action
from commission.app.base.panel import Post, posting

ROWS = "<div class='c-rows'></div>"
"""Makes the buttons behind it look like lines of a list."""


class Rows:
    """Lines of text, each of which posts an action.

    Parameters
    ----------
    gui : where the widgets are made.
    tab : the tab or folder that the lines are at the end of; the list is made inside of it.
    post : takes the actions.
    make : from a line's index to the action.
    """

    def __init__(
        self, gui: GuiApi, tab: GuiTabHandle | GuiFolderHandle, post: Post, make: Callable[[int], Action]
    ) -> None:
        self._gui, self._tab, self._post, self._make = gui, tab, post, make
        gui.add_html(ROWS)
        self._buttons: list[Any] = []

    def show(self, lines: Sequence[tuple[str, theme.Color]]) -> None:
        """Show these lines with their colors and no others."""
        with self._tab:
            while len(self._buttons) < len(lines):
                self._buttons.append(self._added(len(self._buttons)))
        for index, button in enumerate(self._buttons):
            visible = index < len(lines)
            if visible:
                text, color = lines[index]
                if button.label != text:
                    button.label = text
                if button.color != color:
                    button.color = color
            if button.visible is not visible:
                button.visible = visible

    def _added(self, index: int) -> Any:
        """Make one more line at the end."""
        button = self._gui.add_button(" ", color=theme.LINE)
        button.on_click(posting(self._post, lambda _event: self._make(index)))
        return button
