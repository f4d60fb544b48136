"""The heatmap's service: what it starts, follows and drops."""

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np
import pytest

from commission.app.base.conditions import Conditions, SetCondition
from commission.app.base.floor_picture import SetOpacity
from commission.app.coverage.actions import ReadFloor, SetCoverage
from commission.app.coverage.following import cover
from commission.app.coverage.service import CoverageService
from commission.app.coverage.settings import CoverageSettings, Figure
from commission.app.editing.editor import Drag, Editor, Grab, Snapping
from commission.planning.dilution import Heading, Measurement
from commission.progress import silent
from commission.site.disturbances import Disturbances, Reel
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.tags import Tag
from commission.studies.coverage import CoverageInput, coverage
from tests.app.asking import ME
from tests.app.bench import Bench

VISIBLE = SetCoverage("figure", "visible")


@pytest.fixture
def bench(project: Project) -> Iterator[Bench[CoverageService]]:
    bench = Bench(CoverageService, project)
    yield bench
    bench.close()


def test_nothing_is_computed_that_nobody_wants(bench: Bench[CoverageService]) -> None:
    bench.ask()
    assert not bench.jobs.unfinished()
    assert bench.view.heat is None


def test_a_heatmap_and_the_values_under_a_click(bench: Bench[CoverageService]) -> None:
    bench.ask(VISIBLE)
    assert bench.found().heat.shares.sum() == pytest.approx(1.0)
    x, y = (float(value) for value in bench.state.project.routes[0].segments[0].control_points[0])
    bench.ask(ReadFloor((x, y), 0.01))
    assert bench.view.reading.on_floor
    assert bench.view.reading.values[Figure.VISIBLE] > 0


def test_another_figure_of_the_same_coverage_needs_no_job(bench: Bench[CoverageService]) -> None:
    bench.ask(VISIBLE)
    bench.found()
    bench.ask(SetCoverage("figure", "position_dop"))
    assert not bench.jobs.unfinished()
    assert bench.view.heat.scale.figure is Figure.POSITION_DOP


def test_a_moved_reflector_is_followed_at_once_and_equals_a_new_computation(bench: Bench[CoverageService]) -> None:
    bench.ask(SetCoverage("figure", "position_sigma"))
    before = bench.found().heat
    bench.move(0, 0.7)
    after = bench.view.heat
    assert not bench.jobs.unfinished()
    assert np.any(before.classes != after.classes)
    options = CoverageSettings().options(Conditions())
    afresh = cover(CoverageInput.of(bench.state.project, options), silent)
    expected = after.scale.classes(afresh.live.coverage.fixes.position_sigma, afresh.floor)
    assert np.array_equal(after.classes.ravel(), expected)


def test_the_error_with_constants_is_that_of_its_study_and_computed_anew_when_a_reflector_moves(
    bench: Bench[CoverageService], project: Project
) -> None:
    bench.ask(SetCoverage("figure", "total_sigma"), ReadFloor((2.0, 2.0), 0.01))
    heat = bench.found().heat
    options = replace(CoverageSettings(), figure=Figure.TOTAL_SIGMA).options(Conditions())
    result = coverage(CoverageInput.of(project, options))
    assert result.budget is not None
    assert np.array_equal(heat.classes.ravel(), heat.scale.classes(result.budget.sigma, result.drivable))
    reading = bench.view.reading
    index = result.coverage.lattice.index_near(2.0, 2.0)
    assert reading.values[Figure.TOTAL_SIGMA] == result.budget.sigma[index]
    assert reading.shares == tuple(result.budget.shares[index].tolist())
    bench.move(0, 0.7)
    assert bench.jobs.unfinished()
    assert bench.view.heat.outdated
    bench.found()
    assert not bench.view.heat.outdated


def test_what_contours_tell_is_that_of_its_study_and_stays_when_a_reflector_moves(
    bench: Bench[CoverageService], project: Project
) -> None:
    bench.ask(SetCoverage("figure", "contour_position"), ReadFloor((2.0, 2.0), 0.01))
    heat = bench.found().heat
    options = replace(CoverageSettings(), figure=Figure.CONTOUR_POSITION).options(Conditions())
    result = coverage(CoverageInput.of(project, options))
    assert result.contours is not None
    assert np.array_equal(heat.classes.ravel(), heat.scale.classes(result.contours.position_sigma, result.drivable))
    reading, index = bench.view.reading, result.coverage.lattice.index_near(2.0, 2.0)
    assert reading.values[Figure.CONTOUR_POSITION] == result.contours.position_sigma[index]
    assert reading.values[Figure.CONTOUR_HEADING] == result.contours.heading_sigma[index]
    bench.move(0, 0.7)
    assert not bench.jobs.unfinished()
    assert np.array_equal(bench.view.heat.classes, heat.classes)


def test_what_tags_tell_is_that_of_its_study(project: Project) -> None:
    tagged = replace(project, tags=(Tag(id="1", x=3.0, y=3.0),))
    bench = Bench(CoverageService, tagged)
    bench.ask(SetCoverage("figure", "tag_position"), SetCoverage("heading", Heading.BEST), ReadFloor((2.0, 2.0), 0.01))
    heat = bench.found().heat
    options = replace(CoverageSettings(), figure=Figure.TAG_POSITION, heading=Heading.BEST).options(Conditions())
    result = coverage(CoverageInput.of(tagged, options))
    assert result.tags is not None
    assert np.array_equal(heat.classes.ravel(), heat.scale.classes(result.tags.position_sigma, result.drivable))
    index = result.coverage.lattice.index_near(2.0, 2.0)
    assert bench.view.reading.values[Figure.TAG_HEADING] == result.tags.heading_sigma[index] < 0.1
    bench.close()


