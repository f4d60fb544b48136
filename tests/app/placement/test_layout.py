"""The suggested layout: wishes, the job that looks for it, what is seen of it, and what accepting does."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.actions import Action, ClickFloor, DragFloor, Envelope, Undo
from commission.app.base.drawing import crosses
from commission.app.base.state import AppState
from commission.app.editing.actions import (
    ChooseTool,
    DeleteRoute,
    SelectControlPoint,
    SetRoute,
)
from commission.app.editing.editor import ControlPoint, Editor
from commission.app.placement.actions import (
    AcceptLayout,
    AskLayout,
    CountRoute,
    DiscardLayout,
    FreeAreas,
    KeepOut,
    SetLayout,
    TakePreset,
)
from commission.app.placement.keep_out_tool import KeepOutTool
from commission.app.placement.placement_panel import found_text
from commission.app.placement.reducer import ACCEPT
from commission.app.placement.service import PlacementService
from commission.app.placement.suggestion_layer import hatch
from commission.app.placement.view import LayoutView, layout_view
from commission.app.placement.wish import LayoutWish, placement_input
from commission.errors import UsageError
from commission.site.fields import with_field
from commission.site.layout_brief import Rectangle
from commission.site.project import Project
from commission.site.zones import ObservationKind, Zone
from commission.studies.placement import PlacementResult, placement
from tests.app.asking import ME, by, joined
from tests.app.asking import after as outcome
from tests.app.bench import Bench


def suggest(project: Project) -> PlacementResult:
    """What is suggested where the layout starts empty."""
    return placement(placement_input(project, extend=False))


def after(state: AppState, *asked: Action | Envelope) -> AppState:
    return outcome(state, *asked).state


def asking(project: Project, name: str, value: object) -> Project:
    return replace(project, layout=with_field(project.layout, name, value))


def kept_out(state: AppState) -> tuple[Rectangle, ...]:
    return state.project.layout.candidates.keep_out


@pytest.fixture(scope="module")
def suggestion(project: Project) -> PlacementResult:
    return suggest(project)


@pytest.fixture
def bench(project: Project) -> Iterator[Bench[PlacementService]]:
    bench = Bench(PlacementService, project)
    yield bench
    bench.close()


def test_demands_are_set_by_the_names_they_have_in_planning(project: Project) -> None:
    state = after(
        AppState(project=project, saved=project),
        SetLayout("demands.visible", 3),
        SetLayout("demands.position_limit", 0.05),
        SetLayout("candidates.spacing", 2.0),
        SetLayout("extend", value=False),
    )
    brief = state.project.layout
    assert (brief.demands.visible, brief.demands.position_limit) == (3, 0.05)
    assert (brief.candidates.spacing, state.part(LayoutWish).extend) == (2.0, False)
    assert [step.name for step in state.undo] == [
        "set visible of the layout",
        "set position limit of the layout",
        "set spacing of the layout",
    ]
    assert after(state, Undo(), Undo(), Undo()).project is project


def test_a_preset_asks_for_all_it_says_in_one_undo_step(project: Project) -> None:
    state = after(
        AppState(project=project, saved=project), SetLayout("demands.pairs_differ", 0.3), TakePreset("NAV350")
    )
    demands = state.project.layout.demands
    assert (demands.visible, demands.survive_failure, demands.pairs_differ) == (3, True, 0.3)
    assert [step.name for step in state.undo] == ["set pairs differ of the layout", "demands of NAV350"]
    assert after(state, Undo(), Undo()).project is project


def test_a_slide_over_many_values_is_one_undo_step(project: Project) -> None:
    slide = [by(ME, SetLayout("candidates.spacing", 0.1 * step), 10.0 + 0.1 * step) for step in range(1, 9)]
    assert len(after(AppState(project=project, saved=project), *slide).undo) == 1


def test_a_route_that_does_not_count_keeps_to_it_under_another_name(project: Project) -> None:
    route = project.routes[0].name
    state = after(joined(AppState(project=project, saved=project)), CountRoute(route, counts=False))
    assert state.project.layout.ignored_routes == (route,)
    state = after(state, SelectControlPoint(ControlPoint(route)), SetRoute("name", "Round"))
    assert state.project.layout.ignored_routes == ("Round",)
    assert after(state, DeleteRoute()).project.layout.ignored_routes == ()
    assert after(state, CountRoute("Round", counts=True)).project.layout == project.layout


@pytest.mark.parametrize(
    "wish",
    [
        SetLayout("demands.beauty", 1),
        SetLayout("beauty", 1),
        SetLayout("demands.visible", 0),
        SetLayout("candidates.spacing", -1.0),
        CountRoute("Nowhere", counts=True),
        TakePreset("NAV999"),
    ],
)
def test_demands_that_do_not_exist_or_are_out_of_range_are_refused(project: Project, wish: Action) -> None:
    with pytest.raises((UsageError, ValueError)):
        after(AppState(project=project, saved=project), wish)


def test_an_area_is_drawn_by_a_drag_and_freed_by_a_click_in_it(project: Project) -> None:
    drag = [DragFloor(phase=phase, start=(4.0, 5.0), now=(2.0, 7.0), reach=0.1) for phase in ("start", "update", "end")]
    state = after(joined(AppState(project=project, saved=project)), ChooseTool(KeepOutTool()), *drag)
    assert kept_out(state) == ((2.0, 5.0, 4.0, 7.0),)
    assert [step.name for step in state.undo] == ["keep an area free of reflectors"]
    assert state.of_browser(ME, Editor).selected == ()
    assert kept_out(after(state, ClickFloor((8.0, 6.0), 0.1))) == kept_out(state)
    assert kept_out(after(state, ClickFloor((3.0, 6.0), 0.1))) == ()


def test_a_click_is_no_area_and_all_areas_are_freed_together(project: Project) -> None:
    state = after(
        AppState(project=project, saved=project), KeepOut((1.0, 1.0, 1.01, 3.0)), KeepOut((1.0, 1.0, 2.0, 3.0))
    )
    assert len(kept_out(state)) == 1
    assert kept_out(after(state, FreeAreas())) == ()


def test_a_suggestion_keeps_out_of_the_areas_and_clear_of_what_stays(
    project: Project, suggestion: PlacementResult
) -> None:
    assert len(suggestion.added) == suggestion.placement.added > 0
    x, y = suggestion.added[0]
    area = (x - 1.0, y - 1.0, x + 1.0, y + 1.0)
    elsewhere = suggest(asking(project, "candidates.keep_out", (area,))).added
    assert not np.any(np.all(np.abs(elsewhere - (x, y)) < 1.0, axis=1))


def test_starting_empty_takes_down_all_but_the_locked_ones(project: Project, suggestion: PlacementResult) -> None:
    assert len(suggestion.removed) == len(project.reflectors)
    first = replace(project.reflectors.reflectors[0], locked=True)
    locked = replace(project.reflectors, reflectors=(first, *project.reflectors.reflectors[1:]))
    found = suggest(replace(project, reflectors=locked))
    assert found.placement.reflectors.reflectors[0] is first
    assert len(found.removed) == len(project.reflectors) - 1


def test_what_is_not_met_is_told_by_its_metres_and_its_place(project: Project) -> None:
    wanting = asking(asking(project, "demands.visible", 9), "candidates.spacing", 8.0)
    found = suggest(wanting)
    assert found.unmet
    for stretch in found.unmet:
        assert stretch.first < stretch.last
        along = np.hypot(*np.diff(stretch.points, axis=0).T).sum()
        assert along == pytest.approx(stretch.last - stretch.first, abs=1.0)
    assert "a click goes there" in found_text(LayoutView(found, outdated=False, wished_otherwise=False))
    hall = Zone(name="Hall", outline=((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)), kinds=(ObservationKind.CONTOURS,))
    zoned = replace(found, inputs=replace(found.inputs, zones=(hall,)))
    told = found_text(LayoutView(zoned, outdated=False, wished_otherwise=False))
    assert "Zones: no reflector helps in Hall, and contours and tags are not reckoned with." in told


def test_without_a_route_or_a_wall_it_is_said_what_is_missing(project: Project) -> None:
    ignoring = replace(project.layout, ignored_routes=tuple(route.name for route in project.routes))
    with pytest.raises(UsageError, match="no route that counts"):
        suggest(replace(project, layout=ignoring))
    open_field = replace(project, floor_map=None)
    with pytest.raises(UsageError, match="no floor map"):
        suggest(open_field)
    with pytest.raises(UsageError, match="no floor map"):
        after(AppState(project=open_field, saved=open_field), AskLayout())


def test_accepting_is_one_undo_step_and_undo_brings_the_old_ones_back(
    project: Project, suggestion: PlacementResult
) -> None:
    state = after(AppState(project=project, saved=project), AskLayout())
    accepted = after(state, AcceptLayout(suggestion))
    assert [step.name for step in accepted.undo] == [ACCEPT]
    assert accepted.project.reflectors == suggestion.placement.reflectors
    assert accepted.part(LayoutWish).inputs is None
    assert after(accepted, Undo()).project is project


def test_a_layout_for_other_reflectors_is_not_accepted(project: Project, suggestion: PlacementResult) -> None:
    other = replace(project, reflectors=replace(project.reflectors, reflectors=project.reflectors.reflectors[1:]))
    with pytest.raises(UsageError, match="suggest it again"):
        after(AppState(project=other, saved=other), AcceptLayout(suggestion))


def test_it_is_looked_for_in_the_background_shown_and_dropped(bench: Bench[PlacementService]) -> None:
    project = bench.state.project
    bench.state = after(bench.state, SetLayout("extend", value=False), AskLayout())
    bench.service.follow(bench.state)
    found = bench.found()
    assert found is not None
    assert not found.outdated
    assert bench.state.project is project
    bench.move(0, 0.5)
    assert not bench.jobs.unfinished()
    moved = bench.view
    assert moved is not None
    assert moved.outdated
    bench.state = after(bench.state, DiscardLayout())
    bench.service.follow(bench.state)
    assert bench.view is None


def test_asking_again_drops_what_was_found_and_looks_anew(bench: Bench[PlacementService]) -> None:
    bench.state = after(bench.state, AskLayout())
    bench.service.follow(bench.state)
    first = bench.found()
    bench.state = after(bench.state, DiscardLayout(), AskLayout())
    bench.service.follow(bench.state)
    assert bench.view is None
    second = bench.found()
    assert first is not None
    assert second is not None
    assert second.suggestion is not first.suggestion


def test_a_cross_and_a_hatch_stay_within_their_places() -> None:
    assert crosses(np.array([[1.0, 2.0]]), 0.5).shape == (2, 2, 2)
    strokes = hatch((1.0, 2.0, 5.0, 4.0), 0.3)
    assert len(strokes)
    assert strokes[..., 0].min() >= 1.0 - 1e-9
    assert strokes[..., 0].max() <= 5.0 + 1e-9
    assert strokes[..., 1].min() >= 2.0 - 1e-9
    assert strokes[..., 1].max() <= 4.0 + 1e-9


def told(suggestion: PlacementResult, project: Project, **wish: bool) -> tuple[bool, bool]:
    found = layout_view(suggestion, project, LayoutWish(**({"extend": False} | wish)))  # type: ignore[arg-type]
    return found.outdated, found.wished_otherwise


def test_a_suggestion_is_held_against_the_site_and_the_wishes_of_now(
    project: Project, suggestion: PlacementResult
) -> None:
    assert told(suggestion, project) == (False, False)
    assert told(suggestion, replace(project, name="Other")) == (False, False)
    assert told(suggestion, project, extend=True) == (False, True)
    assert told(suggestion, asking(project, "demands.visible", 3)) == (False, True)
    supervisor = replace(project.parameters.supervisor, position_limit=0.05)
    stricter = replace(project, parameters=replace(project.parameters, supervisor=supervisor))
    assert told(suggestion, stricter) == (True, False)
    slower = replace(project, routes=tuple(replace(route, speed=0.2) for route in project.routes))
    assert told(suggestion, slower) == (True, False)
    another = replace(project, routes=(*project.routes, replace(project.routes[0], name="Another")))
    assert told(suggestion, another) == (False, True)
    assert told(suggestion, asking(another, "ignored_routes", ("Another",))) == (False, False)


def test_the_site_is_taken_as_it_was_when_it_was_asked_for(bench: Bench[PlacementService]) -> None:
    before = bench.state.project.reflectors
    bench.ask(AskLayout())
    bench.move(0, 0.5)
    found = bench.found()
    assert found.suggestion.inputs.reflectors is before
    assert found.outdated
