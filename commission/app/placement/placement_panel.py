"""The step Plan, last part: demands, a suggested layout, and whether it is accepted."""

from __future__ import annotations

from typing import Any

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.actions import Action, LookAt
from commission.app.base.before_after import before_after
from commission.app.base.inputs import Inputs, Text, WorkBar, enable, show
from commission.app.base.panel import BasePanel, Post, escaped, posting, table
from commission.app.base.rows import Rows
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing.actions import ChooseTool
from commission.app.placement.actions import (
    AcceptLayout,
    AskLayout,
    CountRoute,
    DiscardLayout,
    EndSearch,
    FreeAreas,
    SetLayout,
    TakePreset,
)
from commission.app.placement.keep_out_tool import KeepOutTool
from commission.app.placement.service import LAYOUT
from commission.app.placement.view import LayoutView
from commission.app.placement.wish import LayoutWish
from commission.site.fields import get_field
from commission.site.layout_brief import DEMAND_PRESETS, Demands, LayoutBrief
from commission.site.quantity import DEGREES, MILLIMETRES, counted_text
from commission.studies.placement import PlacementResult, UnmetStretch

POSITION, HEADING = "demands.position_limit", "demands.heading_limit"
DEMANDS = (
    *("visible", "survive_failure", "position_limit", "heading_limit", "leeway"),
    *("pairs_differ", "wall_reach", "unambiguous_starts", "unambiguous_stations"),
)
CANDIDATES = (
    "demands.spacing",
    *(f"candidates.{name}" for name in ("spacing", "radius", "height", "clearance")),
)
"""Options of the suggested layout, in the order of their inputs; the rest stands in `project.yaml` alone."""
FIRST = LayoutBrief(demands=Demands(position_limit=0.1, heading_limit=0.02))
"""What the inputs begin with."""
MOST_UNMET = 12
REASONS = {
    "visible": "too few visible",
    "uncertainty": "2σ over its limit",
    "ambiguous": "place not told apart",
    "pairs": "pairs with nearly the same distance",
    "spread": "walls far from any reflector",
}
DRAW, CLEAR = "Draw area", "Clear areas"


def option_of(state: AppState, name: str) -> Any:
    """Return an option of the suggested layout by its name; a limit that is not set is the supervisor's."""
    value: Any = get_field(state.project.layout if "." in name else state.part(LayoutWish), name)
    limits = state.project.parameters.supervisor
    if value is None and name == POSITION:
        return limits.position_limit
    return limits.heading_limit if value is None and name == HEADING else value


class LayoutPanel(BasePanel):
    """Widgets of the suggested layout.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    """

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._gui, self._post = gui, post
        self._inputs = Inputs(gui, post, SetLayout, option_of)
        self._suggestion: PlacementResult | None = None
        self._shown: LayoutView | None = None
        self._routes: dict[str, Any] = {}
        # What was found stands above the demands: below them, it would be out of sight on a small screen.
        self._ask = gui.add_button("Suggest reflectors", hint="Fewest reflectors on walls that meet the demands.")
        self._ask.on_click(posting(post, lambda _event: AskLayout()))
        self._work = WorkBar(gui, post, LAYOUT, EndSearch())
        self._found = Text(gui)
        self._decide = gui.add_button_group("", ("Accept", "Discard"), visible=False)
        self._decide.on_click(posting(post, self._decided))
        self._not_met = gui.add_folder("Not met", visible=False)
        self._add_demands()
        self._counted = gui.add_folder("Routes that count", expand_by_default=False)
        with gui.add_folder("Where they may stand", expand_by_default=False):
            self._add_candidates()
        with self._not_met:
            self._unmet = Rows(gui, self._not_met, post, self._showing)

    def _add_demands(self) -> None:
        self._inputs.field("extend", LayoutWish())
        says = "; ".join(f"{name}: {preset.says}" for name, preset in DEMAND_PRESETS.items())
        presets = self._gui.add_button_group("Preset", tuple(DEMAND_PRESETS), hint=f"Takes these demands: {says}.")
        presets.on_click(posting(self._post, lambda event: TakePreset(str(event.target.value))))
        for name in DEMANDS:
            self._inputs.field(f"demands.{name}", FIRST)

    def _add_candidates(self) -> None:
        gui = self._gui
        for name in CANDIDATES:
            self._inputs.field(name, FIRST)
        self._areas = Text(gui)
        areas = gui.add_button_group("Keep out", (DRAW, CLEAR), hint="Areas of the floor without new reflectors.")
        areas.on_click(
            posting(
                self._post,
                lambda event: ChooseTool(KeepOutTool()) if event.target.value == DRAW else FreeAreas(None),
            )
        )

    def _decided(self, event: Any) -> Action:
        """Accept what is shown; it may have been dropped since it was drawn."""
        if event.target.value == "Accept" and self._suggestion is not None:
            return AcceptLayout(self._suggestion)
        return DiscardLayout()

    def _showing(self, index: int) -> Action:
        """Go to where a demand is not met; the list may have become shorter since it was drawn."""
        suggestion = self._suggestion
        if suggestion is None or index >= len(suggestion.unmet):
            return DiscardLayout() if suggestion is None else LookAt(suggestion.unmet[-1].place)
        return LookAt(suggestion.unmet[index].place)

    def draw_slowly(self, view: PageView) -> None:
        """Follow wishes, progress and what was found."""
        state, found = view.state, view.part(LayoutView)
        self._inputs.follow(state)
        self._follow_routes(state)
        count = len(state.project.layout.candidates.keep_out)
        self._areas.write((count,), lambda: f"<div class='c-note' style='padding:2px 6px'>{_areas_text(count)}</div>")
        enable(self._ask, "a search is under way" if self._work.follow(view) else "")
        if found is self._shown:
            return
        self._shown, self._suggestion = found, None if found is None else found.suggestion
        self._found.write((found,), lambda: "" if found is None else found_text(found))
        show(self._decide, visible=found is not None)
        unmet = [] if found is None else _unmet_lines(found.suggestion)
        self._unmet.show(unmet)
        show(self._not_met, visible=bool(unmet))

    def _follow_routes(self, state: AppState) -> None:
        """A check box for each route of the project."""
        names = tuple(route.name for route in state.project.routes)
        if names != tuple(self._routes):
            for widget in self._routes.values():
                widget.remove()
            with self._counted:
                self._routes = {name: self._route_switch(name) for name in names}
        for name, widget in self._routes.items():
            counts = name not in state.project.layout.ignored_routes
            if widget.value is not counts:
                widget.value = counts

    def _route_switch(self, name: str) -> Any:
        widget = self._gui.add_checkbox(name, True, hint="Whether the demands must hold on this route.")
        widget.on_update(posting(self._post, lambda event: CountRoute(name, bool(event.target.value))))
        return widget


