"""The step Plan: where a vehicle that is switched on could take its place for another one."""

from __future__ import annotations

from viser import GuiApi, GuiFolderHandle

from commission.app.ambiguity.service import COLD_START
from commission.app.ambiguity.settings import AmbiguitySettings, DropPlaces, FindPlaces, SetAmbiguity, ShowPair
from commission.app.ambiguity.view import ColdStartView
from commission.app.base import theme
from commission.app.base.inputs import Inputs, Text, WorkBar
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.rows import Rows
from commission.app.base.view import PageView
from commission.site.fields import get_field
from commission.site.quantity import counted_text

MOST_PAIRS = 15
MOST_NAMES = 6


class ColdStartPanel(BasePanel):
    """Widgets of the ambiguous places.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    folder : the folder that holds them.
    """

    def __init__(self, gui: GuiApi, post: Post, folder: GuiFolderHandle) -> None:
        self._inputs = Inputs(
            gui, post, SetAmbiguity, lambda state, name: get_field(state.part(AmbiguitySettings), name)
        )
        self._inputs.field("tolerance", AmbiguitySettings())
        hint = "Look for places from which the reflectors look as they do from somewhere else."
        ask = gui.add_button("Find ambiguous places", hint=hint)
        ask.on_click(posting(post, lambda _event: FindPlaces()))
        self._work = WorkBar(gui, post, COLD_START, DropPlaces())
        self._text = Text(gui)
        self._pairs = Rows(gui, folder, post, ShowPair)
        self._shown: tuple[ColdStartView | None, int] | None = None

    def draw_slowly(self, view: PageView) -> None:
        """Follow settings, progress and result."""
        found, chosen = view.part(ColdStartView), view.state.part(AmbiguitySettings).pair
        self._inputs.follow(view.state)
        self._work.follow(view)
        if self._shown == (found, chosen):
            return
        self._shown = found, chosen
        self._text.write((found,), lambda: "" if found is None else _summary(found))
        self._pairs.show([] if found is None else _lines(found, chosen))


def _summary(found: ColdStartView) -> str:
    """Say how many pairs there are, and whether they are those of now."""
    count = len(found.ambiguity.pairs)
    if count:
        listed = f", the {MOST_PAIRS} most frequent listed" if count > MOST_PAIRS else ""
        notes = [f"{counted_text(count, 'pair')} of look-alikes{listed}; a click shows one."]
    else:
        notes = ["No two places look alike."]
    if found.outdated:
        notes.append("The site or the tolerance has changed since: look again.")
    if not found.is_drawn:
        notes.append("The map is under the heatmap: switch that off to see it.")
    return "".join(f"<div class='c-note' style='padding:2px 6px'>{note}</div>" for note in notes)


def _lines(found: ColdStartView, chosen: int) -> list[tuple[str, theme.Color]]:
    """A line for each of the most frequent pairs."""
    ambiguity = found.ambiguity
    return [
        (
            f"{_names(ambiguity.names(pair.constellation))} like {_names(ambiguity.names(pair.image))}: "
            f"{counted_text(pair.poses, 'pose')}",
            theme.SELECTED_LINE if index == chosen else theme.LINE,
        )
        for index, pair in enumerate(ambiguity.pairs[:MOST_PAIRS])
    ]


def _names(names: tuple[str, ...]) -> str:
    """Names of a group, cut where they would fill the panel. They are labels of buttons, which show no html."""
    more = f" +{len(names) - MOST_NAMES}" if len(names) > MOST_NAMES else ""
    return " ".join(names[:MOST_NAMES]) + more
