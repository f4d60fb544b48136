"""The strip under the floor: play and step, forward and back, speed, the time line with its fail episodes."""

from __future__ import annotations

from typing import Any, Literal

from viser import GuiApi

from commission.app.base import actions, theme
from commission.app.base.inputs import enable
from commission.app.base.paints import Surface
from commission.app.base.panel import BasePanel, Post, clock, posting
from commission.app.base.view import PageView
from commission.app.run.actions import Play, Restart, Seek, SetSpeed, StepScan
from commission.app.run.plots import EDIT
from commission.app.run.state import SPEEDS, RunState
from commission.app.run.view import RunView

PLAY, PAUSE, STEP, BACK, REVERSE = "Play", "Pause", "Step", "Back", "Reverse"
FOLD = (
    "<div class='c-bottom'><label class='c-fold' title='Fold the plots away, or show them'>"
    "<input type='checkbox' aria-label='Fold the plots away'></label></div>"
)
"""A switch of the browser's own, which the page's style obeys: nobody else's plots are folded by it."""
NO_RUN = (
    "<div class='c-clock c-note c-no-run' title='Choose a route or a recording in the step Run' "
    "style='white-space:nowrap'>"
    "no run: see step Run</div>"
)
SHORTEST_SHOWN = 0.3
"""Percent of the time line that even the shortest episode takes, so that it is seen."""


def strip(run: RunView | None) -> str:
    """Return the drive as a bar: grey what lies ahead, green what was operational, red each fail episode.

    What is computed behind the cursor is pale, and is not counted; ticks stand where edits act from.
    """
    if run is None or run.duration <= 0.0:
        return "<div class='c-strip' style='height:8px'></div>"
    percent = 100.0 / run.duration
    done = min(100.0, run.time * percent)
    parts = [f"<rect x='0' y='0' width='{done:.2f}' height='8' fill='{theme.OPERATIONAL_COLOR}'/>"]
    for stretches, opacity in ((run.lived_episodes, 1.0), (run.coming_episodes, 0.45)):
        for start, end in stretches:
            width = max(SHORTEST_SHOWN, (end - start) * percent)
            parts.append(
                f"<rect x='{min(start * percent, 100.0 - width):.2f}' y='0' width='{width:.2f}' height='8' "
                f"fill='{theme.FAIL_COLOR}' opacity='{opacity}'/>"
            )
    parts += [f"<rect x='{at * percent:.2f}' y='0' width='0.2' height='8' fill='{EDIT}'/>" for at in run.edits]
    return (
        f"<div class='c-strip' data-episodes='{len(run.lived_episodes)}' data-coming='{len(run.coming_episodes)}' "
        f"data-edits='{len(run.edits)}'>"
        "<svg width='100%' height='8' viewBox='0 0 100 8' preserveAspectRatio='none' "
        f"style='display:block;background:{theme.css(Surface.TIME_LINE.dark)}'>{''.join(parts)}</svg></div>"
    )


class TimeLine(BasePanel):
    """Play clock and seeking; the page's style turns this panel into a strip."""

    def __init__(self, gui: GuiApi, post: Post, speed: float) -> None:
        gui.add_html(FOLD)
        buttons = gui.add_button_group("", (REVERSE, BACK, PAUSE, STEP, PLAY))
        buttons.on_click(posting(post, lambda event: _clicked(event.target.value)))
        self._speed = gui.add_dropdown(
            "", tuple(_factor(s) for s in SPEEDS), initial_value=_factor(speed), hint="Speed of the play clock."
        )
        self._speed.on_update(posting(post, lambda event: SetSpeed(float(str(event.target.value).rstrip("x")))))
        self._clock = gui.add_html(NO_RUN)
        self._slider = gui.add_slider("", 0.0, 1.0, 0.01, 0.0, hint="Goes to a moment of the drive [s].")
        enable(self._slider, "there is no run; choose a route or a recording in the step Run")
        self._slider.on_update(posting(post, lambda event: Seek(float(event.target.value))))
        self._strip = gui.add_html(strip(None))
        self._shown = ("", "")
        keys: tuple[tuple[str, Literal["P", "N", "B"], Literal["shift"] | None, actions.Action], ...] = (
            ("Play or pause", "P", None, Play()),
            ("Play backward", "P", "shift", Play(playing=True, backward=True)),
            ("One scan further", "N", None, StepScan()),
            ("One scan back", "N", "shift", StepScan(back=True)),
            ("Run the drive afresh", "B", None, Restart()),
        )
        for label, key, modifier, action in keys:
            command = gui.add_command(label, hotkey=key, modifier=modifier)
            command.on_trigger(posting(post, lambda _event, action=action: action))

    def draw_slowly(self, view: PageView) -> None:
        """Show time and episodes."""
        run = view.part(RunView)
        if run is None:
            return
        enable(self._slider, "")
        if self._slider.max != run.duration and run.duration > 0.0:
            self._slider.max = run.duration
        shown_time = round(min(run.time, run.duration), 2)
        if abs(self._slider.value - shown_time) > 0.005:
            self._slider.value = shown_time
        if view.state.part(RunState).speed != float(self._speed.value.rstrip("x")):
            self._speed.value = _factor(view.state.part(RunState).speed)
        asked = view.state.part(RunState)
        state = (
            "backward" if asked.backward else "playing" if asked.playing else "at the end" if run.at_end else "paused"
        )
        text = (
            "<div class='c-clock' style='font-size:12px;white-space:nowrap;font-variant-numeric:tabular-nums'>"
            f"<b>{clock(run.time)}</b> / {clock(run.duration)} <span style='opacity:.6'>{state}</span></div>"
        )
        bar = strip(run)
        if (text, bar) != self._shown:
            self._shown = (text, bar)
            self._clock.content = text
            self._strip.content = bar


def _state(asked: RunState, *, at_end: bool) -> str:
    """Say what the play clock does."""
    if asked.playing:
        return "playing backward" if asked.backward else "playing"
    return "at the end" if at_end else "paused"


def _factor(speed: float) -> str:
    return f"{speed:g}x"


def _clicked(label: Any) -> actions.Action:
    """From the button's label to what it means."""
    if label in (STEP, BACK):
        return StepScan(back=label == BACK)
    return Play(playing=label != PAUSE, backward=label == REVERSE)
