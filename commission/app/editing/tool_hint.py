"""One line over the floor that says what a click does now and how far one has come. Nothing to click in it."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.panel import BasePanel, escaped
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing.editor import Editor, Snapping, editor_of
from commission.app.editing.gestures import moved, selected_of
from commission.app.editing.posed_gestures import moved_posed
from commission.app.editing.posed_kinds import KINDS
from commission.site.project import Project
from commission.site.quantity import DEGREES


def hint(state: AppState, browser: int) -> str:
    """Return where what is dragged comes to lie, or what the tool in use expects; empty: nothing to say."""
    editor = editor_of(state, browser)
    if editor.drag is not None and (editor.selected or editor.posed is not None):
        return _dragging(state.project, editor)
    return "" if editor.tool is None else editor.tool.hint(state, browser)


def _dragging(project: Project, editor: Editor) -> str:
    """Say where what is being dragged would come to lie."""
    mark = moved_posed(project, editor)
    if editor.posed is not None and mark is not None:
        called, heading = KINDS[editor.posed.kind].called(mark), DEGREES.text(mark.heading, ".1f")
        return f"{escaped(called)} to x {mark.x:.3f} m, y {mark.y:.3f} m, heading {heading}"
    selected = selected_of(project, editor)
    if editor.drag is None or len(selected) == 0:
        return ""
    if len(selected) > 1:
        dx, dy = editor.drag.offset
        return f"{len(selected)} reflectors by {dx:+.3f} m, {dy:+.3f} m"
    place = next(r for r in moved(project, editor).reflectors if r.id == selected[-1].id)
    return f"{escaped(place.id)} to x {place.x:.3f} m, y {place.y:.3f} m"


def attracts(snapping: Snapping) -> str:
    """Say what attracts a reflector that is placed or dragged.

    Parameters
    ----------
    snapping : of a browser.
    """
    grid = f"grid {snapping.grid:g} m" if snapping.grid else ""
    found = [word for word, on in (("walls", snapping.walls), ("neighbors", snapping.neighbors), (grid, grid)) if on]
    return f"snap: {', '.join(found) or 'off'}"


class ToolHint(BasePanel):
    """The line, in the middle above the floor; and what attracts, which the status line below the floor reads there."""

    def __init__(self, gui: GuiApi, browser: int) -> None:
        self._browser = browser
        self._html = gui.add_html("")
        self._shown = ("", "")

    def draw(self, view: PageView) -> None:
        """Follow the editor without delay."""
        text = hint(view.state, self._browser), attracts(editor_of(view.state, self._browser).snapping)
        if text == self._shown:
            return
        self._shown = text
        said = f"<div class='c-hint'>{text[0]}</div>" if text[0] else ""
        self._html.content = f"{said}<span class='c-attracts' hidden>{text[1]}</span>"
