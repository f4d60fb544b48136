"""What a layout comes to: its figures are those of the studies they come from, and two floors are compared in sign."""

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.errors import UsageError
from commission.planning.layout_figures import layout_figures
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies.ambiguity import AmbiguityInput, ambiguity
from commission.studies.coverage import CoverageInput, coverage
from commission.studies.layouts import FloorFigure, LayoutInput, LayoutResult, floor_difference, layout
from tests.app.sites import room


def with_one_more(project: Project) -> ReflectorMap:
    more = Reflector(id="More", x=6.0, y=7.75)
    return ReflectorMap((*project.reflectors.reflectors, more))


@pytest.fixture(scope="module")
def four() -> LayoutResult:
    return layout(LayoutInput.of(room()))


@pytest.fixture(scope="module")
def five(four: LayoutResult) -> LayoutResult:
    project = replace(room(), floor_map=four.inputs.floor_map)
    return layout(LayoutInput.of(project, with_one_more(project)))


def test_its_figures_are_those_of_the_studies_that_they_come_from(four: LayoutResult) -> None:
    project = room()
    assert four.figures == layout_figures(project, project.reflectors, (project.routes[0].name,))
    cold = ambiguity(AmbiguityInput.of(project))
    spots = sum(bool(each) for each in cold.ambiguous)
    assert four.ambiguous_area == pytest.approx(spots * cold.lattice.spacing**2)
    alone = coverage(CoverageInput.of(project)).coverage.fixes
    np.testing.assert_array_equal(four.floor.coverage.fixes.position_sigma, alone.position_sigma)


def test_one_more_reflector_is_never_worse_and_somewhere_better(four: LayoutResult, five: LayoutResult) -> None:
    assert (five.figures.reflectors, four.figures.reflectors) == (5, 4)
    for figure in FloorFigure:
        better, worse = floor_difference(five, four, figure), floor_difference(four, five, figure)
        assert np.nanmin(better.gains) >= -1e-12
        assert np.nanmax(better.gains) > 0.0
        np.testing.assert_allclose(worse.gains, -better.gains)
        assert not better.lost.any()
        np.testing.assert_array_equal(better.gained, worse.lost)


def test_the_difference_of_visible_reflectors_is_a_whole_number_counted_by_hand(
    four: LayoutResult, five: LayoutResult
) -> None:
    found = floor_difference(five, four, FloorFigure.VISIBLE)
    assert set(np.unique(found.gains[np.isfinite(found.gains)])) == {0.0, 1.0}
    # From the middle of the hall the new one on the upper wall is in sight, from behind the pillar it is not.
    at, behind = found.lattice.index_near(6.0, 6.0), found.lattice.index_near(8.3, 2.8)
    assert at is not None
    assert behind is not None
    assert found.gains[at] == 1.0
    assert found.gains[behind] == 0.0


def test_a_layout_is_no_worse_and_no_better_than_itself(four: LayoutResult) -> None:
    found = floor_difference(four, four, FloorFigure.POSITION_SIGMA)
    on = four.floor.drivable
    assert np.all(found.gains[on & ~found.neither] == 0.0)
    assert np.isnan(found.gains[~on]).all()


def test_where_one_layout_alone_has_a_fix_it_is_gained_or_lost_and_has_no_number(four: LayoutResult) -> None:
    project = replace(room(), floor_map=four.inputs.floor_map)
    none = layout(LayoutInput.of(project, ReflectorMap(())))
    found = floor_difference(none, four, FloorFigure.POSITION_SIGMA)
    fixed = np.isfinite(four.floor.coverage.fixes.position_sigma) & four.floor.drivable
    np.testing.assert_array_equal(found.lost, fixed)
    assert not found.gained.any()
    assert np.isnan(found.gains).all()
    assert none.figures.stopping == 0


def test_without_a_floor_map_floors_of_other_extents_are_not_compared() -> None:
    field = replace(room(), floor_map=None)
    far = ReflectorMap((*field.reflectors.reflectors, Reflector(id="Far", x=40.0, y=3.0)))
    one, other = layout(LayoutInput.of(field)), layout(LayoutInput.of(field, far))
    assert math.isnan(one.ambiguous_area)
    with pytest.raises(UsageError, match="expected a floor map"):
        floor_difference(one, other, FloorFigure.VISIBLE)


def test_without_a_route_only_the_floor_is_known() -> None:
    found = layout(LayoutInput.of(replace(room(), routes=())))
    assert (found.figures.routes, found.figures.places) == ((), 0)
    assert found.floor.drivable.any()


def test_another_layout_is_another_key_and_the_same_one_the_same() -> None:
    project = room()
    assert LayoutInput.of(project) == LayoutInput.of(project, project.reflectors)
    assert LayoutInput.of(project) != LayoutInput.of(project, with_one_more(project))
