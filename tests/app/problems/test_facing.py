"""Plates of unknown direction, as the page shows them, lets them be typed, and turns them away from their walls."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from commission.app.base.actions import Undo
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.app.problems.actions import FaceFromWalls
from commission.errors import UsageError
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from tests.app.asking import after, joined
from tests.app.sites import room


def state_of(*reflectors: Reflector, mapped: bool = True) -> AppState:
    project = replace(room(), reflectors=ReflectorMap(reflectors))
    project = project if mapped else replace(project, floor_map=None)
    return joined(AppState(project=project, saved=project))


def test_facing_plates_from_walls_is_one_step_that_can_be_undone() -> None:
    floor_map = room().floor_map
    assert floor_map is not None
    x, width = float(floor_map.origin[0]), floor_map.size[0]
    on_wall = [Reflector(id=f"P{k}", x=x + (k + 2) * width / 8, y=0.16, kind=ReflectorKind.FLAT) for k in range(3)]
    before = state_of(*on_wall)
    outcome = after(before, FaceFromWalls())
    faced = outcome.state.project.reflectors
    assert [each.heading for each in faced.reflectors] == pytest.approx([math.pi / 2] * 3)
    assert after(outcome.state, Undo()).state.project.reflectors == before.project.reflectors


def test_without_a_floor_map_there_is_no_direction_to_take() -> None:
    with pytest.raises(UsageError, match="no floor map"):
        after(state_of(Reflector(id="P", x=1.0, y=0.16, kind=ReflectorKind.FLAT), mapped=False), FaceFromWalls())


def test_a_radius_and_a_direction_can_be_set_to_unknown_and_back() -> None:
    post = Reflector(id="P", x=1.0, y=1.0, radius=0.05, kind=ReflectorKind.FLAT, heading=0.5)
    state = after(state_of(post), actions.SelectReflectors(("P",))).state
    for name, value in (("radius", 0.05), ("heading", 0.5)):
        unknown = after(state, actions.SetSelected(name, None)).state
        assert getattr(unknown.project.reflectors.reflectors[0], name) is None
        known = after(unknown, actions.SetSelected(name, value)).state
        assert known.project.reflectors.reflectors[0] == post
