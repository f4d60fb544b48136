"""Ambiguous places in the page: the job, the map, the pairs and what a click on one shows."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from commission.app.ambiguity.ambiguity_layer import MAP_COLORS, ambiguity_picture
from commission.app.ambiguity.ambiguity_legend import cold_start_scale
from commission.app.ambiguity.cold_start import EVERY, NOTHING, SOME, TOO_FEW, UNIQUE, AmbiguousFloor, look_alike
from commission.app.ambiguity.service import AmbiguityService
from commission.app.ambiguity.settings import AmbiguitySettings, DropPlaces, FindPlaces, SetAmbiguity, ShowPair
from commission.app.base.conditions import SetCondition
from commission.app.coverage.actions import SetCoverage
from commission.progress import silent
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.ambiguity import AmbiguityInput
from tests.app.bench import Bench


def symmetric_hall() -> Project:
    """An empty hall of 10 x 6 m that looks the same when it is turned by half a turn."""
    cells = np.full((60, 100), FREE, np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = (OCCUPIED,) * 4
    places = ((1.0, 0.5), (6.0, 0.5), (9.0, 5.5), (4.0, 5.5))
    reflectors = ReflectorMap(tuple(Reflector(id=f"R{i + 1}", x=x, y=y) for i, (x, y) in enumerate(places)))
    scanner = Scanner(field_of_view_deg=(-180.0, 180.0), mounting=np.zeros(3))
    return Project(name="Symmetric hall", floor_map=FloorMap(cells, 0.1), reflectors=reflectors, scanners=(scanner,))


def found_in(project: Project) -> AmbiguousFloor:
    return look_alike(AmbiguityInput.of(project), silent)


@pytest.fixture
def bench() -> Iterator[Bench[AmbiguityService]]:
    bench = Bench(AmbiguityService, symmetric_hall())
    yield bench
    bench.close()


def test_a_symmetric_hall_is_ambiguous_everywhere_and_moving_one_reflector_clears_it() -> None:
    project = symmetric_hall()
    found = found_in(project)
    assert set(np.unique(found.classes)) == {NOTHING, EVERY}
    assert found.shares()[EVERY - UNIQUE] == 1.0
    assert [set(found.names(pair.constellation)) for pair in found.pairs] == [{"R1", "R2", "R3", "R4"}]
    first, *others = project.reflectors.reflectors
    moved = replace(project, reflectors=ReflectorMap((replace(first, x=first.x + 0.5), *others)))
    cleared = found_in(moved)
    assert set(np.unique(cleared.classes)) == {NOTHING, UNIQUE}
    assert not cleared.pairs


def test_one_reflector_alone_tells_no_place_and_has_no_look_alike() -> None:
    project = symmetric_hall()
    alone = replace(project, reflectors=ReflectorMap(project.reflectors.reflectors[:1]))
    found = found_in(alone)
    assert found.shares()[EVERY - UNIQUE] == 1.0
    assert not found.pairs


def test_a_pair_is_listed_once_whichever_is_taken_for_the_other() -> None:
    places = ((1.0, 0.5), (3.0, 0.5), (7.0, 5.5), (9.0, 5.5))
    near = Scanner(field_of_view_deg=(-180.0, 180.0), mounting=np.zeros(3), range=(0.05, 4.0))
    reflectors = ReflectorMap(tuple(Reflector(id=f"R{i + 1}", x=x, y=y) for i, (x, y) in enumerate(places)))
    found = found_in(replace(symmetric_hall(), reflectors=reflectors, scanners=(near,)))
    groups = [{pair.constellation, tuple(sorted(pair.image))} for pair in found.pairs]
    assert {(0, 1), (2, 3)} in groups
    assert len(groups) == len({frozenset(group) for group in groups})


def test_it_is_looked_for_once_and_outdated_after_an_edit(bench: Bench[AmbiguityService]) -> None:
    bench.ask(FindPlaces())
    found = bench.found()
    assert found is not None
    assert found.is_drawn
    assert not found.outdated
    bench.move(0, 0.5)
    assert not bench.jobs.unfinished()
    after = bench.view
    assert after is not None
    assert after.outdated
    bench.ask(FindPlaces())
    again = bench.found()
    assert again is not None
    assert not again.ambiguity.pairs
    bench.ask(DropPlaces())
    assert bench.view is None


def test_a_chosen_pair_shows_two_poses_that_see_the_same(bench: Bench[AmbiguityService]) -> None:
    bench.ask(FindPlaces())
    bench.found()
    bench.ask(ShowPair(0))
    view = bench.view
    assert view is not None
    assert view.twins is not None
    seen = [np.hypot(*(group - pose[:2]).T) for group, pose in zip(view.twins.groups, view.twins.poses, strict=True)]
    assert seen[0] == pytest.approx(seen[1], abs=0.1)
    assert np.hypot(*np.subtract(*view.twins.poses)[:2]) > 0.5


def test_its_map_takes_the_floor_from_the_heatmap_and_leaves_it_when_one_is_chosen(
    bench: Bench[AmbiguityService],
) -> None:
    bench.ask(SetCoverage("figure", "visible"), FindPlaces())
    assert bench.found().is_drawn
    bench.ask(SetCoverage("figure", "visible"))
    assert not bench.view.is_drawn
    bench.ask(SetCoverage("figure", ""))
    assert bench.view.is_drawn


def test_a_second_click_on_a_pair_hides_it(bench: Bench[AmbiguityService]) -> None:
    bench.ask(ShowPair(3))
    assert bench.state.part(AmbiguitySettings).pair == 3
    bench.ask(ShowPair(3))
    assert bench.state.part(AmbiguitySettings).pair == -1


@pytest.mark.parametrize("change", [SetAmbiguity("tolerance", 0.3), SetCondition("min_beams", 3)])
def test_under_other_conditions_it_is_outdated_until_asked_again(
    bench: Bench[AmbiguityService], change: SetAmbiguity | SetCondition
) -> None:
    bench.ask(FindPlaces())
    assert not bench.found().outdated
    bench.ask(change)
    assert not bench.jobs.unfinished()
    assert bench.view.outdated
    bench.ask(FindPlaces())
    assert not bench.found().outdated


def test_picture_and_legend_have_each_class(bench: Bench[AmbiguityService]) -> None:
    picture = ambiguity_picture(np.array([[NOTHING, UNIQUE, TOO_FEW, SOME, EVERY]], np.uint8), 0.5)
    assert picture[0, 0, 3] == 0
    assert {tuple(color[:3]) for color in picture[0].tolist()[4:]} == set(MAP_COLORS.values())
    bench.ask(FindPlaces())
    found = bench.found()
    assert found is not None
    assert "100.0 %" in cold_start_scale(found)