def test_how_many_reels_are_in_sight_is_that_of_its_study(project: Project) -> None:
    stocked = replace(project, disturbances=Disturbances(reels=(Reel(x=3.0, y=3.0, radius=0.5),)))
    bench = Bench(CoverageService, stocked)
    bench.ask(SetCoverage("figure", "reels"), ReadFloor((1.5, 2.0), 0.01))
    heat = bench.found().heat
    result = coverage(CoverageInput.of(stocked, CoverageSettings(figure=Figure.REELS).options(Conditions())))
    assert result.reels is not None
    assert np.array_equal(heat.classes.ravel(), heat.scale.classes(result.reels.astype(float), result.drivable))
    assert bench.view.reading.values[Figure.REELS] == 1.0
    bench.close()


def test_without_a_map_a_reflector_that_moves_the_floors_edge_is_computed_anew(project: Project) -> None:
    bench = Bench(CoverageService, replace(project, floor_map=None))
    bench.ask(VISIBLE)
    before = bench.found().heat
    bench.move(0, -20.0)
    assert bench.jobs.unfinished()
    assert bench.view.heat.outdated
    assert bench.found().heat.lattice.x < before.lattice.x - 15.0
    bench.close()


def test_the_heatmap_follows_a_drag_before_it_is_an_edit(bench: Bench[CoverageService]) -> None:
    bench.ask(SetCoverage("figure", "position_sigma"))
    before = bench.found().heat
    name = bench.state.project.reflectors.reflectors[0].id
    drag = Drag(Grab.REFLECTORS, (0.0, 0.0), (0.7, 0.0))
    bench.state = bench.state.with_browser(ME, Editor(selected=(name,), drag=drag, snapping=Snapping(walls=False)))
    assert bench.service.follow(bench.state)
    during = bench.view.heat
    assert not bench.service.follow(bench.state)
    bench.state = bench.state.with_browser(ME, Editor())
    bench.service.follow(bench.state)
    after = bench.view.heat
    assert np.any(before.classes != during.classes)
    assert np.array_equal(before.classes, after.classes)
    assert not bench.jobs.unfinished()


def test_what_is_not_wanted_any_more_is_dropped_and_its_job_cancelled(bench: Bench[CoverageService]) -> None:
    bench.ask(VISIBLE)
    bench.ask(SetCoverage("figure", ""))
    assert bench.found().heat is None


@pytest.mark.parametrize(
    "change",
    [
        SetCondition("min_beams", 3),
        SetCondition("blocked_per_m", 0.1),
        SetCoverage("heading", Heading.WORST.value),
        SetCoverage("heading", Heading.GIVEN.value),
        SetCoverage("given_heading", 0.5),
        SetCoverage("measurement", Measurement.BEARING_ONLY.value),
        SetCoverage("measurement", Measurement.RANGE_BEARING_PRIOR.value),
        SetCoverage("on_odometry", 5.0),
    ],
    ids=lambda change: f"{change.name}={change.value}",
)
def test_under_other_conditions_the_floor_is_computed_anew(
    bench: Bench[CoverageService], change: SetCoverage | SetCondition
) -> None:
    bench.ask(VISIBLE)
    bench.found()
    bench.ask(change)
    assert bench.view.heat.outdated
    assert bench.jobs.unfinished()
    assert not bench.found().heat.outdated


def test_every_setting_is_a_condition_of_the_study_or_of_the_drawing() -> None:
    drawn = {"figure", "probe", "spots", "ellipse_grid", "ellipse_factor"}
    asked = {"heading", "given_heading", "measurement", "on_odometry"}
    assert {field.name for field in fields(CoverageSettings)} == drawn | asked
    assert {field.name for field in fields(Conditions)} == {"blocked_per_m", "min_beams"}


@pytest.mark.parametrize("change", [SetOpacity(0.3), SetCoverage("ellipse_factor", 10.0)])
def test_drawing_otherwise_computes_nothing(bench: Bench[CoverageService], change: SetCoverage | SetOpacity) -> None:
    bench.ask(VISIBLE)
    heat = bench.found().heat
    bench.ask(change)
    assert not bench.jobs.unfinished()
    assert bench.view.heat is heat


def test_edits_that_the_study_does_not_read_compute_nothing(bench: Bench[CoverageService]) -> None:
    bench.ask(VISIBLE)
    heat = bench.found().heat
    project = bench.state.project
    supervisor = replace(project.parameters.supervisor, position_limit=0.02)
    bench.edit(replace(project, name="Other", parameters=replace(project.parameters, supervisor=supervisor)))
    assert not bench.jobs.unfinished()
    assert bench.view.heat is heat


def test_edits_that_it_reads_are_computed_anew(bench: Bench[CoverageService]) -> None:
    bench.ask(VISIBLE)
    bench.found()
    project = bench.state.project
    observation = replace(project.parameters.observation, range_sigma=0.05)
    for edited in (
        replace(project, parameters=replace(project.parameters, observation=observation)),
        replace(project, scanners=(replace(project.scanners[0], range=(0.05, 5.0)),)),
        replace(project, floor_map=None),
        replace(project, reflectors=ReflectorMap(project.reflectors.reflectors[:-1])),
    ):
        bench.edit(edited)
        assert bench.view.heat.outdated
        assert not bench.found().heat.outdated
