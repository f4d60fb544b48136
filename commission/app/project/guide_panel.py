"""The card on the floor of a site that does not drive yet, and of each step a tick or what it lacks."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, escaped
from commission.app.base.view import LivedPath, PageView
from commission.app.editing.editor import editor_of
from commission.app.project.lacking import Task, lacking, tasks
from commission.site.project import Project


def card(project: Project, *, drives: bool, small: bool) -> str:
    """Return the card; empty once something drives.

    Parameters
    ----------
    project : as edited now.
    drives : whether a run is on the page.
    small : whether a tool is in use, which needs the floor.
    """
    if drives:
        return ""
    every = tasks(project, drives=drives)
    is_begun = small or any(task.done for task in every)
    head = "" if is_begun else "<b>A new site, from nothing to a driving vehicle</b>"
    kind = "c-card c-card-line" if is_begun else "c-card"
    return f"<div class='{kind}'>{head}<ol>{''.join(_line(task, is_begun=is_begun) for task in every)}</ol></div>"


def _line(task: Task, *, is_begun: bool) -> str:
    """Return one task as a line of the card, or as a button of the small one."""
    note = escaped(task.note)
    blocked = "" if task.way else " disabled"
    return (
        f"<li{' class=c-done' if task.done else ''}>"
        f"<button type='button' data-go='{task.way}' title='{note}'{blocked}>{task.title}</button>"
        + (f"<span>{note}</span>" if not is_begun or blocked else "")
        + "</li>"
    )


def marks(project: Project, *, drives: bool) -> str:
    """Return what the page's script shows at the tabs of the steps."""
    return "".join(
        f"<i hidden data-tab='{step}' data-lacks='{escaped(text)}'></i>"
        for step, text in lacking(project, drives=drives).items()
    )


class GuidePanel(BasePanel):
    """The card of one browser, and the ticks of its steps.

    Parameters
    ----------
    gui : the browser's own.
    browser : number of its connection.
    """

    def __init__(self, gui: GuiApi, browser: int) -> None:
        self._browser = browser
        self._html = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project, the run, and the tool in use."""
        project, drives = view.state.project, view.part(LivedPath) is not None
        small = editor_of(view.state, self._browser).tool is not None
        write_html(self._html, marks(project, drives=drives) + card(project, drives=drives, small=small))


class LackingPanel(BasePanel):
    """One line on top of a step that says what it lacks; nothing where that is nothing.

    Parameters
    ----------
    gui : everybody's.
    step : title of its tab.
    """

    def __init__(self, gui: GuiApi, step: str) -> None:
        self._step = step
        self._html = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project and the run."""
        lacks = lacking(view.state.project, drives=view.part(LivedPath) is not None)[self._step]
        write_html(self._html, lacks and f"<div class='c-lacks'>Missing: {escaped(lacks)}</div>")
