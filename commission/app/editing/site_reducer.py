"""What editing actions mean for routes, vehicle and scanner. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from commission.app.base.actions import Sender
from commission.app.base.effects import FlyTo
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import actions
from commission.app.editing.editor import ControlPoint, Editor, Point, editor_of
from commission.app.editing.refusals import in_words_of_the_page
from commission.app.editing.route_gestures import route_of, routes_of, segment_of
from commission.errors import UsageError
from commission.site.editing import routes as edits
from commission.site.editing.named import ROUTES
from commission.site.fields import get_field, with_field
from commission.site.layout_brief import LayoutBrief
from commission.site.quantity import counted_text
from commission.site.routes import Route, Segment, route_named
from commission.site.scanner import Scanner

EQUIPMENT = {"vehicle": "vehicle", "scanners": "scanner", "tag_camera": "tag camera"}
"""Parts of a project that are equipment, and what each is called."""


def with_routes(
    state: AppState,
    routes: tuple[Route, ...],
    edit: Edit,
    point: ControlPoint | None,
    layout: LayoutBrief | None = None,
) -> Outcome:
    """Return what follows from other routes: one undo step, and `point` is selected.

    Parameters
    ----------
    state : before.
    routes : all of them, as edited.
    edit : what the step is called, and who made it.
    point : control point to select; none: nothing is selected.
    layout : wishes for a suggested layout that go with the routes; none: they stay.
    """
    project = replace(state.project, routes=routes, layout=layout or state.project.layout)
    after = edited(state, project, edit)
    browser = edit.sender.browser
    return Outcome(after.with_browser(browser, editor_of(after, browser).selecting(point=point)))


def _selected(state: AppState, sender: Sender) -> tuple[Editor, Route, Segment, ControlPoint]:
    """Return editor, route, segment and control point that a browser has selected; raises UsageError for none."""
    editor = editor_of(state, sender.browser)
    route, segment = route_of(state.project, editor), segment_of(state.project, editor)
    if route is None or segment is None or editor.point is None or editor.point.index >= len(segment.control_points):
        raise UsageError("no control point of a route is selected; expected one")
    return editor, route, segment, editor.point


@reduce.register
def select_control_point(action: actions.SelectControlPoint, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser).selecting(point=action.point)
    selecting = state.with_browser(sender.browser, editor)
    segment = segment_of(state.project, editor)
    if not action.fly or segment is None:
        return Outcome(selecting)
    x, y = segment.control_points[min(action.point.index, len(segment.control_points) - 1)]
    return Outcome(selecting, (FlyTo((float(x), float(y))),))


@reduce.register
def insert_control_point(_action: actions.InsertControlPoint, state: AppState, sender: Sender) -> Outcome:
    editor, route, segment, point = _selected(state, sender)
    near = _where(editor, segment, point)
    inserted = edits.insert_point(route, point.segment, near)
    gaps = np.hypot(*(inserted.segments[point.segment].control_points - near).T)
    edit = Edit(f"insert point in {route.name}", sender)
    nearest = replace(point, index=int(np.argmin(gaps)))
    return with_routes(state, ROUTES.put(state.project.routes, inserted, route.name), edit, nearest)


@reduce.register
def split_segment(_action: actions.SplitSegment, state: AppState, sender: Sender) -> Outcome:
    editor, route, segment, point = _selected(state, sender)
    cut = edits.split_segment(route, point.segment, _where(editor, segment, point))
    routes = ROUTES.put(state.project.routes, cut, route.name)
    behind = ControlPoint(route.name, point.segment + 1)
    return with_routes(state, routes, Edit(f"split {route.name}", sender), behind)


@reduce.register
def delete_control_point(_action: actions.DeleteControlPoint, state: AppState, sender: Sender) -> Outcome:
    _, route, _, point = _selected(state, sender)
    fewer = edits.delete_point(route, point.segment, point.index)
    edit = Edit(f"delete point of {route.name}", sender)
    before = replace(point, index=max(point.index - 1, 0))
    return with_routes(state, ROUTES.put(state.project.routes, fewer, route.name), edit, before)


@reduce.register
def place_control_point(action: actions.PlaceControlPoint, state: AppState, sender: Sender) -> Outcome:
    _, route, _, point = _selected(state, sender)
    bent = edits.move_point(route, point.segment, point.index, action.place)
    edit = Edit(f"move point of {route.name}", sender, "" if action.dragged else str(point))
    return with_routes(state, ROUTES.put(state.project.routes, bent, route.name), edit, point)


@reduce.register
def set_coordinate(action: actions.SetCoordinate, state: AppState, sender: Sender) -> Outcome:
    _, _, segment, point = _selected(state, sender)
    x, y = (float(value) for value in segment.control_points[point.index])
    return reduce(with_field(actions.PlaceControlPoint((x, y)), action.name, action.value), state, sender)


@reduce.register
def set_segment(action: actions.SetSegment, state: AppState, sender: Sender) -> Outcome:
    _, route, segment, point = _selected(state, sender)
    if action.value == (route.speed_of(segment) if action.name == "speed" else get_field(segment, action.name)):
        return Outcome(state)
    changed = edits.set_value(route, point.segment, action.name, action.value)
    edit = Edit(f"set {action.name} of {route.name}", sender, f"{route.name}:{point.segment}:{action.name}")
    return with_routes(state, ROUTES.put(state.project.routes, changed, route.name), edit, point)


@reduce.register
def set_route(action: actions.SetRoute, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser)
    route = route_named(state.project.routes, action.of) if action.of else _selected(state, sender)[1]
    if action.value == get_field(route, action.field, "field of a route"):
        return Outcome(state)
    changed = with_field(route, action.field, action.value, "field of a route")
    is_name = action.field == "name"
    what = f"rename {route.name}" if is_name else f"set {action.field} of {route.name}"
    edit = Edit(what, sender, "" if is_name else f"{route.name}:{action.field}")
    routes = ROUTES.put(state.project.routes, changed, route.name)
    layout = state.project.layout.renamed(route.name, changed.name) if is_name else None
    here = editor.point if editor.point is not None and editor.point.route == route.name else ControlPoint(route.name)
    return with_routes(state, routes, edit, replace(here, route=changed.name), layout)


@reduce.register
def delete_route(_action: actions.DeleteRoute, state: AppState, sender: Sender) -> Outcome:
    editor, route, _, _ = _selected(state, sender)
    gone, layout = routes_of(state.project, editor), state.project.layout
    routes = tuple(each for each in state.project.routes if each.name not in gone)
    for name in gone:
        layout = layout.renamed(name, None)
    what = route.name if len(gone) == 1 else counted_text(len(gone), "route")
    return with_routes(state, routes, Edit(f"delete {what}", sender), None, layout)


def _where(editor: Editor, segment: Segment, point: ControlPoint) -> Point:
    """Return where something is meant to happen on a curve: where it was clicked, else at the selected point."""
    if editor.last_click is not None:
        return editor.last_click
    x, y = segment.control_points[point.index]
    return float(x), float(y)


@reduce.register
def set_vehicle(action: actions.SetVehicle, state: AppState, sender: Sender) -> Outcome:
    if action.vehicle == state.project.vehicle:
        return Outcome(state)
    edit = Edit("change the vehicle", sender, "vehicle")
    return Outcome(edited(state, replace(state.project, vehicle=action.vehicle), edit))


@reduce.register
def set_scanner(action: actions.SetScanner, state: AppState, sender: Sender) -> Outcome:
    before = state.project.scanners
    scanners = tuple(action.scanner if each.name == action.scanner.name else each for each in before)
    if scanners == before:
        return Outcome(state)
    edit = Edit("change the scanner", sender, f"scanner {action.scanner.name}")
    return Outcome(edited(state, replace(state.project, scanners=scanners), edit))


@reduce.register
def set_scanner_field(action: actions.SetScannerField, state: AppState, sender: Sender) -> Outcome:
    names = [each.name for each in state.project.scanners]
    if action.of not in names:
        raise UsageError(f"no scanner is called {action.of!r}; the project has: {', '.join(map(repr, names))}")
    dotted = f"scanners[{names.index(action.of)}].{action.field}"
    return reduce(actions.SetEquipment(dotted, action.value), state, sender)


@reduce.register
def add_scanner(_action: actions.AddScanner, state: AppState, sender: Sender) -> Outcome:
    before = state.project.scanners
    taken = {each.name.casefold() for each in before}
    name = next(name for number in itertools.count(2) if (name := f"scanner {number}") not in taken)
    scanners = (*before, opposite(before[-1], name))
    return Outcome(edited(state, replace(state.project, scanners=scanners), Edit(f"add {name}", sender)))


@reduce.register
def remove_scanner(action: actions.RemoveScanner, state: AppState, sender: Sender) -> Outcome:
    scanners = tuple(each for each in state.project.scanners if each.name != action.name)
    if not scanners:
        raise UsageError(f"{action.name!r} is the only scanner; expected another one to stay")
    return Outcome(edited(state, replace(state.project, scanners=scanners), Edit(f"remove {action.name}", sender)))


def opposite(scanner: Scanner, name: str) -> Scanner:
    """Return a scanner like another on the opposite corner of the vehicle, facing the other way."""
    x, y, heading = scanner.mounting.tolist()
    turned = heading - math.pi if heading > 0.0 else heading + math.pi
    return replace(scanner, name=name, mounting=np.array([-x, -y, turned]))


@reduce.register
def set_equipment(action: actions.SetEquipment, state: AppState, sender: Sender) -> Outcome:
    part = action.name.partition(".")[0]
    kind = EQUIPMENT.get(part.partition("[")[0])
    if kind is None:
        raise UsageError(f"no equipment is called {action.name!r}; expected one of {' or '.join(EQUIPMENT)}")
    try:
        project = with_field(state.project, action.name, action.value)
    except ValueError as error:
        raise ValueError(in_words_of_the_page(str(error))) from error
    if get_field(project, part) == get_field(state.project, part):
        return Outcome(state)
    return Outcome(edited(state, project, Edit(f"change the {kind}", sender, action.name)))
