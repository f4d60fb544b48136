"""What editing actions mean for routes, vehicle and scanner. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.app.base.reduction import ApplyParameters, FlyTo, Reduction, Tell, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import actions
from commission.app.editing.editor import ControlPoint, Editor, Point, Tool
from commission.app.editing.reducer import editor_of
from commission.app.editing.route_gestures import control_point_at, route_of, segment_of
from commission.errors import UsageError
from commission.site.editing import routes as edits
from commission.site.layout_brief import LayoutBrief
from commission.site.routes import Route, Segment
from commission.studies.problems import Subject


def _with_routes(
    state: AppState,
    routes: tuple[Route, ...],
    edit: Edit,
    point: ControlPoint | None,
    layout: LayoutBrief | None = None,
) -> Reduction:
    """Return what follows from other routes: one undo step, and `point` is selected."""
    client = edit.client
    project = replace(state.project, routes=routes, layout=layout or state.project.layout)
    after = edited(state, project, edit)
    if client is not None:
        after = after.with_editor(client, editor_of(after, client).selecting(point=point))
    return Reduction(after)


def _selected(state: AppState, client: int) -> tuple[Editor, Route, Segment, ControlPoint]:
    """Return editor, route, segment and control point that a browser has selected; raises UsageError for none."""
    editor = editor_of(state, client)
    route, segment = route_of(state.project, editor), segment_of(state.project, editor)
    if route is None or segment is None or editor.point is None or editor.point.index >= len(segment.control_points):
        raise UsageError("no control point of a route is selected; expected one")
    return editor, route, segment, editor.point


@reduce.register
def _(action: actions.FinishRoute, state: AppState) -> Reduction:
    editor = editor_of(state, action.client)
    name = edits.fresh_name(state.project.routes)
    route = edits.new_route(name, editor.draft)
    done = state.with_editor(action.client, replace(editor, draft=(), tool=Tool.SELECT))
    routes = edits.put(state.project.routes, route)
    return _with_routes(done, routes, Edit(f"draw {name}", action.client), ControlPoint(name))


@reduce.register
def _(action: actions.SelectControlPoint, state: AppState) -> Reduction:
    editor = editor_of(state, action.client).selecting(point=action.point)
    selecting = state.with_editor(action.client, editor)
    segment = segment_of(state.project, editor)
    if not action.fly or segment is None:
        return Reduction(selecting)
    x, y = segment.control_points[min(action.point.index, len(segment.control_points) - 1)]
    return Reduction(selecting, (FlyTo(action.client, (float(x), float(y))),))


@reduce.register
def _(action: actions.InsertControlPoint, state: AppState) -> Reduction:
    editor, route, segment, point = _selected(state, action.client)
    near = _where(editor, segment, point)
    inserted = edits.insert_point(route, point.segment, near)
    gaps = np.hypot(*(inserted.segments[point.segment].control_points - near).T)
    edit = Edit(f"insert point in {route.name}", action.client)
    nearest = replace(point, index=int(np.argmin(gaps)))
    return _with_routes(state, edits.put(state.project.routes, inserted, route.name), edit, nearest)


@reduce.register
def _(action: actions.SplitSegment, state: AppState) -> Reduction:
    editor, route, segment, point = _selected(state, action.client)
    cut = edits.split_segment(route, point.segment, _where(editor, segment, point))
    routes = edits.put(state.project.routes, cut, route.name)
    behind = ControlPoint(route.name, point.segment + 1)
    return _with_routes(state, routes, Edit(f"split {route.name}", action.client), behind)


@reduce.register
def _(action: actions.DeleteControlPoint, state: AppState) -> Reduction:
    _, route, _, point = _selected(state, action.client)
    fewer = edits.delete_point(route, point.segment, point.index)
    edit = Edit(f"delete point of {route.name}", action.client)
    before = replace(point, index=max(point.index - 1, 0))
    return _with_routes(state, edits.put(state.project.routes, fewer, route.name), edit, before)


@reduce.register
def _(action: actions.PlaceControlPoint, state: AppState) -> Reduction:
    _, route, _, point = _selected(state, action.client)
    bent = edits.move_point(route, point.segment, point.index, action.place)
    key = f"{action.client}:{point}" if action.at else ""
    edit = Edit(f"move point of {route.name}", action.client, key, action.at)
    return _with_routes(state, edits.put(state.project.routes, bent, route.name), edit, point)


@reduce.register
def _(action: actions.SetSegment, state: AppState) -> Reduction:
    _, route, segment, point = _selected(state, action.client)
    if (action.direction, action.speed) == (segment.direction, route.speed_of(segment)):
        return Reduction(state)
    changed = edits.set_direction(route, point.segment, action.direction)
    changed = edits.set_speed(changed, point.segment, action.speed)
    edit = Edit(f"set drive of {route.name}", action.client, f"{action.client}:{point.segment}:drive", action.at)
    return _with_routes(state, edits.put(state.project.routes, changed, route.name), edit, point)


@reduce.register
def _(action: actions.RenameRoute, state: AppState) -> Reduction:
    _, route, _, point = _selected(state, action.client)
    if action.name == route.name:
        return Reduction(state)
    routes = edits.put(state.project.routes, replace(route, name=action.name), route.name)
    edit = Edit(f"rename {route.name}", action.client)
    layout = state.project.layout.renamed(route.name, action.name)
    return _with_routes(state, routes, edit, replace(point, route=action.name), layout)


@reduce.register
def _(action: actions.DeleteRoute, state: AppState) -> Reduction:
    _, route, _, _ = _selected(state, action.client)
    routes = edits.remove(state.project.routes, route.name)
    layout = state.project.layout.renamed(route.name, None)
    return _with_routes(state, routes, Edit(f"delete {route.name}", action.client), None, layout)


def _where(editor: Editor, segment: Segment, point: ControlPoint) -> Point:
    """Return where something is meant to happen on a curve: where it was clicked, else at the selected point."""
    if editor.last_click is not None:
        return editor.last_click
    x, y = segment.control_points[point.index]
    return float(x), float(y)


@reduce.register
def _(action: actions.SetVehicle, state: AppState) -> Reduction:
    if action.vehicle == state.project.vehicle:
        return Reduction(state)
    edit = Edit("change the vehicle", action.client, "vehicle", action.at)
    return Reduction(edited(state, replace(state.project, vehicle=action.vehicle), edit), (ApplyParameters(),))


@reduce.register
def _(action: actions.SetScanner, state: AppState) -> Reduction:
    if action.scanner == state.project.scanner:
        return Reduction(state)
    edit = Edit("change the scanner", action.client, "scanner", action.at)
    return Reduction(edited(state, replace(state.project, scanner=action.scanner), edit), (ApplyParameters(),))


@reduce.register
def _(action: actions.ShowProblem, state: AppState) -> Reduction:
    problem = action.problem
    editor = replace(editor_of(state, action.client), tool=Tool.SELECT).selecting()
    if problem.subject is Subject.REFLECTOR:
        editor = editor.selecting(problem.ids)
    elif problem.subject is Subject.STATION and problem.ids:
        editor = editor.selecting(station=problem.ids[0])
    elif problem.subject is Subject.ROUTE and problem.ids:
        near = problem.place or (0.0, 0.0)
        editor = editor.selecting(point=control_point_at(state.project, problem.ids[0], near, float("inf")))
    there = () if problem.place is None else (FlyTo(action.client, problem.place),)
    return Reduction(state.with_editor(action.client, editor), there)


@reduce.register
def _(action: actions.Restored, state: AppState) -> Reduction:
    restored = edited(replace(state, greeting=action.text), action.project, Edit("restore unsaved edits"))
    return Reduction(restored, (Tell(action.text, failed=False),))
