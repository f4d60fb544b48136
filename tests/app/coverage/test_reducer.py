"""What is asked of the heatmap: settings, clicks, and who has the floor."""

import math

import pytest

from commission.app.ambiguity.settings import DropPlaces, FindPlaces
from commission.app.base.actions import Action
from commission.app.base.conditions import Conditions, SetCondition
from commission.app.base.floor_picture import FloorPicture, SetOpacity
from commission.app.base.state import AppState
from commission.app.coverage.actions import ReadFloor, SetCoverage
from commission.app.coverage.settings import CoverageSettings, Figure, shown_figure
from commission.errors import UsageError
from commission.planning.dilution import Heading
from commission.site.project import Project
from tests.app.asking import after as outcome
from tests.app.asking import joined

VISIBLE = SetCoverage("figure", "visible")


def after(project: Project, *wishes: Action) -> AppState:
    return outcome(joined(AppState(project=project, saved=project)), *wishes).state


def settings(project: Project, *wishes: Action) -> CoverageSettings:
    return after(project, *wishes).part(CoverageSettings)


def test_settings_are_set_from_plain_values(project: Project) -> None:
    found = settings(project, VISIBLE, SetCoverage("heading", "given"), SetCoverage("given_heading", 0.5))
    assert (found.figure, found.heading, found.given_heading) == (Figure.VISIBLE, Heading.GIVEN, 0.5)
    assert after(project, SetCondition("min_beams", 3)).part(Conditions).min_beams == 3
    assert after(project, SetOpacity(0.25)).part(FloorPicture).opacity == 0.25


@pytest.mark.parametrize(
    "wish",
    [
        SetCoverage("color", "red"),
        SetCoverage("figure", "beauty"),
        SetCoverage("given_heading", math.inf),
        SetCoverage("on_odometry", 0.0),
        SetOpacity(1.5),
        SetCondition("blocked_per_m", -0.1),
        SetCondition("min_beams", 0),
        SetCondition("weather", "rain"),
    ],
)
def test_what_does_not_exist_or_is_out_of_range_is_refused(project: Project, wish: Action) -> None:
    with pytest.raises((UsageError, ValueError)):
        after(project, wish)


def test_settings_of_the_heatmap_are_no_undo_steps(project: Project) -> None:
    state = after(project, VISIBLE, SetCondition("min_beams", 3))
    assert not state.undo
    assert not state.is_changed


def test_a_click_reads_only_while_there_is_a_heatmap(project: Project) -> None:
    click = ReadFloor((1.0, 2.0), 0.1)
    assert settings(project, click).probe is None
    assert settings(project, VISIBLE, click).probe == (1.0, 2.0)
    assert settings(project, VISIBLE, click, SetCoverage("figure", ""), click).probe is None


def test_heatmap_and_ambiguous_places_have_the_floor_one_at_a_time(project: Project) -> None:
    assert shown_figure(after(project, VISIBLE)) is Figure.VISIBLE
    taken = after(project, VISIBLE, FindPlaces())
    assert shown_figure(taken) is Figure.NONE
    assert taken.part(FloorPicture).is_free_for("ambiguity")
    back = outcome(taken, VISIBLE).state
    assert shown_figure(back) is Figure.VISIBLE
    assert not back.part(FloorPicture).is_free_for("ambiguity")
    # Who has not the floor cannot leave it.
    assert shown_figure(outcome(back, DropPlaces()).state) is Figure.VISIBLE
    assert outcome(back, SetCoverage("figure", "")).state.part(FloorPicture).is_free_for("ambiguity")
