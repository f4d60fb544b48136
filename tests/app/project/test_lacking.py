"""What steps lack, and the card of a site that does not drive yet."""

from __future__ import annotations

from dataclasses import replace

from commission.app.project.guide_panel import card
from commission.app.project.lacking import lacking, tasks
from commission.site.parameters import ContourParameters, Parameters, TagParameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.tags import Tag
from tests.app.sites import room


def test_an_empty_site_lacks_everything_and_a_site_with_a_run_nothing() -> None:
    of_each = lacking(Project(), drives=False)
    assert of_each["Site"] == "a floor map, reflectors (0 of at least 2), a route"
    assert of_each["Tune"] == "reflectors (0 of at least 2), a route, a run"
    assert set(lacking(room(), drives=True).values()) == {""}
    assert lacking(room(), drives=False)["Run"] == "a run"


def test_one_reflector_is_too_few_and_two_are_enough_to_drive() -> None:
    project = room()
    for count, way in ((1, ""), (2, "tab:Run press:Drive")):
        some = replace(project, reflectors=ReflectorMap(project.reflectors.reflectors[:count]))
        drive = tasks(some, drives=False)[-1]
        assert drive.way == way
        assert ("first: reflectors" in drive.note) == (count == 1)


def test_who_localizes_by_walls_or_tags_misses_no_reflectors() -> None:
    bare = replace(room(), reflectors=ReflectorMap())
    by_walls = replace(bare, parameters=Parameters(contour=ContourParameters(enabled=True)))
    by_tags = replace(bare, tags=(Tag(id="dock", x=1.0, y=2.0),))
    assert lacking(bare, drives=True)["Run"] == "reflectors (0 of at least 2)"
    assert lacking(replace(by_walls, floor_map=None), drives=True)["Run"] == "reflectors (0 of at least 2)"
    unseen = replace(by_tags, parameters=Parameters(tag=TagParameters(enabled=False)))
    assert lacking(unseen, drives=True)["Run"] == "reflectors (0 of at least 2)"
    for project, by in ((by_walls, "contours of the floor map"), (by_tags, "tags")):
        assert set(lacking(project, drives=True).values()) == {""}
        reflectors, drive = tasks(project, drives=False)[1], tasks(project, drives=False)[-1]
        assert (reflectors.note, reflectors.done) == (f"none needed: {by} tell the pose", True)
        assert drive.way == "tab:Run press:Drive"


def test_the_card_is_large_over_an_empty_floor_small_while_a_tool_is_used_and_gone_with_a_run() -> None:
    assert "c-card-line" not in card(Project(), drives=False, small=False)
    assert "c-card-line" in card(Project(), drives=False, small=True)
    assert "c-card-line" in card(room(), drives=False, small=False)
    assert card(room(), drives=True, small=False) == ""
