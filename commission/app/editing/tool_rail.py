"""The rail at the floor's edge: one button for each tool, with its icon, its key, and the tool in use lit.

viser's buttons carry no icons: each group brings a style of its own that draws them, masks in the color of its words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from viser import GuiApi

from commission.app.base.icons import mask
from commission.app.base.inputs import write_html
from commission.app.base.paints import Worded
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.theme import RAIL_PX, css
from commission.app.base.view import PageView
from commission.app.editing.actions import ChooseTool
from commission.app.editing.editor import editor_of
from commission.app.editing.tool import Tool

SELECT = "Select"
"""On the button that puts the tool away."""

ICONS: Mapping[str, str] = {
    SELECT: "M5 3l6 17 2.6-7 7-2.6z",
    "Place": "M12 4a8 8 0 1 0 0 16a8 8 0 1 0 0-16M12 8.5v7M8.5 12h7",
    "Route": "M7 18h7a4 4 0 0 0 0-8h-4a3.5 3.5 0 0 1 0-7h7M3 18h4M14 .5L17 3l-3 2.5M3 16v4",
    "Station": "M12 21c-4-5-6-8-6-11a6 6 0 0 1 12 0c0 3-2 6-6 11zM12 8a2 2 0 1 0 0 4a2 2 0 1 0 0-4",
    "Tag": "M4 4h16v16H4zM8 8h3v3H8zM13 8h3M13 11h3v2M8 14h2v2M12 14v2h4",
    "Measure": "M3 16L16 3l5 5L8 21zM7 12l2 2M10 9l3 3M13 6l2 2",
    "Erase": "M8 20l-5-5L14 4l6 6-10 10zM9 9l6 6M8 20h12",
    "Wall": "M3 6h18v12H3zM3 12h18M9 6v6M15 12v6",
    "Obstacle": "M4 8l8-4 8 4v8l-8 4-8-4zM4 8l8 4 8-4M12 12v8",
    "Align": "M4 20V4M4 20h16M9 15l8-8M17 7h-4.5M17 7v4.5",
}
"""Lines in a square of 24, by the tool's name."""


def rail_style(group: str, names: Sequence[str], keys: Mapping[str, str], above: int) -> str:
    """Return the style that makes a rail of the button group behind an element of class `c-rail-GROUP`.

    Parameters
    ----------
    group : its name in classes.
    names : of its tools, from the top.
    keys : letter of the key that chooses a tool, by the tool's name.
    above : buttons of the groups that stand above it.
    """
    here = f"div:has(>.c-rail-{group})+div"
    of_each = "".join(
        f"{here} button:nth-child({place}){{--c-icon:{mask(ICONS[name])};--c-key:'{keys.get(name, '')}'}}"
        for place, name in enumerate(names, start=1)
    )
    return (
        f"<style>{here}{{position:fixed;width:{RAIL_PX}px;left:calc(var(--c-floor) - {RAIL_PX}px);"
        f"top:calc(var(--c-top) + 6px + {above} * var(--c-tool) + {8 if above else 0}px)}}{of_each}</style>"
    )


class ToolRail(BasePanel):
    """A group of tools on the rail.

    Parameters
    ----------
    gui : of one browser: in another one another tool may be in use.
    post : takes what is asked for.
    browser : number of the browser's connection.
    """

    group: ClassVar[str] = ""
    """Its name in classes."""
    tools: ClassVar[Sequence[Tool | None]] = ()
    """From the top; none: a click selects."""
    keys: ClassVar[Mapping[str, str]] = {}
    """Letter of the key that chooses a tool, by the tool's name."""
    above: ClassVar[int] = 0
    """Buttons of the groups that stand above it."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        named = {SELECT if tool is None else tool.name: tool for tool in self.tools}
        self._names = tuple(named)
        self._style = rail_style(self.group, self._names, self.keys, self.above)
        self._html = gui.add_html(self._content(None))
        buttons = gui.add_button_group("", self._names)
        buttons.on_click(posting(post, lambda event: ChooseTool(named[event.target.value])))

    def draw(self, view: PageView) -> None:
        """Light the tool in use."""
        tool = editor_of(view.state, self._browser).tool
        write_html(self._html, self._content(SELECT if tool is None else tool.name))

    def _content(self, lit: str | None) -> str:
        """Return the style, and that of the lit button."""
        mark = f"<div class='c-wide c-rail c-rail-{self.group}'>{self._style}"
        if lit not in self._names:
            return f"{mark}</div>"
        button = f"div:has(>.c-rail-{self.group})+div button:nth-child({self._names.index(lit) + 1})"
        return (
            f"{mark}<style>{button}{{background:{css(Worded.PRESS.dark)}!important;color:#fff!important}}</style></div>"
        )
