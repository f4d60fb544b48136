"""Plates that are drawn inside a wall's cells are seen from in front of it, by planning and by the virtual scanner."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.planning.visibility import VisibilityOptions, visibility_models
from commission.simulation.scan import VirtualScanner
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.glued import depths_in_walls
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.scanner import Scanner

CELL = 0.1
SCANNER = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.25, reflector_range=15.0)


def hall() -> FloorMap:
    """10 x 6 m with walls three cells thick."""
    cells = np.full((60, 100), FREE, dtype=np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    return FloorMap(cells, CELL)


def plate(depth: float, kind: ReflectorKind = ReflectorKind.FLAT) -> ReflectorMap:
    """A plate on the south wall, whose surface is at 0.3 m, drawn so far behind it."""
    return ReflectorMap((Reflector(id="P", x=5.03, y=0.3 - depth, radius=0.05, kind=kind, heading=math.pi / 2),))


@pytest.mark.parametrize(("depth", "expected"), [(-0.01, 0.0), (0.05, 0.05), (0.09, 0.09), (0.12, 0.0)])
def test_depth_of_a_plate_of_unknown_direction_is_that_behind_the_nearest_surface(
    depth: float, expected: float
) -> None:
    (known,) = plate(depth).reflectors
    unknown = ReflectorMap((replace(known, id="U", heading=None), known))
    assert depths_in_walls(unknown, hall().occupancy()).tolist() == pytest.approx([expected, expected], abs=0.0021)


@pytest.mark.parametrize(("depth", "expected"), [(-0.01, 0.0), (0.05, 0.05), (0.09, 0.09), (0.12, 0.0)])
def test_depth_is_that_behind_the_surface_up_to_a_cell(depth: float, expected: float) -> None:
    grid = hall().occupancy()
    assert depths_in_walls(plate(depth), grid)[0] == pytest.approx(expected, abs=0.0021)
    assert depths_in_walls(plate(depth, ReflectorKind.CYLINDER), grid)[0] == 0.0


@pytest.mark.parametrize(("depth", "is_seen"), [(0.0, True), (0.05, True), (0.09, True), (0.15, False)])
@pytest.mark.parametrize("incidence_deg", [0.0, 40.0, 55.0])
def test_a_plate_that_is_drawn_into_a_wall_is_seen_from_in_front_of_it(
    depth: float, is_seen: bool, incidence_deg: float
) -> None:
    site = Project(floor_map=hall(), reflectors=plate(depth), scanners=(SCANNER,))
    turn = math.radians(incidence_deg)
    pose = np.array([5.03 + 3.0 * math.sin(turn), 0.3 - depth + 3.0 * math.cos(turn), 0.0])
    (model,) = visibility_models(site, VisibilityOptions())
    assert model.visible_from_poses(pose).counts().tolist() == [int(is_seen)]
    _, flags = VirtualScanner.of(site, SCANNER).scan(pose, np.empty((0, 3)), np.random.default_rng(0))
    assert flags.any() == is_seen


def test_nothing_is_seen_through_the_wall() -> None:
    site = Project(floor_map=hall(), reflectors=plate(0.05), scanners=(SCANNER,))
    (model,) = visibility_models(site)
    assert model.visible_from_poses([[5.03, -2.0, 0.0]]).counts().tolist() == [0]
