"""What loading, drawing on and aligning a floor map means, without a browser and without files."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.app.base import actions as page
from commission.app.base.actions import Camera, ClickFloor, DragFloor, Sender
from commission.app.base.effects import PlaceCamera, Tell
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import MAP_BYTES, AppState
from commission.app.base.uploads import Upload
from commission.app.editing import actions as editing
from commission.app.editing.editor import Editor
from commission.app.editing.tool import Tool
from commission.app.floor_map import actions
from commission.app.floor_map.align_tool import AlignTool, NamedPoint
from commission.app.floor_map.draft import MapDraft, MapFile, MapLoading, MapTrouble, ReadOptions
from commission.app.floor_map.effects import DrawMap, ReadMapFile, StopMapWork
from commission.app.floor_map.tools import CalibrateTool, EraseTool, ObstacleTool, WallTool
from commission.errors import UsageError
from commission.io.dxf import Drawing
from commission.io.image_map import Picture
from commission.io.mesh import Model
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap
from commission.site.project import Project
from tests.app.asking import ME, OTHER, after, by, joined
from tests.app.sites import room

REACH = 0.15
YAML, IMAGE, ANOTHER = (MapFile(Upload(name, b"x")) for name in ("3.yaml", "3.pgm", "other.png"))
PLAN = MapFile(Path("plan.png"))
PICTURE = Picture(np.full((100, 200), 255, np.uint8), np.full((100, 200), 255, np.uint8))


@pytest.fixture
def state() -> AppState:
    project = room()
    return joined(AppState(project=project, saved=project, folder=Path("hall")))


def click(x: float, y: float) -> ClickFloor:
    return ClickFloor((x, y), REACH)


def use(tool: Tool) -> editing.ChooseTool:
    return editing.ChooseTool(tool)


def known(state: AppState) -> tuple[NamedPoint, ...]:
    tool = state.of_browser(ME, Editor).tool
    assert isinstance(tool, AlignTool)
    return tool.known


def cells(state: AppState) -> np.ndarray:
    assert state.project.floor_map is not None
    return state.project.floor_map.cells


def trouble(state: AppState) -> str:
    return state.of_browser(ME, MapTrouble).text


def draft(state: AppState) -> MapDraft:
    assert state.part(MapLoading).draft is not None
    return state.part(MapLoading).draft


def test_a_loaded_map_replaces_the_old_one_in_one_undo_step_and_everybody_sees_it_whole(state: AppState) -> None:
    loaded = FloorMap(np.zeros((10, 20), np.int8), 0.1)
    result = after(state, actions.MapMade(MapFile(Path("hall.dxf")), loaded, ("2 texts left out",)))
    assert result.state.project.floor_map is loaded
    assert [step.name for step in result.state.undo] == ["load floor map hall.dxf"]
    assert result.effects == (PlaceCamera(Camera.FIT, everywhere=True),)
    assert result.state.part(MapLoading).notes == ("hall.dxf: 2.0 x 1.0 m, cells of 100 mm", "2 texts left out")
    assert after(result.state, page.Undo()).state.project is state.project


def test_a_map_and_its_image_are_read_together_in_whichever_order_they_come(state: AppState) -> None:
    first = after(state, actions.OpenMap(YAML))
    assert first.effects == (ReadMapFile(YAML),)
    waiting = after(first.state, actions.ImageMissing(YAML, "3.pgm"))
    assert waiting.effects == (Tell("3.yaml needs its image: upload 3.pgm, too", failed=False),)
    assert after(waiting.state, actions.OpenMap(IMAGE)).effects == (ReadMapFile(YAML, image=IMAGE),)
    other_way = after(state, actions.OpenMap(IMAGE), actions.OpenMap(YAML))
    assert other_way.effects == (ReadMapFile(YAML, image=IMAGE),)


def test_another_image_than_the_one_that_is_waited_for_is_named(state: AppState) -> None:
    waiting = after(state, actions.ImageMissing(YAML, "3.pgm")).state
    refused = after(waiting, actions.OpenMap(ANOTHER))
    assert trouble(refused.state) == "other.png: is not the image of 3.yaml; expected 3.pgm"
    assert refused.state.part(MapLoading).waiting == waiting.part(MapLoading).waiting
    freed = after(refused.state, actions.DiscardMap(), actions.OpenMap(ANOTHER))
    assert freed.effects == (ReadMapFile(ANOTHER),)


def test_trouble_leaves_the_project_as_it_is_and_goes_with_the_next_file(state: AppState) -> None:
    failed = after(state, actions.MapFailed("hall.stl: is no readable STL;\n expected a complete model"))
    assert failed.state.project is state.project
    assert trouble(failed.state) == "hall.stl: is no readable STL; expected a complete model"
    assert failed.effects == (Tell(trouble(failed.state), failed=True),)
    assert trouble(after(failed.state, actions.OpenMap(PLAN)).state) == ""
    assert trouble(after(failed.state, actions.DiscardMap()).state) == ""
    unknown = after(state, actions.OpenMap(MapFile(Path("map.pdf"))))
    assert trouble(unknown.state).startswith("map.pdf: is no floor map; expected a file that ends in .yaml")


def test_why_a_file_is_no_floor_map_is_known_to_the_browser_that_asked_and_to_no_other(state: AppState) -> None:
    both = state.joined(ME + 1)
    quoting = reduce(actions.MapFailed("passwd.dxf: line 1: found root:x:0:0"), both, Sender(ME)).state
    assert trouble(quoting).endswith("root:x:0:0")
    others = replace(quoting, browsers={ME + 1: quoting.browsers[ME + 1]})
    assert "root:x" not in repr(others)
    # What the other one asks for does not take the reason away.
    later = reduce(actions.OpenMap(PLAN), quoting, Sender(ME + 1)).state
    assert trouble(later) == trouble(quoting)


def test_an_image_is_placed_by_two_clicks_a_distance_and_an_axis(state: AppState) -> None:
    opened = after(state, actions.MapOpened(PLAN, PICTURE, ReadOptions()))
    assert opened.effects == (PlaceCamera(Camera.FIT),)
    assert isinstance(opened.state.of_browser(ME, Editor).tool, CalibrateTool)
    stage = draft(opened.state).stage
    # The image lies in the middle of the room of 12 x 8 m, where everybody sees it.
    assert stage.pixel_at((6.0, 4.0)) == pytest.approx((100.0, 50.0))
    a, b = stage.place_of((10.0, 90.0)), stage.place_of((10.0, 10.0))
    placed = after(
        opened.state,
        click(*a),
        click(*b),
        actions.SetMapOption("distance", 40.0),
        actions.SetMapOption("direction", math.pi / 2),
        actions.SetMapOption("first_in_map", (5.0, 0.0)),
    ).state
    placement = draft(placed).placement()
    assert placement is not None
    assert placement.resolution == pytest.approx(0.5)
    np.testing.assert_allclose(placement.origin(100), (0.0, -5.0, 0.0), atol=1e-9)
    assert after(placed, actions.MakeMap()).effects == (DrawMap(draft(placed)),)
    moved = after(placed, click(*stage.place_of((12.0, 12.0)))).state
    assert [tuple(np.round(p, 6)) for p in draft(moved).pixels] == [(10.0, 90.0), (12.0, 12.0)]
    made = after(placed, actions.MapMade(PLAN, PICTURE.floor_map(placement))).state
    assert made.of_browser(ME, Editor).tool is None
    assert made.part(MapLoading).draft is None


def test_a_click_beside_the_image_is_no_point_of_it(state: AppState) -> None:
    opened = after(state, actions.MapOpened(PLAN, PICTURE, ReadOptions())).state
    with pytest.raises(ValueError, match="missed the image"):
        after(opened, click(1000.0, 0.0))


def test_options_out_of_range_are_refused_and_keep_what_was(state: AppState) -> None:
    opened = after(state, actions.MapOpened(PLAN, PICTURE, ReadOptions())).state
    for name, value in (("threshold", 1.5), ("distance", 0.0), ("resolution", 5.0), ("heights", ())):
        with pytest.raises(ValueError, match="expected"):
            after(opened, actions.SetMapOption(name, value))
    with pytest.raises(UsageError, match="no option of a floor map is called 'color'"):
        after(opened, actions.SetMapOption("color", 1.0))
    with pytest.raises(UsageError, match="no file is open"):
        after(state, actions.MakeMap())


def test_a_model_is_cut_where_the_reflectors_hang_unless_somebody_says_otherwise(state: AppState) -> None:
    model = Model(Path("hall.stl"), np.zeros((1, 3, 3)))
    opened = after(state, actions.MapOpened(MapFile(Path("hall.stl")), model, ReadOptions())).state
    assert draft(opened).options.heights == (0.2,)
    again = after(opened, actions.SetMapOption("heights", (0.3, 1.8)), actions.SetReading(ReadOptions("mm")))
    assert again.effects == (ReadMapFile(draft(opened).file, ReadOptions("mm")),)
    # Read in another unit, the choices stay.
    reread = after(again.state, actions.MapOpened(draft(opened).file, model, ReadOptions("mm"))).state
    assert draft(reread).options.heights == (0.3, 1.8)


def test_stopping_and_discarding_end_the_work_and_change_nothing(state: AppState) -> None:
    opened = after(state, actions.MapOpened(PLAN, PICTURE, ReadOptions())).state
    assert after(opened, actions.StopMapJob()) == Outcome(opened, (StopMapWork(),))
    gone = after(opened, actions.DiscardMap())
    assert gone.effects == (StopMapWork(),)
    assert (gone.state.part(MapLoading).draft, gone.state.of_browser(ME, Editor).tool) == (None, None)
    assert gone.state.project is state.project


def test_a_wall_is_drawn_by_clicks_and_enter_in_one_undo_step(state: AppState) -> None:
    thick = actions.SetPen("thickness", 0.2)
    clicked = after(state, use(WallTool()), thick, click(3.0, 2.0), click(5.0, 2.0)).state
    assert clicked.project is state.project
    drawn = after(clicked, editing.Finish()).state
    assert [step.name for step in drawn.undo] == ["draw wall"]
    assert (cells(drawn)[38:42, 60:100] == OCCUPIED).all()
    assert (cells(state)[38:42, 60:100] == FREE).all()
    assert (drawn.of_browser(ME, Editor).tool, drawn.of_browser(ME, Editor).points) == (WallTool(), ())
    np.testing.assert_array_equal(cells(after(drawn, page.Undo()).state), cells(state))
    np.testing.assert_array_equal(cells(after(drawn, page.Undo(), page.Redo()).state), cells(drawn))


def rectangle(start: tuple[float, float], end: tuple[float, float]) -> tuple[DragFloor, ...]:
    steps = (("start", start), ("update", end), ("end", end))
    return tuple(DragFloor(phase=phase, start=start, now=now, reach=REACH) for phase, now in steps)


def test_clutter_is_erased_by_a_rectangle_and_a_polygon_becomes_an_obstacle(state: AppState) -> None:
    # The room has a pillar at columns 150 to 169 and rows 70 to 83.
    start, update, end = rectangle((7.0, 3.0), (9.0, 5.0))
    half = after(state, use(EraseTool()), start, update).state
    assert half.project is state.project
    erased = after(half, end).state
    assert (cells(erased)[70:84, 150:170] == FREE).all()
    assert erased.of_browser(ME, Editor).drag is None
    corners = (click(2.0, 5.0), click(3.0, 5.0), click(3.0, 6.0), click(2.0, 6.0))
    filled = after(erased, use(ObstacleTool()), *corners, editing.Finish()).state
    assert (cells(filled)[100:120, 40:60] == OCCUPIED).all()
    assert [step.name for step in filled.undo] == ["erase", "draw obstacle"]
    unknown = actions.SetPen("to_unknown", True)
    forgotten = after(filled, use(EraseTool()), unknown, *rectangle((2.0, 5.0), (3.0, 6.0))).state
    assert (cells(forgotten)[100:120, 40:60] == UNKNOWN).all()


def test_erasing_where_nothing_is_says_so_and_is_no_step(state: AppState) -> None:
    result = after(state, use(EraseTool()), *rectangle((3.0, 5.0), (4.0, 6.0)))
    assert result.state.project is state.project
    assert result.effects == (Tell("nothing to erase there", failed=False),)


def test_too_few_points_are_refused_and_kept(state: AppState) -> None:
    clicked = after(state, use(ObstacleTool()), click(2.0, 5.0), click(3.0, 5.0)).state
    with pytest.raises(UsageError, match="2 points were clicked; expected 3 or more to make the obstacle"):
        after(clicked, editing.Finish())
    assert len(clicked.of_browser(ME, Editor).points) == 2
    assert after(clicked, editing.Cancel()).state.of_browser(ME, Editor).points == ()


def test_walls_can_be_drawn_before_there_is_a_map() -> None:
    empty = joined(AppState(project=Project(name="New"), saved=Project(name="New")))
    drawn = after(empty, use(WallTool()), click(0.0, 0.0), click(10.0, 0.0), editing.Finish()).state
    assert drawn.project.floor_map is not None
    with pytest.raises(UsageError, match="no floor map to erase in"):
        after(empty, use(EraseTool()), *rectangle((0.0, 0.0), (1.0, 1.0)))


def test_points_to_align_by_snap_to_reflectors_and_to_corners_of_walls(state: AppState) -> None:
    # R1 stands at (0.25, 2.0); the pillar's corner lies at (7.5, 3.5).
    clicked = after(state, use(AlignTool()), click(0.3, 2.05), click(7.55, 3.42)).state
    assert [point.at for point in known(clicked)] == [
        (0.25, 2.0),
        pytest.approx((7.5, 3.5)),
    ]
    # A click near a point moves it, one elsewhere is another point to check them by.
    again = after(clicked, click(4.0, 4.0), actions.SetPlantPoint(2, (104.0, 54.0)), click(4.15, 4.0)).state
    assert [point.at for point in known(again)] == [(0.25, 2.0), pytest.approx((7.5, 3.5)), (4.15, 4.0)]
    assert known(again)[2].plant == (104.0, 54.0)
    assert known(after(again, actions.ForgetPoint()).state) == known(again)[:2]


def test_points_to_align_by_are_there_again_when_the_tool_is_left_and_taken_up(state: AppState) -> None:
    begun = after(state, use(AlignTool()), click(0.25, 2.0), click(10.25, 2.0)).state
    begun = after(begun, actions.SetPlantPoint(1, (100.0, 60.0), "column B4")).state
    points = known(begun)
    for leaving in ((editing.Cancel(),), (editing.ChooseTool(None),), (use(WallTool()), click(1.0, 1.0))):
        left = after(begun, *leaving).state
        assert not isinstance(left.of_browser(ME, Editor).tool, AlignTool)
        assert known(after(left, use(AlignTool())).state) == points
    # Until they are forgotten, or the map is moved by them.
    assert known(after(begun, actions.ForgetPoint(everything=True), editing.Cancel(), use(AlignTool())).state) == ()
    assert known(after(aligning(state, everything=False).state, use(AlignTool())).state) == ()


@pytest.mark.parametrize("in_use", [True, False], ids=["in use", "laid aside"])
@pytest.mark.parametrize("leaves_first", [True, False])
def test_points_to_align_by_are_there_again_in_the_window_that_is_loaded_anew(
    state: AppState, *, in_use: bool, leaves_first: bool
) -> None:
    named = after(state, page.NameWindow("mine")).state
    named = after(named, page.NameWindow("another"), browser=OTHER).state
    begun = after(named, use(AlignTool()), click(0.25, 2.0), actions.SetPlantPoint(0, (100.0, 60.0), "column B4")).state
    points = known(begun)
    if not in_use:
        begun = after(begun, editing.ChooseTool(None)).state

    def loaded_anew(state: AppState, old: int, new: int, name: str) -> AppState:
        steps = [by(old, page.Leave()), by(new, page.Join()), by(new, page.NameWindow(name))]
        return after(state, *(steps if leaves_first else (*steps[1:], steps[0]))).state

    other = loaded_anew(begun, OTHER, 8, "another")
    assert other.of_browser(8, Editor).tool is None, "they are nobody else's"
    again = loaded_anew(other, ME, 9, "mine")
    for number in (10, 11):  # and once more
        shown = again if in_use else after(again, by(number - 1, use(AlignTool()))).state
        tool = shown.of_browser(number - 1, Editor).tool
        assert isinstance(tool, AlignTool) and tool.known == points
        again = loaded_anew(again, number - 1, number, "mine")
    moved = replace(again, project=replace(again.project, floor_map=None))
    tool = loaded_anew(moved, 11, 12, "mine").of_browser(12, Editor).tool
    assert tool is None or tool == AlignTool()
    assert 9 not in again.browsers
    with pytest.raises(ValueError, match="expected 1 to 64"):
        after(state, page.NameWindow(""))


def test_points_of_a_map_that_was_moved_or_exchanged_since_are_not_taken_for_those_of_another(state: AppState) -> None:
    begun = after(state, use(AlignTool()), click(0.25, 2.0), click(10.25, 2.0)).state
    floor_map = begun.project.floor_map
    assert floor_map is not None
    other = replace(
        begun, project=replace(begun.project, floor_map=replace(floor_map, origin=np.array([5.0, 0.0, 0.0])))
    )
    assert known(after(other, editing.Cancel(), use(AlignTool())).state) == ()
    assert len(known(after(other, click(4.0, 4.0)).state)) == 1
    with pytest.raises(UsageError, match="moved or exchanged since the points were clicked"):
        after(other, actions.SetPlantPoint(1, (100.0, 60.0)), actions.AlignMap())


def aligning(state: AppState, *, everything: bool, stretch: float = 1.0) -> Outcome:
    """Turn the room by a quarter about R1, which comes to lie at (100, 50)."""
    return after(
        state,
        use(AlignTool()),
        click(0.25, 2.0),
        click(10.25, 2.0),
        # In any order: nothing that was typed gets lost behind what is typed next.
        actions.SetPlantPoint(1, (100.0, 50.0 + 10.0 * stretch)),
        actions.SetPlantPoint(0, (100.0, 50.0), "column B4"),
        actions.SetAligned(everything),
        actions.AlignMap(),
    )


def test_the_map_is_aligned_in_one_undo_step_alone_or_with_all_that_is_on_it(state: AppState) -> None:
    alone = aligning(state, everything=False)
    assert alone.state.undo[-1].name == "align to column B4 and B"
    assert alone.state.project.reflectors is state.project.reflectors
    assert alone.state.project.floor_map is not None
    np.testing.assert_allclose(alone.state.project.floor_map.origin, (102.0, 49.75, math.pi / 2))
    together = aligning(state, everything=True)
    np.testing.assert_allclose(together.state.project.reflectors.centers[0], (100.0, 50.0), atol=1e-12)
    assert after(together.state, page.Undo()).state.project is state.project
    assert PlaceCamera(Camera.FIT, everywhere=True) in together.effects
    assert together.state.of_browser(ME, Editor).tool is None


def test_a_doubtful_distance_is_told_and_a_wrong_one_refused(state: AppState) -> None:
    told = [effect for effect in aligning(state, everything=False, stretch=1.005).effects if isinstance(effect, Tell)]
    assert told[0].failed
    assert "each 25 mm off; that is 0.5 % of their distance" in told[0].text
    with pytest.raises(UsageError, match=r"10\.000 m apart on the map and 11\.000 m in the plant"):
        aligning(state, everything=False, stretch=1.1)


def test_maps_of_many_undo_steps_take_bounded_memory_and_all_come_back() -> None:
    side = 4000
    first = FloorMap(np.zeros((side, side), np.int8), 0.05)
    project = Project(name="Large", floor_map=first)
    state = after(joined(AppState(project=project, saved=project)), use(ObstacleTool())).state
    steps = MAP_BYTES // side**2 + 3
    seen = [first]
    for number in range(steps):
        state = after(state, *rectangle((2.0 * number, 1.0), (2.0 * number + 1.0, 2.0))).state
        assert state.project.floor_map is not None
        seen.append(state.project.floor_map)
    assert held(state) <= MAP_BYTES
    for expected in reversed(seen[:-1]):
        state = after(state, page.Undo()).state
        assert state.project.floor_map == expected
        assert held(state) <= 2 * MAP_BYTES
    for expected in seen[1:]:
        state = after(state, page.Redo()).state
        assert state.project.floor_map == expected


def held(state: AppState) -> int:
    """Bytes of cells that undo and redo steps hold unpacked."""
    maps = (step.project.floor_map for step in (*state.undo, *state.redo))
    return sum({id(m.cells): m.cells.nbytes for m in maps if m is not None}.values())


def test_a_drawing_without_lines_can_be_discarded(state: AppState) -> None:
    drawing = Drawing(
        path=Path("a.dxf"),
        unit="mm",
        layers=(),
        segments=np.empty((0, 2, 2)),
        layer_of=np.empty(0, np.int32),
        warnings=(),
    )
    opened = after(state, actions.MapOpened(MapFile(Path("a.dxf")), drawing, ReadOptions())).state
    assert after(opened, actions.DiscardMap()).state.part(MapLoading) == MapLoading()
