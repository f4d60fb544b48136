"""What every panel is given and has to do; text made safe for html; callbacks that only post."""

from __future__ import annotations

import html
import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol, TypeAlias

from viser import CommandEvent, GuiEvent

from commission.app.base import viser_private
from commission.app.base.actions import Action, Envelope, Report, Sender
from commission.app.base.view import PageView
from commission.errors import CommissionError

Post: TypeAlias = Callable[[Envelope], None]


class Panel(Protocol):
    """Widgets for one purpose."""

    def draw(self, view: PageView) -> None:
        """Show what changes with each scan."""

    def draw_slowly(self, view: PageView) -> None:
        """Show what may lag some scans behind."""


class BasePanel:
    """A panel that shows nothing live: each one overrides what it needs."""

    def draw(self, view: PageView) -> None:
        """Show what changes with each scan."""

    def draw_slowly(self, view: PageView) -> None:
        """Show what may lag some scans behind."""


def from_browser(action: Action, browser: int | None) -> Envelope:
    """Return an action in the envelope of a browser that asks for it now."""
    return Envelope(action, Sender(browser, time.monotonic()))


def posting(post: Post, make: Callable[[Any], Action]) -> Callable[[Any], None]:
    """Return a callback that posts what a person asked for, with the browser that asked.

    The server's own writes to a widget fire its callbacks too, without a client; nobody asks for anything by them.

    Parameters
    ----------
    post : takes the action in its envelope.
    make : from the widget's event, or that of a command, to the action.
    """

    def callback(event: GuiEvent[Any] | CommandEvent) -> None:
        if event.client is None:
            return
        try:
            action = make(event)
        except (CommissionError, ValueError) as error:
            action = Report(str(error))
        widget = "" if isinstance(event, CommandEvent) else viser_private.identifier(event.target)
        post(Envelope(action, Sender(event.client.client_id, time.monotonic(), widget)))

    return callback


def write(widget: Any, value: object) -> None:
    """Show a value in an input where it is another one: nothing is sent for what is there already."""
    if widget.value != value:
        widget.value = value


def shortened(text: str, longest: int) -> str:
    """Return a text that has at most so many letters."""
    return text if len(text) <= longest else text[: longest - 1] + "…"


def write_label(widget: Any, text: str) -> None:
    """Write on a button, or before a field, what it does not say already."""
    if widget.label != text:
        widget.label = text


def escaped(text: object) -> str:
    """Return text of a file or a person as html shows it, never as html reads it; a name is no color either."""
    return "&#35;".join(html.escape(part, quote=True) for part in str(text).split("#"))


IN_ONE_LINE = 24
"""Letters of a value that no line break tears from its unit."""


def table(rows: Iterable[tuple[str, str]]) -> str:
    """Return a table of two columns; the caller escapes what is not its own."""
    body = "".join(
        f"<tr{' class=c-one' if len(value) <= IN_ONE_LINE else ''}><td>{name}</td><td>{value}</td></tr>"
        for name, value in rows
    )
    return f'<table class="c-table">{body}</table>'


def clock(seconds: float) -> str:
    """Return a time as 02:05 or 1:02:05."""
    whole = int(seconds)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes:02d}:{whole % 60:02d}"
