"""The bar at the top: which project, saved or not, undo and redo, the supervisor's badge, the view."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, TypeAlias

from viser import GuiApi, GuiButtonHandle, GuiEvent

from commission.app.base import actions, theme
from commission.app.base.panel import BasePanel, Post, escaped, posting
from commission.app.base.state import AppState, Step
from commission.app.base.view import PageView
from commission.localization.estimate import Mode

LONGEST_NAME = 22
"""Letters of a step's name that fit on a button."""
LONGEST_JOB = 16
"""Letters of a job's name that fit on a button."""

Modifier: TypeAlias = Literal["cmd/ctrl", "cmd/ctrl+shift"]


def badge_text(view: PageView) -> tuple[str, str, str]:
    """Return the badge's word, what stands beside it, and its color."""
    run, limits = view.run, view.state.project.parameters.supervisor
    if run is None or run.estimate is None:
        under_way = [escaped(job.line) for job in view.jobs]
        return ("PREPARING" if under_way else "NO RUN"), "; ".join(under_way), theme.IDLE_COLOR
    x, y, heading = run.series.two_sigma[-1]
    beside = (
        f"2σ {max(x, y) * 1000:.0f} / {limits.position_limit * 1000:.0f} mm"
        f" &nbsp; {math.degrees(heading):.2f} / {math.degrees(limits.heading_limit):.1f} °"
    )
    if run.mode is Mode.FAIL:
        lived = [episode for episode in run.episodes if episode[0] <= run.time]
        since = f" {run.time - lived[-1][0]:.0f} s" if lived else ""
        return f"FAIL{since}", beside, theme.FAIL_COLOR
    return "OPERATIONAL", beside, theme.OPERATIONAL_COLOR


def title(state: AppState) -> str:
    """Return the left end of the bar."""
    if state.foreign:
        saved = f"changed on disk: {escaped(', '.join(state.foreign))}"
    elif state.is_changed:
        saved = "unsaved"
    elif state.saved_at:
        saved = f"saved {escaped(state.saved_at)}"
    else:
        saved = "bundled project" if state.folder is None else "as on disk"
    return (
        "<div class='c-top' style='display:flex;align-items:center;padding:0 14px;gap:14px;font-size:13px;"
        "white-space:nowrap;overflow:hidden'>"
        f"<b>Commission</b><span style='opacity:.85'>{escaped(state.project.name)}</span>"
        f"<span style='opacity:.55'>{saved}</span></div>"
    )


def button_text(label: str, steps: tuple[Step, ...]) -> str:
    """Return what stands on the undo or redo button: the step's name, cut where it would crowd the bar."""
    if not steps:
        return label
    return f"{label} {shortened(steps[-1].name, LONGEST_NAME)}"


def shortened(text: str, longest: int) -> str:
    """Return a text that has at most so many letters."""
    return text if len(text) <= longest else text[: longest - 1] + "…"


def write_label(button: GuiButtonHandle, text: str) -> None:
    """Write on a button what it does not say already."""
    if button.label != text:
        button.label = text


class TopBar(BasePanel):
    """The main panel, turned into a bar by the page's style."""

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        self._title = gui.add_html(theme.STYLE + title(state))
        self._badge = gui.add_html("")
        self._shown = ("", "")
        self._head = title(state)
        self._job: int | None = None
        self._stop = gui.add_button("", hint="Background work; press to stop it.", color="gray", visible=False)
        self._stop.on_click(posting(post, lambda _event: actions.StopJob(self._job or 0)))
        buttons: tuple[tuple[str, str, Callable[[int | None], actions.Action], Literal["Z", "S"], Modifier], ...] = (
            ("Undo", "Take back the last change (Ctrl+Z)", actions.Undo, "Z", "cmd/ctrl"),
            ("Redo", "Make it again (Ctrl+Shift+Z)", actions.Redo, "Z", "cmd/ctrl+shift"),
            ("Save", "Write the project (Ctrl+Shift+S)", lambda _client: actions.Save(), "S", "cmd/ctrl+shift"),
        )
        self._buttons = {}
        for label, hint, make, key, modifier in buttons:
            button = gui.add_button(label, hint=hint, color="dark")
            button.on_click(posting(post, lambda event, make=make: make(event.client_id)))
            self._buttons[label] = button
            command = gui.add_command(label, hotkey=key, modifier=modifier)
            command.on_trigger(lambda event, make=make: post(make(event.client_id)))
        self._overwrite = gui.add_button(
            "Overwrite", hint="Save over what somebody else has written.", color="red", visible=False
        )
        self._overwrite.on_click(posting(post, lambda _event: actions.Save(overwrite=True)))
        self._reload = gui.add_button(
            "Read again", hint="Take what somebody else has written; undo brings yours back.", visible=False
        )
        self._reload.on_click(posting(post, lambda _event: actions.Reload()))
        view = gui.add_button_group("", tuple(v.value for v in actions.View))

        def show(event: GuiEvent[Any]) -> None:
            if event.client is not None:
                post(actions.SetView(event.client.client_id, actions.View(event.target.value)))

        view.on_click(show)

    def _show_job(self, view: PageView) -> None:
        """Show the work under way as the button that stops it: wherever the engineer is on the page, it is in sight."""
        job = view.jobs[0] if view.jobs else None
        self._job = None if job is None else job.number
        if self._stop.visible is not (job is not None):
            self._stop.visible = job is not None
        if job is not None:
            write_label(self._stop, f"✕ {shortened(job.name, LONGEST_JOB)} {job.fraction:.0%}")

    def draw(self, view: PageView) -> None:
        """Show the supervisor's state without delay."""
        word, beside, color = badge_text(view)
        if (word, color) == self._shown:
            return
        self._shown = (word, color)
        self._show_badge(word, beside, color)

    def _show_badge(self, word: str, beside: str, color: str) -> None:
        """Write the badge: in the row with the buttons, because above them it would cover them on a small screen."""
        self._badge.content = (
            "<div style='display:flex;align-items:center;gap:12px;margin-right:24px;white-space:nowrap'>"
            f"<span class='c-badge' style='background:{color};color:#fff;font-weight:700;font-size:15px;"
            f"letter-spacing:.1em;padding:3px 20px;border-radius:3px'>{word}</span>"
            "<span class='c-beside' style='font-size:12px;opacity:.8;font-variant-numeric:tabular-nums;"
            "min-width:130px'>"
            f"{beside}</span></div>"
        )

    def draw_slowly(self, view: PageView) -> None:
        """Show the numbers beside the badge, what the project is called, and enable what can be done."""
        state = view.state
        self._show_badge(*badge_text(view))
        head = title(state)
        if head != self._head:
            self._head = head
            self._title.content = theme.STYLE + head
        wanted = {"Undo": bool(state.undo), "Redo": bool(state.redo), "Save": state.is_changed and not state.foreign}
        self._show_job(view)
        for button in (self._overwrite, self._reload):
            if button.visible is not bool(state.foreign):
                button.visible = bool(state.foreign)
        for label, enabled in wanted.items():
            if self._buttons[label].disabled is enabled:
                self._buttons[label].disabled = not enabled
        for label, steps in (("Undo", state.undo), ("Redo", state.redo)):
            write_label(self._buttons[label], button_text(label, steps))
