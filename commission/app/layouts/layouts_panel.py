"""The step Plan: keeps layouts, holds the one of now against one of them, and switches between the two."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiDropdownHandle

from commission.app.base import theme, viser_private
from commission.app.base.actions import Action
from commission.app.base.inputs import Inputs, Text, WorkBar, enable, show
from commission.app.base.panel import BasePanel, Post, escaped, posting, write_label
from commission.app.base.view import PageView
from commission.app.layouts.actions import ForgetLayout, KeepLayout, SetComparison, SwitchLayout
from commission.app.layouts.service import COMPARING
from commission.app.layouts.state import MOST_KEPT, KeptLayout, LayoutsState
from commission.app.layouts.view import LayoutsView
from commission.app.layouts.words import FIGURE_NAMES, NOTHING_KEPT, comparison_table, told
from commission.site.fields import get_field

NOTHING = "nothing"


class LayoutsPanel(BasePanel):
    """Widgets of the comparison."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._inputs = Inputs(gui, post, SetComparison, lambda state, name: get_field(state.part(LayoutsState), name))
        self._shown: KeptLayout | None = None
        self._numbers: dict[str, int] = {}
        keep = "Keep how the reflectors stand now, beside what is tried next."
        self._keep = gui.add_button("Keep this layout", hint=keep)
        self._keep.on_click(posting(post, lambda _event: KeepLayout()))
        self._against: GuiDropdownHandle[Any] = gui.add_dropdown(
            "Compare with", (NOTHING,), visible=False, hint="Kept layout that the reflectors of now are compared with."
        )
        self._inputs.connect(
            "against",
            self._against,
            lambda name: self._numbers.get(str(name), 0),
            lambda state: next(
                (name for name, number in self._numbers.items() if number == state.part(LayoutsState).against), NOTHING
            ),
        )
        switch = "Puts the kept layout up, in one undo step; how the reflectors stand now is kept, to switch back."
        self._switch = gui.add_button("Switch", color="gray", visible=False, hint=switch)
        self._switch.on_click(posting(post, self._switched))
        self._figure = self._inputs.choice("figure", LayoutsState(), FIGURE_NAMES)
        # Its names hold units, which a short field would cut.
        gui.add_html(theme.whole_line(viser_private.identifier(self._figure)))
        self._work = WorkBar(gui, post, COMPARING, SetComparison("against", 0))
        self._table = Text(gui)
        self._forget = gui.add_button("Forget", color="gray", visible=False, hint="Forget the kept layout.")
        self._forget.on_click(posting(post, self._forgot))

    def _switched(self, _event: Any) -> Action:
        """Switch to what the button says; it may have been forgotten since it was drawn."""
        return KeepLayout() if self._shown is None else SwitchLayout(self._shown.number)

    def _forgot(self, _event: Any) -> Action:
        return SetComparison("against", 0) if self._shown is None else ForgetLayout(self._shown.number)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what is kept, progress and result."""
        part, found = view.state.part(LayoutsState), view.part(LayoutsView)
        names = {each.title: each.number for each in part.kept}
        if names != self._numbers:
            self._numbers = names
            self._against.options = (NOTHING, *names)
            self._inputs.forget()
        self._inputs.follow(view.state)
        self._work.follow(view)
        reflectors = view.state.project.reflectors
        own = part.of(reflectors)
        self._enable_keep(part, own, count=len(reflectors))
        self._shown = None if found is None else found.kept
        for widget in (self._switch, self._forget, self._figure):
            show(widget, visible=found is not None)
        show(self._against, visible=bool(part.kept))
        if found is not None:
            write_label(self._switch, f"Switch to layout {found.kept.number}")
            enable(self._switch, f"reflectors stand as in layout {found.kept.number}" if found.is_same else "")
            write_label(self._forget, f"Forget layout {found.kept.number}")
        self._table.write((found, bool(part.kept)), lambda: _content(found, is_kept=bool(part.kept)))

    def _enable_keep(self, part: LayoutsState, own: KeptLayout | None, *, count: int) -> None:
        """Say why the layout of now cannot be kept."""
        why_not = "" if count else "there are no reflectors yet"
        if own is not None:
            why_not = f"it is kept as layout {own.number}"
        elif len(part.kept) >= MOST_KEPT:
            why_not = f"{MOST_KEPT} layouts are kept; forget one first"
        enable(self._keep, why_not)


def _content(found: LayoutsView | None, *, is_kept: bool) -> str:
    """The table with its notes; before something is kept, what the folder is for."""
    if found is None:
        note = "Nothing is compared." if is_kept else NOTHING_KEPT
        return f"<div class='c-note' style='padding:2px 6px'>{note}</div>"
    notes = "".join(f"<div class='c-note'>{escaped(note)}</div>" for note in told(found))
    before, after = found.before, found.after
    table = "" if before is None or after is None else comparison_table(before, after, found.kept.number)
    return f"<div class='c-layouts' style='padding:2px 10px 4px 6px'>{notes}{table}</div>"
