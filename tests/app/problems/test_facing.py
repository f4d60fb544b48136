"""Plates of unknown direction, as the page shows them, lets them be typed, and turns them away from their walls."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.actions import Undo
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.app.problems.actions import AcceptFacing, DropFacing, FaceFromWalls
from commission.app.problems.face_panel import arrows, preview
from commission.app.problems.facing import Facing
from commission.errors import UsageError
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from tests.app.asking import ME, after, joined
from tests.app.sites import room


def state_of(*reflectors: Reflector, mapped: bool = True) -> AppState:
    project = replace(room(), reflectors=ReflectorMap(reflectors))
    project = project if mapped else replace(project, floor_map=None)
    return joined(AppState(project=project, saved=project))


def test_plates_are_faced_once_before_and_after_were_accepted_and_that_is_one_step() -> None:
    floor_map = room().floor_map
    assert floor_map is not None
    x, width = float(floor_map.origin[0]), floor_map.size[0]
    on_wall = [Reflector(id=f"P{k}", x=x + (k + 2) * width / 8, y=0.16, kind=ReflectorKind.FLAT) for k in range(3)]
    before = state_of(*on_wall, replace(on_wall[0], id="far", y=4.0))
    shown = after(before, FaceFromWalls()).state
    assert shown.project is before.project
    assert shown.undo == ()
    found = shown.of_browser(ME, Facing).of(shown.project)
    assert found is not None
    said = preview(found)
    assert re.findall(r"<tr><td>(\w+)</td><td>(\w+)</td><td>([^<]+)</td></tr>", said) == [
        (each.id, "unknown", "90.0°") for each in on_wall
    ]
    assert "far are locked, hang near no wall, or near several. Nothing has changed yet." in said
    feet, tips = arrows(found, 0.5)[::3].transpose(1, 0, 2)
    assert feet == pytest.approx(np.array([(each.x, each.y) for each in on_wall]))
    assert tips - feet == pytest.approx(np.array([(0.0, 0.5)] * 3))
    assert after(shown, DropFacing()).state.of_browser(ME, Facing).found is None

    outcome = after(shown, AcceptFacing())
    faced = outcome.state.project.reflectors
    assert faced.reflectors[3].heading is None
    assert [each.heading for each in faced.reflectors[:3]] == pytest.approx([math.pi / 2] * 3)
    assert outcome.state.of_browser(ME, Facing).found is None
    assert after(outcome.state, Undo()).state.project.reflectors == before.project.reflectors


def test_directions_that_were_found_for_another_layout_are_not_accepted() -> None:
    plate = Reflector(id="P", x=2.0, y=0.16, kind=ReflectorKind.FLAT)
    shown = after(state_of(plate), FaceFromWalls()).state
    assert shown.of_browser(ME, Facing).of(shown.project) is not None
    edited = after(shown, actions.SelectReflectors(("P",)), actions.SetSelected("x", 5.0)).state
    assert edited.of_browser(ME, Facing).of(edited.project) is None
    with pytest.raises(UsageError, match="as it is now"):
        after(edited, AcceptFacing())


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
