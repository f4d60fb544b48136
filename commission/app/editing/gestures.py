"""What a click or a drag on the floor hits, and where it puts things. Pure: from project and editor to new values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.app.editing.editor import Drag, Editor, Grab, Point
from commission.app.editing.posed_gestures import grabbed_of, posed_at
from commission.app.editing.posed_kinds import mark_of
from commission.app.editing.route_gestures import control_point_at
from commission.geometry import se2
from commission.geometry.occupancy import OccupancyGrid
from commission.site.editing import reflectors as edits
from commission.site.editing.snapping import align, nearest_corner, nearest_wall, on_wall, to_grid
from commission.site.floor_map import OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

FIRST = Reflector(id="R0", x=0.0, y=0.0)
"""What the first reflector of a map is like; its id is counted on from."""
WALL_REACH = (0.05, 1.0)
"""Smallest and largest distance at which a wall attracts [m]: within them, twice a click's reach."""


def reflector_at(reflectors: ReflectorMap, place: Point, reach: float) -> str | None:
    """Return the id of the nearest reflector whose edge is within reach [m] of a place; none when there is none.

    Parameters
    ----------
    reflectors : all of them.
    place : (2,) point [m], map frame.
    reach : largest distance to its edge [m].
    """
    if not len(reflectors):
        return None
    gaps = np.hypot(*(reflectors.centers - place).T) - reflectors.radii
    nearest = int(np.argmin(gaps))
    return reflectors.reflectors[nearest].id if gaps[nearest] <= reach else None


def reflectors_in(reflectors: ReflectorMap, corner: Point, opposite: Point) -> tuple[str, ...]:
    """Return the ids of the reflectors whose centers lie in an upright rectangle [m].

    Parameters
    ----------
    reflectors : all of them.
    corner, opposite : two corners [m], map frame.
    """
    low, high = np.minimum(corner, opposite), np.maximum(corner, opposite)
    inside = np.all((reflectors.centers >= low) & (reflectors.centers <= high), axis=1)
    return tuple(r.id for r, chosen in zip(reflectors.reflectors, inside, strict=True) if chosen)


def walls_near(floor_map: FloorMap, place: Point, reach: float) -> OccupancyGrid | None:
    """Return the part of the walls around a place that snapping looks at; none when the place is far outside.

    Parameters
    ----------
    floor_map : the whole map.
    place : point [m], map frame.
    reach : how far from it snapping looks [m].
    """
    column, row = (
        int(value)
        for value in np.floor(
            se2.transform_points(se2.inverse(floor_map.origin), np.asarray(place, dtype=np.float64))
            / floor_map.resolution
        )
    )
    cells = int(np.ceil((reach + 1.0) / floor_map.resolution)) + 3
    rows, columns = floor_map.cells.shape
    bottom, top = max(row - cells, 0), min(row + cells + 1, rows)
    left, right = max(column - cells, 0), min(column + cells + 1, columns)
    if bottom >= top or left >= right:
        return None
    corner = np.array([left * floor_map.resolution, bottom * floor_map.resolution, 0.0])
    return OccupancyGrid(
        floor_map.cells[bottom:top, left:right] == OCCUPIED,
        floor_map.resolution,
        se2.compose(floor_map.origin, corner),
    )


def corner_at(project: Project, place: Point, reach: float) -> Point | None:
    """Return the nearest corner of a wall within reach [m] of a place; none when there is none.

    Parameters
    ----------
    project : has the floor map.
    place : point [m], map frame.
    reach : largest distance [m].
    """
    grid = None if project.floor_map is None else walls_near(project.floor_map, place, reach)
    corner = None if grid is None else nearest_corner(grid, place, reach)
    return None if corner is None else (float(corner[0]), float(corner[1]))


def marked_place(project: Project, place: Point, reach: float) -> Point:
    """Return the point that a click means: a reflector's center, a station, a tag, a wall's corner, else the place.

    Parameters
    ----------
    project : what there is to click on.
    place : that was clicked [m], map frame.
    reach : largest distance of what it means [m].
    """
    found = reflector_at(project.reflectors, place, reach)
    if found is not None:
        hit = next(r for r in project.reflectors.reflectors if r.id == found)
        return hit.x, hit.y
    mark = mark_of(project, posed_at(project, place, reach))
    if mark is not None:
        return mark.x, mark.y
    return corner_at(project, place, reach) or place