def found_text(found: LayoutView) -> str:
    """Say how many reflectors are suggested, how far from the fewest that may be, and what is not met."""
    suggestion = found.suggestion
    placement = suggestion.placement
    kept = len(placement.reflectors) - placement.added
    rows = [
        ("<b>Suggested</b>", f"<b>{placement.added} new</b>, {kept} kept"),
        ("Fewest possible", f"at least {placement.at_least} new"),
        ("Places tried", str(len(placement.candidates))),
    ]
    if len(suggestion.removed):
        rows.insert(1, ("Taken down", str(len(suggestion.removed))))
    notes = [] if suggestion.unmet else ["All demands hold."]
    if placement.was_ended:
        notes.append("The search was ended: fewer might do.")
    if placement.added == 0 and not suggestion.unmet:
        notes = ["The present reflectors meet all demands."]
    if suggestion.unmet:
        shown = min(len(suggestion.unmet), MOST_UNMET)
        more = f", the first {shown} listed" if shown < len(suggestion.unmet) else ""
        notes.append(
            f"Not met on {counted_text(len(suggestion.unmet), 'stretch', 'stretches')}{more}; a click goes there."
        )
    if suggestion.zones_told:
        notes.append(f"Zones: {suggestion.zones_told}.")
    if suggestion.farthest is not None:
        notes.append(f"Worst: {suggestion.farthest.told()}.")
    if found.outdated:
        notes.append("The site has changed since: suggest again.")
    elif found.wished_otherwise:
        notes.append("The demands have changed since: suggest again.")
    notes_html = "".join(f"<div class='c-note'>{escaped(note)}</div>" for note in notes)
    told = f"{table(rows)}{notes_html}{before_after(suggestion.before, suggestion.after)}"
    return f"<div class='c-layout' style='padding:2px 10px 4px 6px'>{told}</div>"


def _unmet_lines(suggestion: PlacementResult) -> list[tuple[str, theme.Color]]:
    return [
        (f"{each.route}, {each.first} to {each.last} m: {_reason(each)}", theme.WARNING_LINE)
        for each in suggestion.unmet[:MOST_UNMET]
    ]


def _reason(stretch: UnmetStretch) -> str:
    """Say what is not met; of a limit, what is kept, and with a reflector at every place."""
    by = stretch.beyond
    if by is None:
        return REASONS.get(stretch.reason, stretch.reason)
    worst = by.worst()
    shown, form = (DEGREES, ".2f") if by.is_heading[worst] else (MILLIMETRES, ".1f")
    kept = shown.against(float(by.kept[worst]), float(by.limits[worst]), (form, form))
    return f"2σ {kept}, all places {shown.number(float(by.best[worst]), form)}"


def _areas_text(count: int) -> str:
    if not count:
        return "No area is kept free of new reflectors."
    return f"{counted_text(count, 'area')} kept free; Draw area, then click in one, frees it again."
