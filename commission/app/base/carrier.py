"""What a script of the page draws by itself: a message in an element that nobody sees, sent where it is another one."""

from __future__ import annotations

import html
import json
from typing import Any

from viser import GuiApi


def as_text(message: object) -> str:
    """Return a message as JSON, without a number that JSON does not know."""
    return json.dumps(message, allow_nan=False, separators=(",", ":"))


class Carrier:
    """An element of the page that nobody sees, with a message for the script.

    Parameters
    ----------
    gui : where it is made.
    kind : how the script finds it.
    """

    def __init__(self, gui: GuiApi, kind: str) -> None:
        self._kind = kind
        self._html = gui.add_html(self._element("", 0))
        self._written, self._number = "", 0

    def write(self, message: dict[str, Any]) -> None:
        """Send a message unless it is the one that is there."""
        text = as_text(message)
        if text != self._written:
            self._written = text
            self._number += 1
            self._html.content = self._element(text, self._number)

    def _element(self, text: str, number: int) -> str:
        return (
            f"<div class='c-carried' data-kind='{self._kind}' data-number='{number}' "
            f"data-message='{html.escape(text, quote=True)}'></div>"
        )
