"""Ellipses of a fix on the heatmap: they are the heatmap's own numbers, follow it, and come and go by clicks."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.actions import Action
from commission.app.base.conditions import Conditions
from commission.app.base.floor_picture import SetOpacity
from commission.app.base.state import AppState
from commission.app.coverage.actions import ClearEllipses, ReadFloor, SetCoverage
from commission.app.coverage.ellipses import ellipses
from commission.app.coverage.following import Covered, cover
from commission.app.coverage.heat_legend import ellipse_note
from commission.app.coverage.service import CoverageService
from commission.app.coverage.settings import CoverageSettings
from commission.app.editing.actions import ChooseTool
from commission.app.editing.site_tools import MeasureTool
from commission.geometry.gaussian import ellipse_axes
from commission.planning.dilution import Heading
from commission.progress import silent
from commission.site.project import Project
from commission.site.scanner import Scanner
from commission.studies.coverage import CoverageInput
from tests.app.asking import after as outcome
from tests.app.asking import joined
from tests.app.bench import Bench

SPOTS = ((2.0, 2.0), (6.0, 6.0), (10.0, 4.0))


@pytest.fixture
def bench(project: Project) -> Iterator[Bench[CoverageService]]:
    bench = Bench(CoverageService, project)
    yield bench
    bench.close()


def covered(project: Project, heading: Heading) -> Covered:
    options = CoverageSettings(heading=heading, given_heading=0.7).options(Conditions())
    return cover(CoverageInput.of(project, options), silent)


def after(project: Project, *wishes: Action) -> CoverageSettings:
    return outcome(joined(AppState(project=project, saved=project)), *wishes).state.part(CoverageSettings)


@pytest.mark.parametrize("heading", list(Heading))
def test_an_ellipse_is_as_long_as_the_heatmap_says(project: Project, heading: Heading) -> None:
    narrow = Scanner(field_of_view_deg=(-120.0, 120.0), mounting=np.array([0.4, 0.1, 0.3]))
    found = covered(replace(project, scanners=(narrow,)), heading)
    drawn = ellipses(found, SPOTS, 1.0, grid=True)
    lattice, sigma = found.live.coverage.lattice, found.live.coverage.fixes.position_sigma
    assert len(drawn.centers) > 20
    at = [lattice.index_near(x, y) for x, y in drawn.centers]
    longest = ellipse_axes(drawn.covariances)[0].max(axis=-1)
    assert longest == pytest.approx(sigma[at], rel=1e-9)


def test_where_there_is_no_fix_there_is_no_ellipse_and_it_is_said(project: Project) -> None:
    alone = replace(project, reflectors=replace(project.reflectors, reflectors=project.reflectors.reflectors[:1]))
    drawn = ellipses(covered(alone, Heading.ALL_ROUND), SPOTS, 100.0, grid=False)
    assert not len(drawn.centers)
    assert drawn.without_fix == len(SPOTS)
    assert "3 places without a fix" in ellipse_note(drawn)


def test_of_a_grid_those_are_left_out_that_would_hide_the_others(project: Project) -> None:
    found = covered(project, Heading.ALL_ROUND)
    small, large = (ellipses(found, (), factor, grid=True) for factor in (10.0, 3000.0))
    assert small.too_large == 0
    assert large.too_large == len(small.centers) - len(large.centers) > 0
    assert len(ellipses(found, SPOTS, 3000.0, grid=False).centers) == len(SPOTS)


def test_ellipses_follow_a_moved_reflector(bench: Bench[CoverageService]) -> None:
    bench.ask(SetCoverage("figure", "position_sigma"), *(ReadFloor(spot, 0.01) for spot in SPOTS))
    before = bench.found().ellipses
    bench.ask(SetOpacity(0.5))
    assert bench.view.ellipses is before
    bench.move(0, 0.7)
    moved = bench.view.ellipses
    assert before is not None
    assert moved is not None
    assert not np.array_equal(before.covariances, moved.covariances)
    again = ellipses(covered(bench.state.project, Heading.ALL_ROUND), SPOTS, 100.0, grid=False)
    assert np.array_equal(moved.covariances, again.covariances)


def test_a_click_on_the_heatmap_leaves_an_ellipse_and_one_on_a_reflector_does_not(project: Project) -> None:
    reflector = project.reflectors.reflectors[0]
    on = SetCoverage("figure", "visible")
    assert after(project, ReadFloor((2.0, 2.0), 0.1)).spots == ()
    plan = after(project, on, ReadFloor((2.0, 2.0), 0.1), ReadFloor((reflector.x, reflector.y), 0.1))
    assert plan.spots == ((2.0, 2.0),)
    assert after(project, on, ReadFloor((2.0, 2.0), 0.1), ClearEllipses()).spots == ()


def test_a_click_of_another_tool_reads_nothing(project: Project) -> None:
    plan = after(project, SetCoverage("figure", "visible"), ChooseTool(MeasureTool()), ReadFloor((2.0, 2.0), 0.1))
    assert plan.probe is None
    assert plan.spots == ()


def test_the_legend_says_how_much_larger_they_are_drawn(project: Project) -> None:
    drawn = ellipses(covered(project, Heading.ALL_ROUND), SPOTS, 300.0, grid=False)
    assert "drawn 300x" in ellipse_note(drawn)
