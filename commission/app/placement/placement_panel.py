"""The step Plan, last part: demands, a suggested layout, and whether it is accepted."""

from __future__ import annotations

import math
from typing import Any

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.actions import Action, LookAt
from commission.app.base.inputs import Inputs, Text, WorkBar, show
from commission.app.base.panel import BasePanel, Post, escaped, posting, table
from commission.app.base.rows import Rows
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing.actions import ChooseTool
from commission.app.placement.actions import AcceptLayout, AskLayout, CountRoute, DiscardLayout, FreeAreas, SetLayout
from commission.app.placement.keep_out_tool import KeepOutTool
from commission.app.placement.service import LAYOUT
from commission.app.placement.view import LayoutView
from commission.app.placement.wish import LayoutWish
from commission.studies.placement import PlacementResult

DEG, MM = math.degrees(1.0), 1000.0
POSITION, HEADING = "demands.position_limit", "demands.heading_limit"
MOST_UNMET = 12
REASONS = {"visible": "too few visible", "uncertainty": "2σ over its limit", "ambiguous": "place not told apart"}
DRAW, CLEAR = "Draw area", "Clear areas"


def option_of(state: AppState, name: str) -> Any:
    """Return an option of the suggested layout by its name; a limit that is not set is the supervisor's."""
    group, _, inner = name.rpartition(".")
    value: Any = (
        getattr(getattr(state.project.layout, group), inner) if group else getattr(state.part(LayoutWish), name)
    )
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
        self._work = WorkBar(gui, post, LAYOUT, DiscardLayout())
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
        gui, inputs = self._gui, self._inputs
        hint = "Whether the reflectors that are there stay; if not, only the locked ones do."
        inputs.switch("extend", "Keep present", hint)
        hint = "Reflectors that every scan on the routes must see."
        inputs.count("demands.visible", gui.add_number("Visible, at least", 2, min=1, max=20, step=1, hint=hint))
        hint = "Whether all demands must hold as well with any single reflector blocked."
        inputs.switch("demands.survive_failure", "One may fail", hint)
        hint = "Largest 2-sigma of x and of y on the routes; the supervisor's limit unless changed here."
        limit = gui.add_number("2σ x, y [mm]", 100.0, min=1, max=10_000, step=1, hint=hint)
        inputs.number(POSITION, MM, limit)
        hint = "Largest 2-sigma of the heading on the routes; the supervisor's limit unless changed here."
        inputs.number(HEADING, DEG, gui.add_number("2σ heading [°]", 1.0, min=0.01, max=90, step=0.01, hint=hint))
        hint = "Whether a vehicle that is switched on at the start of a route must see which place it is."
        inputs.switch("demands.unambiguous_starts", "Unique starts", hint)
        hint = "Whether a vehicle that is switched on at a station must see which place it is."
        inputs.switch("demands.unambiguous_stations", "Unique stations", hint)

    def _add_candidates(self) -> None:
        gui, inputs = self._gui, self._inputs
        hint = "Smallest distance between two reflectors."
        inputs.number("demands.spacing", 1.0, gui.add_number("Apart [m]", 0.5, min=0, max=100, step=0.05, hint=hint))
        hint = "Distance along the walls between the places that are tried: finer finds fewer and takes longer."
        tried = gui.add_number("Try every [m]", 1.0, min=0.1, max=20, step=0.1, hint=hint)
        inputs.number("candidates.spacing", 1.0, tried)
        hint = "Radius of the reflectors to be put up."
        radius = gui.add_number("Radius [mm]", 40.0, min=5, max=500, step=1, hint=hint)
        inputs.number("candidates.radius", MM, radius)
        hint = "Height of their middle above the floor: the scanner's."
        inputs.number("candidates.height", 1.0, gui.add_number("Height [m]", 0.2, min=0, max=10, step=0.01, hint=hint))
        hint = "Distance left between a reflector and the vehicle on its routes."
        clear = gui.add_number("Clear of routes [m]", 0.3, min=0, max=10, step=0.05, hint=hint)
        inputs.number("candidates.clearance", 1.0, clear)
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
        self._ask.disabled = self._work.follow(view)
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
    if placement.added == 0 and not suggestion.unmet:
        notes = ["The present reflectors meet all demands."]
    if suggestion.unmet:
        shown = min(len(suggestion.unmet), MOST_UNMET)
        more = f", the first {shown} listed" if shown < len(suggestion.unmet) else ""
        notes.append(f"Not met on {len(suggestion.unmet)} stretches{more}; a click goes there.")
    if found.outdated:
        notes.append("The site has changed since: suggest again.")
    elif found.wished_otherwise:
        notes.append("The demands have changed since: suggest again.")
    notes_html = "".join(f"<div class='c-note'>{escaped(note)}</div>" for note in notes)
    return f"<div class='c-layout' style='padding:2px 10px 4px 6px'>{table(rows)}{notes_html}</div>"


def _unmet_lines(suggestion: PlacementResult) -> list[tuple[str, theme.Color]]:
    return [
        (f"{each.route}, {each.first} to {each.last} m: {REASONS.get(each.reason, each.reason)}", theme.WARNING_LINE)
        for each in suggestion.unmet[:MOST_UNMET]
    ]


def _areas_text(count: int) -> str:
    if not count:
        return "No area is kept free of new reflectors."
    return f"{count} area{'s' if count > 1 else ''} kept free; Draw area, then click in one, frees it again."
