"""Inputs of the selected station or tag, as part of the selection's panel."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.actions import Action
from commission.app.base.inputs import Inputs, show
from commission.app.base.panel import Post, posting
from commission.app.base.state import AppState
from commission.app.editing.editor import PosedKind, editor_of
from commission.app.editing.posed_actions import AlignStation, DeletePosed, SetPosed
from commission.app.editing.posed_kinds import KINDS, PosedMark, mark_of
from commission.app.editing.several import SEVERAL
from commission.site.fields import get_field, names_of
from commission.site.stations import ACCURACY, DOCKING, TRANSIT

BUTTONS: Mapping[PosedKind, Mapping[str, Action]] = {
    PosedKind.STATION: {
        ACCURACY.brief(DOCKING): SetPosed(PosedKind.STATION, "required_accuracy", DOCKING),
        ACCURACY.brief(TRANSIT): SetPosed(PosedKind.STATION, "required_accuracy", TRANSIT),
        "Onto route": AlignStation(),
        "Delete": DeletePosed(PosedKind.STATION),
    },
    PosedKind.TAG: {"Delete": DeletePosed(PosedKind.TAG)},
}
"""What each button of a kind asks for."""


class PosedFields:
    """Every field of a station or a tag, and buttons.

    Parameters
    ----------
    gui : the browser's own.
    post : takes the actions.
    browser : number of its connection.
    kind : stations or tags.
    """

    def __init__(self, gui: GuiApi, post: Post, browser: int, kind: PosedKind) -> None:
        self._browser, self._kind, self._shown = browser, kind, ""
        self._inputs = Inputs(gui, post, partial(SetPosed, kind), self._read)
        self._folder = gui.add_folder(kind.capitalize(), visible=False)
        with self._folder:
            example, buttons = KINDS[kind].first("1"), BUTTONS[kind]
            self._fields = {name: self._inputs.field(name, example) for name in names_of(type(example))}
            gui.add_html(theme.WIDE)
            row = gui.add_button_group("", tuple(buttons))
            row.on_click(posting(post, lambda event: buttons[event.target.value]))

    def _selected(self, state: AppState) -> PosedMark | None:
        """Return the selected one of this kind."""
        key = editor_of(state, self._browser).posed
        return mark_of(state.project, key) if key is not None and key.kind is self._kind else None

    def _read(self, state: AppState, name: str) -> Any:
        """Return a value of the selected one; None without one."""
        mark = self._selected(state)
        return None if mark is None else get_field(mark, name)

    def show(self, state: AppState) -> None:
        """Show the selected one."""
        mark, several = self._selected(state), SEVERAL[KINDS[self._kind].field]
        chosen = several.chosen(state, self._browser)
        show(self._folder, visible=mark is not None)
        for field in several.alone:
            show(self._fields[field], visible=len(chosen) < 2)
        name = "" if mark is None else KINDS[self._kind].named.key_of(mark)
        if name and name != self._shown:
            self._inputs.forget()
        self._shown = name
        self._inputs.follow(state)
