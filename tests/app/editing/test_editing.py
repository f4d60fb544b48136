"""What editing on the page means, without a browser: clicks and drags become edits of the project."""

from pathlib import Path

import numpy as np
import pytest

from commission.app.base import actions as page
from commission.app.base.actions import ClickFloor, DragFloor, Envelope, Leave
from commission.app.base.effects import FlyTo, Tell
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.app.editing.editor import ControlPoint, Editor
from commission.app.editing.site_tools import MeasureTool, PlaceTool, RouteTool, StationTool, measurement
from commission.app.editing.tool import Tool
from commission.errors import UsageError
from commission.site.reflectors import Reflector
from commission.site.routes import Direction
from tests.app.asking import ME, OTHER, after, by, joined
from tests.app.sites import room

REACH = 0.15
PLACE = PlaceTool()
RADIUS = 0.04


@pytest.fixture
def state() -> AppState:
    project = room()
    return joined(AppState(project=project, saved=project, folder=Path("hall")))


def click(x: float, y: float, *, add: bool = False, browser: int = ME) -> Envelope:
    return by(browser, ClickFloor((x, y), REACH, add))


def drag(start: tuple[float, float], end: tuple[float, float], *, add: bool = False) -> tuple[DragFloor, ...]:
    half = (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]))
    steps = (("start", start), ("update", half), ("end", end))
    return tuple(DragFloor(phase=phase, start=start, now=now, reach=REACH, add=add) for phase, now in steps)


def place(tool: Tool = PLACE, browser: int = ME) -> Envelope:
    return by(browser, actions.ChooseTool(tool))


def reflector(state: AppState, name: str) -> Reflector:
    return next(r for r in state.project.reflectors.reflectors if r.id == name)


def editor(state: AppState, browser: int = ME) -> Editor:
    return state.of_browser(browser, Editor)


def test_a_click_near_a_wall_places_a_reflector_that_touches_it(state: AppState) -> None:
    result = after(state, place(), click(4.0, 0.3))
    new = reflector(result.state, "R5")
    # The wall is 3 cells of 50 mm thick.
    assert (new.x, new.y) == pytest.approx((4.0, 0.15 + RADIUS))
    assert editor(result.state).selected == ("R5",)
    assert result.effects == ()
    assert result.state.undo[-1].name == "place R5"


def test_without_snapping_a_reflector_stands_where_it_was_clicked(state: AppState) -> None:
    freely = actions.SetSnapping("walls", False)
    new = reflector(after(state, freely, place(), click(4.0, 0.3)).state, "R5")
    assert (new.x, new.y) == (4.0, 0.3)


def test_a_grid_and_the_rows_of_neighbors_attract_when_they_are_asked_to(state: AppState) -> None:
    freely = after(state, actions.SetSnapping("walls", False)).state
    on_grid = actions.SetSnapping("grid", 0.5)
    assert reflector(after(freely, on_grid, place(), click(4.1, 3.2)).state, "R5").x == 4.0
    in_line = actions.SetSnapping("neighbors", True)
    new = reflector(after(freely, in_line, place(), click(4.1, 2.1)).state, "R5")
    assert (new.x, new.y) == (4.1, 2.0)


def test_clicks_select_and_shift_clicks_add_or_take_away(state: AppState) -> None:
    assert editor(after(state, click(0.3, 2.0)).state).selected == ("R1",)
    both = after(state, click(0.3, 2.0), click(0.2, 6.5, add=True)).state
    assert editor(both).selected == ("R1", "R2")
    assert editor(after(both, click(0.3, 2.0, add=True)).state).selected == ("R2",)
    assert editor(after(both, click(6.0, 6.0)).state).selected == ()


def test_a_drag_over_the_floor_selects_what_lies_inside(state: AppState) -> None:
    left = after(state, *drag((0.2, 7.0), (2.0, 1.0))).state
    assert editor(left).selected == ("R1", "R2")
    assert editor(after(left, *drag((11.0, 1.0), (11.9, 2.0), add=True)).state).selected == ("R1", "R2", "R3")
    assert left.undo == ()