def snapped(project: Project, reflector: Reflector, editor: Editor, ignored: tuple[str, ...] = ()) -> Reflector:
    """Put a reflector where it is attracted to: a wall first, then its neighbors' rows and columns, then the grid.

    Parameters
    ----------
    project : has the walls and the neighbors.
    reflector : as it was put.
    editor : what snaps, and how far a click reaches.
    ignored : ids of reflectors that move along, and attract nothing.
    """
    place = (reflector.x, reflector.y)
    snapping = editor.snapping
    if snapping.walls and project.floor_map is not None:
        reach = float(np.clip(2.0 * editor.reach, *WALL_REACH))
        grid = walls_near(project.floor_map, place, reach)
        wall = None if grid is None else nearest_wall(grid, place, reach)
        if wall is not None:
            return on_wall(reflector, wall)
    if snapping.neighbors:
        aligned = align(project.reflectors, place, editor.reach, ignored)
        if aligned.x_of is not None or aligned.y_of is not None:
            return replace(reflector, x=aligned.x, y=aligned.y)
    if snapping.grid > 0.0:
        x, y = to_grid(place, snapping.grid)
        return replace(reflector, x=float(x), y=float(y))
    return reflector


def to_place(project: Project, place: Point, editor: Editor) -> Reflector:
    """Return the reflector that a click places; its id is still that of the one it is like.

    Parameters
    ----------
    project : its last reflector is the one that the new one is like.
    place : that was clicked [m], map frame.
    editor : what snaps.
    """
    last = project.reflectors.reflectors[-1] if len(project.reflectors) else FIRST
    like = replace(last, x=place[0], y=place[1], note="", sigma=0.0, locked=False)
    return snapped(project, like, editor)


def selected_of(project: Project, editor: Editor) -> tuple[Reflector, ...]:
    """Return the selected reflectors that still exist, in the order of the map."""
    chosen = frozenset(editor.selected)
    return tuple(r for r in project.reflectors.reflectors if r.id in chosen) if chosen else ()


def moved(project: Project, editor: Editor) -> ReflectorMap:
    """Return the reflector map as the drag under way would leave it: one reflector snaps, several keep their places.

    Without a drag of reflectors it is the map as it is.
    """
    drag = editor.drag
    movable = [r for r in selected_of(project, editor) if not r.locked]
    if drag is None or drag.grab is not Grab.REFLECTORS or not movable:
        return project.reflectors
    dx, dy = drag.offset
    if len(movable) > 1:
        return edits.move(project.reflectors, [r.id for r in movable], (dx, dy))
    only = movable[0]
    target = snapped(project, replace(only, x=only.x + dx, y=only.y + dy), editor, (only.id,))
    placed = edits.place(project.reflectors, {only.id: (target.x, target.y)})
    if only.kind is ReflectorKind.FLAT and target.heading != only.heading:
        return edits.set_value(placed, [only.id], "heading", target.heading)
    return placed


def grabbed(project: Project, editor: Editor, drag: Drag) -> Editor:
    """Return the editor with a drag begun: on something selected, a reflector, a station, a tag, or the floor.

    Parameters
    ----------
    project : what there is to take hold of.
    editor : what is selected, and how far a click reaches.
    drag : from its start to where it is now [m], map frame.
    """
    reach = editor.reach
    grab = grabbed_of(project, mark_of(project, editor.posed), drag.start, reach)
    if grab is not None:
        return replace(editor, drag=replace(drag, grab=grab))
    point = None if editor.point is None else control_point_at(project, editor.point.route, drag.start, reach)
    if point is not None:
        return replace(editor, point=point, drag=replace(drag, grab=Grab.CONTROL_POINT))
    found = reflector_at(project.reflectors, drag.start, reach)
    if found is not None:
        selected = editor.selected if found in editor.selected else (found,)
        return replace(editor.selecting(selected), drag=replace(drag, grab=Grab.REFLECTORS))
    posed = posed_at(project, drag.start, reach)
    if posed is not None:
        return replace(editor.selecting(posed=posed), drag=replace(drag, grab=Grab.POSED))
    return replace(editor, drag=replace(drag, grab=Grab.RECTANGLE))
