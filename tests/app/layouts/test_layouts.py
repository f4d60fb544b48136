"""Layouts compared on the page: what keeping, switching and undo do, and what the table and the floor show."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.actions import Undo
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.state import AppState
from commission.app.coverage.actions import SetCoverage
from commission.app.layouts.actions import ForgetLayout, KeepLayout, SetComparison, SwitchLayout
from commission.app.layouts.difference import (
    GAINED,
    LOST,
    NEITHER,
    SAME,
    class_colors,
    difference_view,
    picture,
    round_bounds,
)
from commission.app.layouts.difference_layer import differences
from commission.app.layouts.service import LayoutsService
from commission.app.layouts.state import MOST_KEPT, NAME, LayoutsState
from commission.app.layouts.view import LayoutsView
from commission.app.layouts.words import comparison_table, told
from commission.errors import UsageError
from commission.planning.coverage import Lattice
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.studies.layouts import FloorDifference, FloorFigure, LayoutInput
from tests.app.asking import after as outcome
from tests.app.bench import Bench
from tests.app.sites import room


def moved(project: Project, dx: float = 0.5) -> Project:
    first, *others = project.reflectors.reflectors
    return replace(project, reflectors=ReflectorMap((replace(first, y=first.y + dx), *others)))


def state_of(project: Project) -> AppState:
    return AppState(project=project, saved=project)


@pytest.fixture
def bench() -> Iterator[Bench[LayoutsService]]:
    bench = Bench(LayoutsService, room())
    yield bench
    bench.close()


def test_switching_puts_the_kept_layout_up_in_one_step_keeps_the_one_of_now_and_switches_back() -> None:
    first = room()
    state = replace(outcome(state_of(first), KeepLayout()).state, project=moved(first))
    second = state.project.reflectors
    state = outcome(state, SwitchLayout(1)).state
    assert state.project.reflectors == first.reflectors
    assert [step.name for step in state.undo] == ["switch to layout 1"]
    part = state.part(LayoutsState)
    assert [(each.number, each.reflectors) for each in part.kept] == [(1, first.reflectors), (2, second)]
    compared = part.compared(state.project.reflectors)
    assert compared is not None
    assert compared.number == 2
    state = outcome(state, SwitchLayout(2)).state
    assert state.project.reflectors == second
    assert len(state.part(LayoutsState).kept) == 2


def test_undo_of_a_switch_brings_the_layout_back_and_it_is_compared_with_the_other_one() -> None:
    first = room()
    state = replace(outcome(state_of(first), KeepLayout()).state, project=moved(first))
    state = outcome(state, SwitchLayout(1), Undo()).state
    assert state.project.reflectors == moved(first).reflectors
    compared = state.part(LayoutsState).compared(state.project.reflectors)
    assert compared is not None
    assert compared.reflectors == first.reflectors


def test_a_layout_is_kept_once_and_four_at_most() -> None:
    state = outcome(state_of(room()), KeepLayout(), KeepLayout()).state
    assert len(state.part(LayoutsState).kept) == 1
    for step in range(1, MOST_KEPT):
        state = outcome(replace(state, project=moved(room(), 0.1 * step)), KeepLayout()).state
    assert [each.number for each in state.part(LayoutsState).kept] == [1, 2, 3, 4]
    state = replace(state, project=moved(room(), 0.9))
    with pytest.raises(UsageError, match="4 layouts are kept already"):
        outcome(state, KeepLayout())
    state = outcome(state, ForgetLayout(2), KeepLayout()).state
    assert state.part(LayoutsState).layout(2).reflectors == state.project.reflectors


def test_no_layout_without_reflectors_is_kept_and_none_that_is_not_there_is_put_up() -> None:
    with pytest.raises(UsageError, match="no reflectors"):
        outcome(state_of(replace(room(), reflectors=ReflectorMap(()))), KeepLayout())
    with pytest.raises(UsageError, match="no layout 3 is kept; kept: none"):
        outcome(state_of(room()), SwitchLayout(3))


def test_its_difference_takes_the_floor_from_the_heatmap_and_leaves_it_when_nothing_is_compared() -> None:
    state = outcome(state_of(room()), SetCoverage("figure", "visible"), KeepLayout()).state
    assert state.part(FloorPicture).owner == "coverage"
    state = outcome(state, SetComparison("figure", "position_sigma")).state
    assert state.part(FloorPicture).owner == NAME
    assert outcome(state, SetComparison("against", 0)).state.part(FloorPicture).owner == ""
    assert outcome(state, ForgetLayout(1)).state.part(FloorPicture).owner == ""
    with pytest.raises(UsageError):
        outcome(state, SetComparison("against", 7))


def test_an_edit_is_compared_with_the_kept_layout_and_undone_it_is_known_at_once(bench: Bench[LayoutsService]) -> None:
    bench.ask(KeepLayout(), SetComparison("figure", "visible"))
    before: LayoutsView = bench.found()
    assert before.is_same
    assert before.before is before.after
    bench.edit(moved(bench.state.project))
    assert bench.view.outdated
    after: LayoutsView = bench.found()
    assert not after.outdated
    assert not after.is_same
    assert after.before is before.before
    assert after.after is not None
    assert after.after.inputs.reflectors == moved(room()).reflectors
    assert after.difference is not None
    bench.edit(replace(bench.state.project, reflectors=before.kept.reflectors))
    again: LayoutsView = bench.view
    assert again.is_same
    assert not bench.jobs.unfinished()
    bench.ask(SetComparison("against", 0))
    assert bench.view is None


def test_a_picture_looks_no_result_up_again(bench: Bench[LayoutsService], monkeypatch: pytest.MonkeyPatch) -> None:
    bench.ask(KeepLayout())
    bench.edit(moved(bench.state.project))
    found: LayoutsView = bench.found()
    bench.service.follow(bench.state)
    hashed: list[LayoutInput] = []

    def noted(inputs: LayoutInput) -> int:
        hashed.append(inputs)
        return id(inputs)

    monkeypatch.setattr(LayoutInput, "__hash__", noted)
    for _ in range(5):
        bench.service.follow(bench.state)
    assert bench.view is found
    assert hashed == []


def test_the_table_says_of_each_figure_which_layout_is_better(bench: Bench[LayoutsService]) -> None:
    bench.ask(KeepLayout())
    bench.found()
    bench.edit(replace(bench.state.project, reflectors=ReflectorMap(room().reflectors.reflectors[:2])))
    found: LayoutsView = bench.found()
    assert found.before is not None
    assert found.after is not None
    html = comparison_table(found.before, found.after, found.kept.number)
    rows = {
        cells[0]: cells[1:]
        for row in re.findall(r"<tr>(.*?)</tr>", html)
        if len(cells := re.findall(r"<td[^>]*>(.*?)</td>", row)) == 3
    }
    assert rows[""] == ["layout 1", "now"]
    assert rows["Reflectors"] == ["4", "2"]
    worst = [1000.0 * each.figures.routes[0].intact.position for each in (found.before, found.after)]
    assert rows["All there [mm]"] == [f"{worst[0]:.1f}", f"<i class='c-worse'>{worst[1]:.1f}</i>"]
    areas = found.before.ambiguous_area, found.after.ambiguous_area
    assert areas[1] > areas[0]
    assert rows["Ambiguous start [m²]"] == [f"{areas[0]:.1f}", f"<i class='c-worse'>{areas[1]:.1f}</i>"]
    assert told(found) == ()


def test_differences_are_sorted_on_both_sides_of_each_bound_and_beside_the_numbers() -> None:
    gains = 0.001 * np.array([0.0, 0.19, 0.2, -0.2, 1.0, -0.99, 5.0, -5.0, np.nan, np.nan, np.nan, np.nan])
    flags = np.zeros((3, 12), bool)
    flags[0, 8], flags[1, 9], flags[2, 10] = True, True, True
    found = FloorDifference(
        lattice=Lattice(x=0.0, y=0.0, spacing=1.0, rows=3, columns=4),
        figure=FloorFigure.POSITION_SIGMA,
        gains=gains,
        gained=flags[0],
        lost=flags[1],
        neither=flags[2],
    )
    view = difference_view(found)
    assert view.bounds == (0.2, 1.0, 5.0)
    expected = [SAME, SAME, SAME + 1, SAME - 1, SAME + 2, SAME - 1, SAME + 3, SAME - 3, GAINED, LOST, NEITHER, 0]
    assert view.classes.ravel().tolist() == expected
    assert (view.better, view.worse) == (pytest.approx(4 / 11), pytest.approx(4 / 11))
    image = picture(view.classes, 0.5)
    assert image[0, 2].tolist() == [*class_colors()[SAME + 1], 128]
    assert image[2, 3, 3] == 0


def test_bounds_are_round_and_there_are_some_where_nothing_differs() -> None:
    assert round_bounds(np.zeros(5)) == (0.05, 0.2, 1.0)
    assert round_bounds(np.array([0.0, 3.0, 4.0])) == (0.1, 0.5, 2.0)


def test_a_moved_reflector_has_a_line_to_where_it_went_and_one_that_is_gone_has_none() -> None:
    before = room().reflectors
    now = ReflectorMap(moved(room()).reflectors.reflectors[:3])
    places, moves = differences(before, now)
    assert places.tolist() == [[0.25, 2.0], [11.75, 5.5]]
    assert moves.tolist() == [[[0.25, 2.0], [0.25, 2.5]]]