def test_a_drag_is_one_undo_step_and_changes_nothing_before_it_ends(state: AppState) -> None:
    begin, on, end = drag((0.25, 2.0), (3.0, 4.0))
    before = after(state, begin, on).state
    assert before.project is state.project
    moved = after(before, end).state
    assert (reflector(moved, "R1").x, reflector(moved, "R1").y) == pytest.approx((3.0, 4.0))
    assert [step.name for step in moved.undo] == ["move R1"]
    assert after(moved, page.Undo()).state.project is state.project
    assert after(moved, page.Undo(), page.Redo()).state.project is moved.project


def test_a_single_dragged_reflector_snaps_and_several_keep_their_places_to_each_other(state: AppState) -> None:
    alone = after(state, *drag((0.25, 2.0), (0.3, 4.0))).state
    assert reflector(alone, "R1").x == pytest.approx(0.15 + RADIUS)
    together = after(state, click(0.25, 2.0), click(0.25, 6.5, add=True), *drag((0.25, 2.0), (1.25, 2.5))).state
    moved = together.project.reflectors.centers - state.project.reflectors.centers
    np.testing.assert_allclose(moved, [[1.0, 0.5], [1.0, 0.5], [0.0, 0.0], [0.0, 0.0]], atol=1e-12)
    assert together.undo[-1].name == "move 2 reflectors"


def test_the_handle_moves_the_selection_by_as_much_as_itself(state: AppState) -> None:
    begin = after(state, click(0.25, 2.0), actions.SetSnapping("walls", False))
    now = (3.0, 3.0)
    moved = after(begin.state, actions.DragSelection("start", (0.25, 2.0)), actions.DragSelection("end", now))
    assert (reflector(moved.state, "R1").x, reflector(moved.state, "R1").y) == pytest.approx(now)


def test_the_handle_stands_in_the_middle_of_what_moves_with_it(state: AppState) -> None:
    # Of R1 (0.25, 2), R2 (0.25, 6.5) and R3 (11.75, 1.5) the second is locked: the middle of the others is (6, 1.75).
    locked = after(state, click(0.25, 6.5), actions.SetSelected("locked", True)).state
    three = after(locked, click(0.25, 2.0), click(0.25, 6.5, add=True), click(11.75, 1.5, add=True)).state
    assert editor(three).selected == ("R1", "R2", "R3")
    moved = after(three, actions.DragSelection("start", (6.0, 1.75)), actions.DragSelection("end", (6.5, 2.5))).state
    places = [(r.x, r.y) for r in moved.project.reflectors.reflectors]
    assert places == [pytest.approx(p) for p in ((0.75, 2.75), (0.25, 6.5), (12.25, 2.25), (11.75, 5.5))]


def test_what_is_locked_stays_and_the_page_says_so(state: AppState) -> None:
    locked = after(state, click(0.25, 2.0), actions.SetSelected("locked", True)).state
    result = after(locked, actions.DeleteSelected())
    assert result.state.project is locked.project
    assert result.effects == (Tell("locked and left as they are: R1", failed=False),)
    assert after(locked, *drag((0.25, 2.0), (3.0, 4.0))).state.project is locked.project


def test_delete_duplicate_mirror_and_repeat_are_one_step_each(state: AppState) -> None:
    chosen = after(state, click(0.25, 2.0)).state
    assert len(after(chosen, actions.DeleteSelected()).state.project.reflectors) == 3
    twice = after(chosen, actions.DuplicateSelected()).state
    assert editor(twice).selected == ("R5",)
    mirrored = after(chosen, actions.MirrorSelected((6.0, 0.0), np.pi / 2, copy=True)).state
    assert reflector(mirrored, "R5").x == pytest.approx(11.75)
    row = after(chosen, actions.RepeatSelected((0.0, 1.0), 3)).state
    assert [r.y for r in row.project.reflectors.reflectors[4:]] == pytest.approx([3.0, 4.0, 5.0])
    assert all(len(s.undo) == 1 for s in (twice, mirrored, row))


