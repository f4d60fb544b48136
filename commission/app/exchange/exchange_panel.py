"""Files in and out, in the step Site: what a file would change is shown before anything does; each browser its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from viser import GuiApi, GuiDropdownHandle, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.panel import BasePanel, Post, escaped, from_browser, posting, write
from commission.app.base.uploads import Uploads
from commission.app.base.view import PageView
from commission.app.exchange import actions
from commission.app.exchange.pending import Exchange, Pasted, Pending, ServerFile
from commission.app.exchange.words import counts, details, notes
from commission.io.exports import Format
from commission.io.imports import ENDINGS, SIZE_LIMIT, LayoutChoice
from commission.io.route_edges import RouteImport
from commission.site.project import Project

ACCEPT, CANCEL = "Accept", "Cancel"
ANY, ALL = "(most edges)", "(all)"
MOST_CHOICES = 50
"""Vehicle types or layouts that are offered."""


class ExchangePanel(BasePanel):
    """The folder "Exchange".

    Parameters
    ----------
    gui : the browser's own.
    post : takes the actions.
    browser : number of its connection.
    """

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._gui, self._post, self._browser = gui, post, browser
        self._shown: tuple[Exchange, Project | None] = (Exchange(), None)
        with gui.add_folder("Exchange", expand_by_default=False):
            self._state = gui.add_html("")
            self._stop = gui.add_button("Stop", color="gray", visible=False, hint="Do not read the file any further.")
            self._stop.on_click(posting(post, lambda _event: actions.DropImport()))
            self._add_preview()
            # A folder, because an upload button cannot be hidden by itself.
            self._inputs = gui.add_folder("Import")
            with self._inputs:
                self._add_inputs()
            self._add_exports()

    def _add_inputs(self) -> None:
        """Add the three ways in."""
        gui, post = self._gui, self._post
        uploads = Uploads(gui, lambda browser, text: post(from_browser(actions.ExchangeFailed(text), browser)))
        uploads.add(
            "Upload a file",
            lambda browser, upload: post(from_browser(actions.ReadImport(upload), browser)),
            limit=SIZE_LIMIT,
            endings=ENDINGS,
            note="Reflectors: CSV, SICK .imk. Routes: VDMA LIF, VDA 5050. A project: .zip.",
        )
        gui.add_html(theme.path_mark("file"))
        path = gui.add_text("Server file", "", hint="Path, on the computer that serves this page, of such a file.")
        read = gui.add_button("Read it", color="gray", hint="Show what the file would change.")
        read.on_click(posting(post, lambda _event: self._named(path.value)))
        text = gui.add_text(
            "Paste a table", "", multiline=True, hint="Cells of a spreadsheet: x, y; id, x, y; or a header."
        )
        take = gui.add_button("Read pasted", color="gray", hint="Show what the pasted table would change.")
        take.on_click(posting(post, lambda _event: self._pasted(text.value)))

    def _named(self, typed: str) -> page_actions.Action:
        if not typed.strip():
            return actions.ExchangeFailed("no file was named; expected its path on the server")
        return actions.ReadImport(ServerFile(Path(typed.strip())))

    def _pasted(self, text: str) -> page_actions.Action:
        if not text.strip():
            return actions.ExchangeFailed("nothing was pasted; expected rows of id, x, y, radius")
        return actions.ReadImport(Pasted(text))

    def _add_preview(self) -> None:
        """Add what is shown while a file waits for a yes or no."""
        gui, post = self._gui, self._post
        self._vehicle: GuiDropdownHandle[Any] = gui.add_dropdown(
            "Vehicle type", (ANY,), visible=False, hint="Whose edges are read."
        )
        self._layout: GuiDropdownHandle[Any] = gui.add_dropdown(
            "Layout", (ALL,), visible=False, hint="Which layout of the file is read."
        )
        for widget in (self._vehicle, self._layout):
            widget.on_update(posting(post, lambda _event: actions.ChooseLayout(self._choice())))
        self._remove = gui.add_checkbox(
            "Remove others", False, visible=False, hint="Replace: remove what is not in the file. Otherwise it stays."
        )
        self._remove.on_update(posting(post, lambda event: actions.RemoveAbsent(bool(event.target.value))))
        self._wide = gui.add_html(theme.WIDE, visible=False)
        self._answer = gui.add_button_group("", (ACCEPT, CANCEL), visible=False)
        self._answer.on_click(posting(post, self._answered))
        self._details = gui.add_html("", visible=False)

    def _answered(self, event: GuiEvent[Any]) -> page_actions.Action:
        accepts = event.target.value == ACCEPT
        return actions.AcceptImport() if accepts else actions.DropImport()

    def _choice(self) -> LayoutChoice:
        vehicle, layout = self._vehicle.value, self._layout.value
        return LayoutChoice(None if vehicle == ANY else vehicle, None if layout == ALL else layout)

    def _add_exports(self) -> None:
        gui, post = self._gui, self._post
        gui.add_html("<div class='c-note' style='padding:2px 8px'>Export</div>")
        gui.add_html(theme.WIDE)
        made = gui.add_button_group(
            "", tuple(Format), hint="Reflectors as CSV or SICK .imk, routes as VDMA LIF, the whole project as a zip."
        )
        made.on_click(posting(post, lambda event: actions.MakeFile(Format(event.target.value))))
        self._sent = gui.add_html("")

    def draw_slowly(self, view: PageView) -> None:
        """Follow the browser's exchange, and the project while something waits to be compared with it."""
        exchange = view.state.of_browser(self._browser, Exchange)
        compared = view.state.project if exchange.pending is not None else None
        if self._shown[0] is exchange and self._shown[1] is compared:
            return
        self._shown = exchange, compared
        said = _state(exchange)
        self._sent.content = _sent(exchange)
        pending = exchange.pending if exchange.reading is None else None
        self._stop.visible = exchange.reading is not None
        self._inputs.visible = pending is None
        for widget in (self._remove, self._wide, self._answer, self._details):
            widget.visible = pending is not None
        self._offer_choices(pending)
        if pending is not None:
            write(self._remove, pending.remove)
            found = pending.preview(view.state.project)
            said += _head(pending, counts(found, remove=pending.remove))
            self._details.content = _padded(notes(pending.imported.warnings) + details(found, remove=pending.remove))
        self._state.content = said

    def _offer_choices(self, pending: Pending | None) -> None:
        """Offer the vehicle types and layouts of a LIF file that has several."""
        imported = None if pending is None else pending.imported
        types, layouts = (imported.vehicle_types, imported.layouts) if isinstance(imported, RouteImport) else ((), ())
        choice = LayoutChoice() if pending is None else pending.choice
        for widget, none, names, chosen in (
            (self._vehicle, ANY, types, choice.vehicle_type),
            (self._layout, ALL, layouts, choice.layout),
        ):
            widget.visible = len(names) > 1
            if widget.visible:
                options = (none, *(name for name in dict.fromkeys(names[:MOST_CHOICES]) if name))
                if tuple(widget.options) != options:
                    widget.options = options
                if widget.value != (chosen or none):
                    widget.value = chosen or none


def _state(exchange: Exchange) -> str:
    """Say what is under way, or what went wrong."""
    if exchange.reading is not None:
        reading = exchange.reading
        return _padded(f"Reading <b>{escaped(reading.source.title)}</b> {reading.fraction:.0%}")
    if exchange.problem:
        return _padded(f"<span style='color:{theme.css(theme.REFUSED)}'>{escaped(exchange.problem)}</span>")
    return ""


def _head(pending: Pending, said: str) -> str:
    mode = "What is not in the file is removed." if pending.remove else "What is not in the file stays."
    note = f"<span class='c-note'>{mode} Nothing has changed yet.</span>"
    return _padded(f"<b>{escaped(pending.source.title)}</b><br>{said}<br>{note}")


def _sent(exchange: Exchange) -> str:
    if exchange.sent is None:
        return ""
    sent = exchange.sent
    lost = notes(sent.losses, f"{sent.name} does not hold all:")
    return _padded(lost or f"<span class='c-note'>{escaped(sent.name)} was sent.</span>")


def _padded(content: str) -> str:
    style = "padding:2px 14px 4px 8px;font-size:12.5px;line-height:1.4;overflow-wrap:anywhere"
    return f"<div style='{style}'>{content}</div>"
