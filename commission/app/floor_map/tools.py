"""What clicks and drags mean for the floor map: areas erased and filled, walls drawn, points to align by. Pure."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from commission.app.base.actions import Camera, ClickFloor, DragFloor, Sender
from commission.app.base.effects import PlaceCamera, Tell
from commission.app.base.reducer import Outcome
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing.editor import (
    MAP_TOOLS,
    AlignmentDraft,
    Drag,
    Editor,
    Grab,
    NamedPoint,
    Point,
    Tool,
    editor_of,
)
from commission.app.editing.gestures import marked_place
from commission.app.floor_map.draft import MapLoading
from commission.app.run.state import RunState
from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.site.editing.alignment import DOUBTFUL, Alignment, KnownPoint, align, aligned
from commission.site.editing.floor_map import draw_obstacle, draw_wall, fill
from commission.site.floor_map import FREE, UNKNOWN, FloorMap

TOOLS = (*MAP_TOOLS, Tool.CALIBRATE)
"""Tools whose clicks mean something here."""
AREA_TOOLS = (Tool.ERASE, Tool.OBSTACLE)
"""Tools that take a rectangle by a drag as well as a polygon by clicks."""
NAMES = {Tool.ERASE: "erase", Tool.OBSTACLE: "draw obstacle", Tool.WALL: "draw wall"}
"""What an edit is called."""
FEWEST = {Tool.ERASE: 3, Tool.OBSTACLE: 3, Tool.WALL: 2}
"""Points that a shape needs."""


def clicked(state: AppState, editor: Editor, action: ClickFloor, sender: Sender) -> Outcome:
    """Return what follows from a click with one of the floor map's tools."""
    match editor.tool:
        case Tool.ALIGN:
            place = marked_place(state.project, action.place, editor.reach)
            editor = replace(editor, alignment=with_point(editor.alignment, place))
        case Tool.CALIBRATE:
            draft = state.part(MapLoading).draft
            if draft is None:
                return Outcome(state.with_browser(sender.browser, replace(editor, tool=Tool.SELECT)))
            state = state.with_part(replace(state.part(MapLoading), draft=draft.clicked(action.place)))
        case _:
            editor = replace(editor, draft=(*editor.draft, action.place))
    return Outcome(state.with_browser(sender.browser, editor))


def dragged(state: AppState, editor: Editor, action: DragFloor, sender: Sender) -> Outcome:
    """Return what follows from a drag: a rectangle grows, and is erased or filled when it ends."""
    if action.phase != "end":
        drag = Drag(Grab.RECTANGLE, action.start, action.now)
        return Outcome(state.with_browser(sender.browser, replace(editor, drag=drag, reach=action.reach)))
    resting = state.with_browser(sender.browser, replace(editor, drag=None))
    (x0, y0), (x1, y1) = action.start, action.now
    if x0 == x1 or y0 == y1:
        return Outcome(resting)
    return drawn(resting, sender, ((x0, y0), (x1, y0), (x1, y1), (x0, y1)))


def drawn(state: AppState, sender: Sender, points: tuple[Point, ...]) -> Outcome:
    """Return what follows from a finished shape: one undo step. The tool stays, for the next one."""
    editor = editor_of(state, sender.browser)
    resting = state.with_browser(sender.browser, replace(editor, draft=()))
    before, corners = state.project.floor_map, np.array(points, dtype=np.float64).reshape(-1, 2)
    after = _with_shape(before, editor, corners)
    if after is before:
        return Outcome(resting, (Tell(f"nothing to {NAMES[editor.tool]} there", failed=False),))
    project = replace(state.project, floor_map=after)
    return Outcome(edited(resting, project, Edit(NAMES[editor.tool], sender)))


def _with_shape(floor_map: FloorMap | None, editor: Editor, corners: FloatArray) -> FloorMap:
    match editor.tool:
        case Tool.WALL:
            return draw_wall(floor_map, corners, editor.pen.thickness)
        case Tool.OBSTACLE:
            return draw_obstacle(floor_map, corners)
        case Tool.ERASE if floor_map is not None:
            return fill(floor_map, corners, UNKNOWN if editor.pen.to_unknown else FREE)
        case Tool.ERASE:
            raise UsageError("the project has no floor map to erase in; expected one")
        case _:
            raise UsageError(f"the tool {editor.tool} draws no shape; expected Erase, Wall or Obstacle")


def finished(state: AppState, sender: Sender) -> Outcome:
    """Return what follows from Enter: the shape of the points clicked so far."""
    editor = editor_of(state, sender.browser)
    if editor.tool not in FEWEST:
        return Outcome(state)
    if len(set(editor.draft)) < FEWEST[editor.tool]:
        wanted, found = FEWEST[editor.tool], len(set(editor.draft))
        raise UsageError(f"{found} points were clicked; expected {wanted} or more to {NAMES[editor.tool]}")
    return drawn(state, sender, editor.draft)


def with_point(alignment: AlignmentDraft, place: Point) -> AlignmentDraft:
    """Return the points after a click: A, then B, then the nearer one is moved and keeps what was typed for it."""
    points = alignment.points
    if len(points) < 2:
        return replace(alignment, points=(*points, NamedPoint(place, place)))
    nearer = min((0, 1), key=lambda index: math.dist(points[index].at, place))
    old = points[nearer]
    new = replace(old, at=place, plant=place if old.plant == old.at else old.plant)
    return replace(alignment, points=tuple(new if point is old else point for point in points))


def alignment_of(draft: AlignmentDraft) -> Alignment | None:
    """Return how the points move the map; none before there are two that say so."""
    if len(draft.points) < 2:
        return None
    try:
        a, b = (KnownPoint(point.at, point.plant) for point in draft.points)
        return align(a, b)
    except UsageError:
        return None


def align_map(state: AppState, sender: Sender) -> Outcome:
    """Return what follows from moving and turning the map: one undo step, and everybody sees it whole."""
    editor = editor_of(state, sender.browser)
    draft = editor.alignment
    if len(draft.points) < 2:
        raise UsageError(f"{len(draft.points)} points were clicked; expected A and B")
    a, b = (KnownPoint(point.at, point.plant) for point in draft.points)
    found = align(a, b)
    project = aligned(state.project, found, everything=draft.everything)
    names = " and ".join(point.name or letter for letter, point in zip("AB", draft.points, strict=True))
    resting = state.with_browser(sender.browser, replace(editor, tool=Tool.SELECT, alignment=AlignmentDraft()))
    after = edited(resting, project, Edit(f"align to {names}", sender))
    told = f"aligned to {names}, each {abs(500.0 * found.residual):.0f} mm off"
    if found.share > DOUBTFUL:
        told += f"; that is {100.0 * found.share:.1f} % of their distance: look at the points and their numbers"
    if draft.everything and state.part(RunState).source is not None:
        told += "; what drives does so in the old coordinates: start it again"
    told_them = Tell(told, failed=found.share > DOUBTFUL)
    return Outcome(after, (told_them, PlaceCamera(Camera.FIT, everywhere=True)))