def test_typed_values_are_set_exactly_and_typing_is_one_step(state: AppState) -> None:
    typed = [by(ME, actions.SetSelected("x", x), 0.2 * k) for k, x in enumerate((1.0, 1.2, 1.234))]
    result = after(state, click(0.25, 2.0), *typed).state
    assert reflector(result, "R1").x == 1.234
    assert len(result.undo) == 1
    renamed = after(result, actions.SetSelected("id", "North 7")).state
    assert editor(renamed).selected == ("North 7",)
    with pytest.raises(ValueError, match="expected more than 0"):
        after(state, click(0.25, 2.0), actions.SetSelected("radius", 0.0))


def test_editing_nothing_is_refused_with_what_is_expected(state: AppState) -> None:
    with pytest.raises(UsageError, match="no reflector is selected"):
        after(state, actions.DeleteSelected())


def test_each_browser_has_its_own_selection_and_tool(state: AppState) -> None:
    result = after(state, place(), click(0.25, 2.0, browser=OTHER)).state
    assert isinstance(editor(result).tool, PlaceTool)
    assert editor(result, OTHER).tool is None
    assert editor(result, OTHER).selected == ("R1",)
    assert OTHER not in after(result, by(OTHER, Leave())).state.browsers


def test_undo_leaves_anothers_later_edit_alone_while_that_browser_is_there(state: AppState) -> None:
    mine = after(state, place(), click(4.0, 3.0)).state
    both = after(mine, place(browser=OTHER), click(5.0, 3.0, browser=OTHER))
    refused = after(both.state, page.Undo())
    assert refused.state.project is both.state.project
    assert isinstance(refused.effects[0], Tell)
    assert f"browser {OTHER}" in refused.effects[0].text
    assert after(both.state, by(OTHER, page.Undo()), page.Undo()).state.project is state.project
    assert after(both.state, by(OTHER, Leave()), page.Undo()).state.project is mine.project


def test_a_selection_survives_what_another_browser_deletes(state: AppState) -> None:
    mine = after(state, click(0.25, 2.0)).state
    gone = after(mine, click(0.25, 2.0, browser=OTHER), by(OTHER, actions.DeleteSelected())).state
    with pytest.raises(UsageError, match="no reflector is selected"):
        after(gone, actions.DeleteSelected())


def test_a_route_is_drawn_by_clicks_and_its_points_are_dragged(state: AppState) -> None:
    clicks = [click(x, y) for x, y in ((1.0, 5.0), (3.0, 5.0), (4.0, 6.0), (6.0, 6.0))]
    drawn = after(state, place(RouteTool()), *clicks, actions.Finish()).state
    route = drawn.project.routes[-1]
    assert editor(drawn).point == ControlPoint(route.name)
    assert drawn.undo[-1].name == f"draw {route.name}"
    curve = route.segments[0].spline()
    for point in ((1.0, 5.0), (3.0, 5.0), (6.0, 6.0)):
        assert np.min(np.hypot(*(curve.point(np.linspace(*curve.domain, 2001)) - point).T)) < 0.005
    bent = after(drawn, *drag((6.0, 6.0), (7.0, 5.0))).state
    np.testing.assert_allclose(bent.project.routes[-1].segments[0].control_points[-1], (7.0, 5.0))
    assert len(bent.undo) == 2


def test_a_segment_is_split_reversed_and_driven_slower(state: AppState) -> None:
    chosen = after(state, click(4.0, 2.1)).state
    point = editor(chosen).point
    assert point is not None
    split = after(
        chosen,
        actions.SplitSegment(),
        actions.SetSegment("direction", Direction.REVERSE),
        actions.SetSegment("speed", 0.2),
    ).state
    segments = split.project.routes[0].segments
    assert len(segments) == len(state.project.routes[0].segments) + 1
    assert [(s.direction, s.speed) for s in segments].count((Direction.REVERSE, 0.2)) == 1


