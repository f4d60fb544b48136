"""Visibility: every answer is that of the exact ray, and the limits of scanner and reflector."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.planning.visibility import (
    VisibilityModel,
    VisibilityOptions,
    build_visibility,
    promised_range,
    unpack,
    visibility_models,
)
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.scanner import Scanner
from tests.planning.sites import reflectors_at, room

SHARP = Scanner(range=(0.05, 20.0), resolution_deg=0.02)
"""So fine a scanner that only range and walls limit it."""


def cell_by_cell_is_free(occupied: np.ndarray, start: np.ndarray, direction: np.ndarray, length: float) -> bool:
    """Amanatides and Woo (1987) in units of cells; where two borders are crossed at once, the horizontal one first."""
    column, row = (math.floor(value) for value in start)
    steps = [1 if d > 0.0 else -1 for d in direction]
    inverses = [1.0 / d if d != 0.0 else math.inf for d in direction]
    t = 0.0
    while t <= length:
        if 0 <= row < occupied.shape[0] and 0 <= column < occupied.shape[1] and occupied[row, column]:
            return False
        borders = (column + (steps[0] > 0), row + (steps[1] > 0))
        times = [
            (b - s) * i if math.isfinite(i) else math.inf for b, s, i in zip(borders, start, inverses, strict=True)
        ]
        if times[0] < times[1]:
            t, column = times[0], column + steps[0]
        else:
            t, row = times[1], row + steps[1]
    return True


def random_hall(rng: np.random.Generator, on_grid: bool) -> tuple[OccupancyGrid, ReflectorMap, np.ndarray]:
    """Boxes and specks, reflectors anywhere (in walls too) and points anywhere; on corners of cells when asked."""
    height, width = rng.integers(20, 70, 2)
    occupied = rng.random((height, width)) < rng.choice([0.0, 0.01])
    for _ in range(rng.integers(1, 10)):
        row, column = rng.integers(0, height), rng.integers(0, width)
        occupied[row : row + rng.integers(1, 9), column : column + rng.integers(1, 9)] = True
    origin = [0.0, 0.0, 0.0] if on_grid else [*rng.normal(size=2), rng.uniform(-math.pi, math.pi)]
    # A power of two: coordinates on corners of cells stay exact, so ties are ties.
    grid = OccupancyGrid(occupied, 0.0625, origin)
    cells = rng.uniform(-3, 73, (12 + 90, 2))
    cells = np.round(cells * 2.0) / 2.0 if on_grid else cells
    points = grid.cell_centers(cells - 0.5)
    radii = rng.choice([0.02, 0.04, 0.0625, 0.3], 12)
    reflectors = [
        Reflector(id=str(i), x=float(points[i, 0]), y=float(points[i, 1]), radius=float(radii[i])) for i in range(12)
    ]
    return grid, ReflectorMap(tuple(reflectors)), points[12:]


@pytest.mark.parametrize("on_grid", [False, True], ids=["anywhere", "on corners of cells"])
@pytest.mark.parametrize("seed", range(12))
def test_line_of_sight_is_that_of_cell_by_cell_traversal_for_every_pair(seed, on_grid):
    grid, reflectors, points = random_hall(np.random.default_rng(seed), on_grid)
    model = build_visibility(reflectors, SHARP, RayCaster(grid), VisibilityOptions())
    seen = unpack(model.visible(points), len(reflectors))
    cosine, sine = math.cos(grid.origin[2]), math.sin(grid.origin[2])
    to_grid = np.array([[cosine, sine], [-sine, cosine]])
    for m, reflector in enumerate(reflectors.reflectors):
        for n, point in enumerate(points):
            to_center = np.array([reflector.x, reflector.y]) - point
            distance = math.hypot(*to_center)
            in_range = SHARP.range[0] + reflector.radius <= distance <= SHARP.range[1] + reflector.radius
            start = to_grid @ (point - grid.origin[:2]) / grid.resolution
            length = (distance - reflector.radius) / grid.resolution
            free = in_range and cell_by_cell_is_free(grid.occupied, start, to_grid @ to_center / distance, length)
            assert seen[n, m] == free, (reflector, point)


def open_field(*reflectors: Reflector, scanner: Scanner = SHARP, **options: float) -> VisibilityModel:
    """Reflectors without a map."""
    project = Project(reflectors=ReflectorMap(reflectors), scanners=(scanner,))
    (only,) = visibility_models(project, VisibilityOptions(**options))
    return only


def sees(model: VisibilityModel, *points: tuple[float, float]) -> list[bool]:
    """Whether the first reflector is seen from each point."""
    return unpack(model.visible(points), 1)[:, 0].tolist()


def test_range_is_measured_to_the_surface_of_a_cylinder_and_to_the_middle_of_a_plate():
    scanner = replace(SHARP, range=(1.0, 10.0))
    points = [(0.95, 0.0), (1.05, 0.0), (9.99, 0.0), (10.05, 0.0), (10.15, 0.0)]
    assert sees(open_field(Reflector(id="c", x=0, y=0, radius=0.1), scanner=scanner), *points) == [
        *(False, False, True, True, False)
    ]
    plate = Reflector(id="p", x=0, y=0, radius=0.1, kind=ReflectorKind.FLAT, heading=0.0)
    assert sees(open_field(plate, scanner=scanner), *points) == [False, True, True, False, False]


def test_reflectors_are_told_from_other_things_only_up_to_the_reflector_range():
    assert sees(
        open_field(Reflector(id="c", x=0, y=0), scanner=replace(SHARP, reflector_range=5.0)), (5.03, 0), (5.05, 0)
    ) == [*(True, False)]


def test_promised_range_is_where_equation_3_drops_below_the_number_of_beams():
    radius, resolution = 0.04, math.radians(0.25)
    for beams in (1, 2, 5):
        r = promised_range(radius, resolution, beams)
        number = [math.floor(2.0 * math.asin(radius / x) / resolution) for x in (r * (1 - 1e-9), r * (1 + 1e-9))]
        assert number == [beams, beams - 1]


def test_promised_range_grows_with_the_width_of_the_beam_and_is_unlimited_when_beams_overlap():
    assert promised_range(0.04, 0.01, 2, 0.005) > promised_range(0.04, 0.01, 2)
    assert promised_range(0.04, 0.01, 1, 0.01) == math.inf


def test_a_reflector_is_not_seen_where_it_may_get_too_few_beams():
    scanner = Scanner(resolution_deg=0.5, beam_width_deg=0.0)
    limit = promised_range(0.04, math.radians(0.5), 2)
    model = open_field(Reflector(id="c", x=0, y=0), scanner=scanner, min_beams=2)
    assert sees(model, (limit - 1e-6, 0), (limit + 1e-6, 0)) == [True, False]


def test_a_plate_is_seen_from_its_front_up_to_the_cosine_limit():
    plate = Reflector(id="p", x=0, y=0, radius=0.2, kind=ReflectorKind.FLAT, heading=math.radians(90))
    angles = np.radians([90, 131, 49, 136, 44, 270])
    points = [(3 * math.cos(a), 3 * math.sin(a)) for a in angles]
    assert sees(open_field(plate, max_incidence_deg=45.0), *points) == [True, True, True, False, False, False]


def test_a_plate_of_unknown_direction_is_seen_from_every_free_side():
    angles = np.radians([0, 60, 90, 180, 270])
    points = [(3 * math.cos(a), 3 * math.sin(a)) for a in angles]
    plate = Reflector(id="p", x=0, y=0, radius=0.2, kind=ReflectorKind.FLAT)
    assert sees(open_field(plate), *points) == [True] * 5
    # Made known, it is seen from its front alone; made unknown again, from everywhere again.
    known = open_field(plate).with_reflector(0, replace(plate, heading=0.0))
    assert sees(known, *points) == [True, True, False, False, False]
    assert sees(known.with_reflector(0, plate), *points) == [True] * 5
    occupied = np.zeros((40, 40), dtype=bool)
    occupied[:, :4] = True
    walls = RayCaster(OccupancyGrid(occupied, 0.05))
    on_wall = ReflectorMap((replace(plate, x=0.21, y=1.0),))
    assert sees(build_visibility(on_wall, SHARP, walls, VisibilityOptions()), (1.5, 1.0), (-1.0, 1.0)) == [True, False]


def test_a_reflector_of_unknown_radius_gets_its_beams_up_to_the_range_of_the_smallest_it_may_be():
    scanner = Scanner(resolution_deg=0.5, beam_width_deg=0.0)
    limit = promised_range(0.02, math.radians(0.5), 2)
    model = open_field(Reflector(id="c", x=0, y=0, radius=None), scanner=scanner, min_beams=2)
    assert sees(model, (limit - 1e-6, 0), (limit + 1e-6, 0)) == [True, False]


def test_a_plate_gets_its_beams_up_to_a_range_that_shrinks_with_the_cosine_of_incidence():
    scanner = Scanner(resolution_deg=1.0, beam_width_deg=0.0, range=(0.05, 40.0))
    model = open_field(Reflector(id="p", x=0, y=0, radius=0.1, kind=ReflectorKind.FLAT, heading=0.0), scanner=scanner)
    limit = promised_range(0.1, math.radians(1.0), 1) * 0.5
    direction = np.array([math.cos(math.radians(60 - 1e-6)), math.sin(math.radians(60 - 1e-6))])
    assert sees(model, tuple(direction * limit * 0.999), tuple(direction * limit * 1.001)) == [True, False]


def test_a_reflector_that_touches_the_wall_behind_it_is_seen_from_the_front():
    occupied = np.zeros((40, 40), dtype=bool)
    occupied[:, :4] = True
    # Center on the wall's face, and 1 cm inside it.
    for x in (0.2, 0.19):
        model = build_visibility(
            ReflectorMap((Reflector(id="w", x=x, y=1.0),)),
            SHARP,
            RayCaster(OccupancyGrid(occupied, 0.05)),
            VisibilityOptions(),
        )
        assert sees(model, (1.5, 1.0), (0.4, 1.7), (0.1, 1.0), (-1.0, 1.0)) == [True, True, False, False]


def test_poses_see_only_what_lies_inside_the_field_of_view_of_the_mounted_scanner():
    corners = [
        Reflector(id=str(i), x=5 * math.cos(a), y=5 * math.sin(a)) for i, a in enumerate(np.radians([0, 90, 180, 270]))
    ]
    scanner = replace(SHARP, field_of_view_deg=(-90.0, 90.0), mounting=[0.5, 0.0, math.pi])
    seen = open_field(*corners, scanner=scanner).visible_from_poses([[0, 0, 0], [0, 0, math.pi / 2], [99, 0, 0]])
    # The scanner looks backwards, and from half a meter ahead it has both sides behind its front.
    assert seen.of(0).tolist() == [1, 2, 3]
    assert seen.of(1).tolist() == [0, 2, 3]
    assert seen.counts().tolist() == [3, 3, 0]


def test_a_scanner_upside_down_sees_the_other_side():
    left, right = Reflector(id="left", x=0.0, y=5.0), Reflector(id="right", x=0.0, y=-5.0)
    for upside_down, expected in ((False, [0]), (True, [1])):
        scanner = replace(SHARP, field_of_view_deg=(-30.0, 120.0), upside_down=upside_down)
        seen = open_field(left, right, scanner=scanner).visible_from_poses([[0, 0, 0]])
        assert seen.of(0).tolist() == expected


def test_a_full_turn_sees_behind_itself_whatever_its_first_bearing():
    scanner = replace(SHARP, field_of_view_deg=(0.0, 360.0))
    seen = open_field(Reflector(id="a", x=-3, y=0), Reflector(id="b", x=3, y=0), scanner=scanner).visible_from_poses(
        [[0, 0, 1.0]]
    )
    assert seen.of(0).tolist() == [0, 1]


def test_a_site_without_reflectors_sees_nothing():
    model = open_field()
    assert not model.visible([[0.0, 0.0]]).any()
    assert model.visible_from_poses([[0, 0, 0]]).counts().tolist() == [0]


def test_more_than_64_reflectors_keep_their_bits_apart():
    model = open_field(*(Reflector(id=str(i), x=float(i), y=0.0) for i in range(150)))
    seen = unpack(model.visible([[75.2, 1.0]]), 150)[0]
    distance = np.hypot(np.arange(150) - 75.2, 1.0)
    assert (seen == (distance <= 20.04)).all()
    ahead = np.abs(np.arctan2(-1.0, np.arange(150) - 75.2)) <= math.radians(135.0)
    assert (
        model.visible_from_poses([[75.2, 1.0, 0.0]]).of(0).tolist()
        == np.flatnonzero((distance <= 20.04) & ahead).tolist()
    )


@given(seed=st.integers(0, 2**32 - 1))
def test_a_moved_reflector_gives_the_model_that_would_be_built_anew(seed):
    grid, reflectors, points = random_hall(np.random.default_rng(seed), False)
    caster = RayCaster(grid)
    start = build_visibility(reflectors, SHARP, caster, VisibilityOptions())
    moved = start.with_reflector(3, replace(reflectors.reflectors[3], x=1.3, radius=0.05))
    anew = build_visibility(moved.reflectors, SHARP, caster, VisibilityOptions())
    assert (moved.visible(points) == anew.visible(points)).all()
    assert moved.reflectors.reflectors[3].x == 1.3
    assert start.reflectors == reflectors


def test_min_beams_below_one_is_refused():
    with pytest.raises(ValueError, match="expected 1 beams or more"):
        VisibilityOptions(min_beams=0)


def test_a_restricted_model_equals_one_built_of_those_reflectors_alone():
    places = [(1.0, 1.0), (5.0, 0.2), (9.0, 4.0), (3.0, 5.8), (11.0, 5.8)]
    project = Project(floor_map=room(12.0, 6.0), reflectors=reflectors_at(places))
    kept = np.array([True, False, True, False, True])
    alone = ReflectorMap(tuple(np.array(project.reflectors.reflectors, dtype=object)[kept]))
    restricted = visibility_models(project)[0].restricted(kept)
    (anew,) = visibility_models(replace(project, reflectors=alone))
    assert restricted.reflectors == anew.reflectors
    poses = np.random.default_rng(2).uniform((0.2, 0.2, -3.0), (11.8, 5.8, 3.0), (300, 3))
    seen, expected = restricted.visible_from_poses(poses), anew.visible_from_poses(poses)
    assert np.array_equal(seen.incidence(3), expected.incidence(3))
    assert seen.incidence(3).sum() == len(seen.indices) > 100