def test_a_control_point_is_inserted_without_bending_the_curve_and_deleted_again(state: AppState) -> None:
    chosen = after(state, click(4.0, 2.1)).state
    more = after(chosen, actions.InsertControlPoint()).state
    point = editor(more).point
    assert point is not None
    before, now = (s.project.routes[0].segments[point.segment] for s in (state, more))
    assert len(now.control_points) == len(before.control_points) + 1
    assert now.spline().length == pytest.approx(before.spline().length, abs=1e-9)
    fewer = after(more, actions.DeleteSelected()).state.project.routes[0].segments[point.segment]
    assert len(fewer.control_points) == len(before.control_points)


def test_a_measurement_says_distance_bearing_dx_and_dy_and_snaps_to_centers(state: AppState) -> None:
    result = after(state, place(MeasureTool()), click(0.3, 2.05), click(3.25, 6.0)).state
    found = measurement(editor(result))
    assert found is not None
    assert (found.dx, found.dy) == (3.0, 4.0)
    assert found.distance == 5.0
    assert found.bearing == pytest.approx(np.arctan2(4.0, 3.0))
    assert measurement(editor(after(result, click(1.0, 1.0)).state)) is None


def test_a_measurement_snaps_to_the_corners_of_walls_and_to_stations(state: AppState) -> None:
    # The room's inner corner, and the pillar that begins at x 7.5 m, y 3.5 m; cells of 50 mm.
    result = after(state, place(MeasureTool()), click(0.2, 0.1), click(7.45, 3.58)).state
    assert editor(result).points == (pytest.approx((0.15, 0.15)), pytest.approx((7.5, 3.5)))
    stationed = after(state, place(StationTool()), click(3.0, 5.0), place(MeasureTool()), click(3.1, 5.05)).state
    assert editor(stationed).points == ((3.0, 5.0),)
    assert editor(stationed).last_click == (3.1, 5.05)


def test_escape_drops_what_is_half_done_then_the_tool_then_the_selection(state: AppState) -> None:
    drawing = after(state, click(0.25, 2.0), place(RouteTool()), click(1.0, 1.0)).state
    first = after(drawing, actions.Cancel()).state
    assert (editor(first).points, editor(first).tool) == ((), RouteTool())
    second = after(first, actions.Cancel()).state
    assert (editor(second).tool, editor(second).selected) == (None, ("R1",))
    assert editor(after(second, actions.Cancel()).state).selected == ()


def test_a_row_of_the_table_selects_and_flies_there(state: AppState) -> None:
    result = after(state, actions.SelectReflectors(("R3",), fly=True))
    assert editor(result.state).selected == ("R3",)
    assert result.effects == (FlyTo((11.75, 1.5)),)


def test_arrow_keys_in_quick_succession_are_one_step_and_move_what_is_selected(state: AppState) -> None:
    before = reflector(state, "R2")
    nudges = [by(ME, actions.Nudge(step), at) for step, at in (((0.001, 0.0), 0.0), ((0.001, 0.0), 0.3))]
    moved = after(state, by(ME, actions.SelectReflectors(("R2",))), *nudges).state
    assert (reflector(moved, "R2").x, reflector(moved, "R2").y) == pytest.approx((before.x + 0.002, before.y))
    assert len(moved.undo) == 1
    later = after(moved, by(ME, actions.Nudge((0.0, -0.01)), 5.0)).state
    assert reflector(later, "R2").y == pytest.approx(before.y - 0.01)
    assert len(later.undo) == 2
    nothing = after(state, actions.Nudge((0.001, 0.0))).state
    assert nothing.project is state.project
    point = after(state, click(2.0, 2.0), actions.Nudge((0.0, 0.001))).state
    assert point.project.routes[0].segments[0].control_points[0] == pytest.approx((2.0, 2.001))
