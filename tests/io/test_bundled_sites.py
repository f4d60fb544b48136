from __future__ import annotations

import functools
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry.angles import wrap
from commission.geometry.raycast import RayCaster
from commission.geometry.se2 import compose, transform_points
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.localization.estimate import Belief, Mode
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Direction, Route
from commission.studies.metrics import pose_errors, reference_at
from tests.tools.draw_sites import SITES

CLEARANCE = 0.2
"""Between the vehicle's side and the nearest wall [m]."""
SHORTEST_RADIUS = 1.0
"""Of a planned curve [m]."""


@functools.cache
def site(name: str) -> Project:
    return load_project(bundled_folder("maps") / name)


@functools.cache
def caster(name: str) -> RayCaster:
    return RayCaster(floor(name).occupancy())


def floor(name: str):
    floor_map = site(name).floor_map
    assert floor_map is not None
    return floor_map


def poses_along(route: Route, step: float) -> np.ndarray:
    """(N, 3) poses of base on a route, the vehicle's front against the motion where it reverses."""
    poses = []
    for segment in route.segments:
        spline = segment.spline()
        u = spline.u_at(np.linspace(0.0, spline.length, max(2, math.ceil(spline.length / step))))
        turned = math.pi if segment.direction is Direction.REVERSE else 0.0
        poses.append(np.column_stack([spline.point(u), wrap(spline.heading(u) + turned)]))
    return np.concatenate(poses)


def visible_counts(name: str, poses: np.ndarray) -> np.ndarray:
    """Reflectors in range, in the field of view and in line of sight of any scanner from each pose."""
    return np.array([sum(any(seen) for seen in zip(*seen_from(name, pose), strict=True)) for pose in poses])


def seen_from(name: str, pose: np.ndarray) -> list[list[bool]]:
    """Which reflectors each scanner sees from a pose."""
    project, centers = site(name), site(name).reflectors.centers
    found: list[list[bool]] = []
    for scanner in project.scanners:
        T_map_scanner = compose(pose, scanner.mounting)
        offsets = centers - T_map_scanner[:2]
        distances = np.hypot(*offsets.T)
        bearings = np.degrees(wrap(np.arctan2(offsets[:, 1], offsets[:, 0]) - T_map_scanner[2]))
        first, last = scanner.field_of_view_deg
        seen = (distances < scanner.reflector_range) & (bearings >= first) & (bearings <= last)
        origins = np.broadcast_to(T_map_scanner[:2], centers[seen].shape)
        seen[seen] = caster(name).line_of_sight(origins, centers[seen])
        found.append(seen.tolist())
    return found


ROUTES = [(name, route.name) for name, draw in SITES.items() for route in draw().routes]


@pytest.mark.parametrize("name", SITES)
def test_bundled_site_is_what_its_script_draws(name: str) -> None:
    drawn, bundled = SITES[name](), site(name)
    for field in ("name", "floor_map", "reflectors", "routes", "vehicle", "scanners", "tags", "tag_camera"):
        assert getattr(drawn, field) == getattr(bundled, field), field


@pytest.mark.parametrize(
    ("name", "size", "reflectors"),
    [
        ("laboratory", (12, 8), 4),
        ("shop_floor", (24, 13), 25),
        ("warehouse", (100, 60), 120),
        ("loading_bay", (20, 14), 18),
        ("assembly", (16, 10), 6),
    ],
)
def test_site_has_its_size_and_reflectors(name: str, size: tuple[int, int], reflectors: int) -> None:
    inner = np.array(floor(name).size) - 0.4
    assert inner == pytest.approx(size)
    assert len(site(name).reflectors) == reflectors


@pytest.mark.parametrize("name", SITES)
def test_reflectors_touch_no_wall_and_no_other_reflector(name: str) -> None:
    project = site(name)
    centers, radii = project.reflectors.centers, project.reflectors.radii
    angles = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
    rim = centers[:, None] + radii[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    assert not floor(name).occupancy().is_occupied(rim.reshape(-1, 2)).any()
    distances = np.hypot(*(centers[:, None] - centers[None]).T) + 1e9 * np.eye(len(centers))
    # Closer pairs than 0.3 m cannot be told apart by their mutual distance.
    assert distances.min() > 0.3


@pytest.mark.parametrize(("name", "route"), ROUTES)
def test_vehicle_keeps_clear_of_walls_on_the_route(name: str, route: str) -> None:
    project = site(name)
    grid = floor(name).occupancy()
    poses = poses_along(project.route(route), 0.05)
    outline = np.array(project.vehicle.outline)
    corners = np.array([transform_points(pose, outline) for pose in poses]).reshape(-1, 2)
    assert not grid.is_occupied(corners).any()
    cells = grid.cells_at(poses[:, :2])
    distances = grid.distance_field()[cells[:, 0], cells[:, 1]]
    assert distances.min() >= np.abs(outline[:, 1]).max() + CLEARANCE


@pytest.mark.parametrize(("name", "route"), ROUTES)
def test_curves_are_wide_and_meet_in_one_line(name: str, route: str) -> None:
    segments = site(name).route(route).segments
    for segment in segments:
        curvature = segment.spline().curvature(np.linspace(0.0, 1.0, 2000))
        assert np.abs(curvature).max() < 1.0 / SHORTEST_RADIUS
    for before, after in itertools.pairwise(segments):
        turn = abs(float(wrap(after.spline().heading(0.0) - before.spline().heading(1.0))))
        expected = 0.0 if before.direction is after.direction else math.pi
        # Control points are rounded to millimetres.
        assert turn == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(("name", "route"), ROUTES)
def test_reflectors_are_visible_from_nearly_everywhere_on_the_route(name: str, route: str) -> None:
    counts = visible_counts(name, poses_along(site(name).route(route), 0.5))
    if name == "laboratory":
        assert counts.min() == 4
    elif name == "assembly":
        # Where one reflector is in sight or none, tags tell where the vehicle is.
        assert counts.mean() > 1.0
    else:
        assert np.mean(counts >= 3) > 0.97
        assert counts.min() >= 2


def test_the_four_wheels_of_the_assembly_site_drive_by_tags_where_odometry_slips() -> None:
    project = site("assembly")
    assert len(project.vehicle.wheel_angles_deg) == 4
    blind = replace(project, reflectors=ReflectorMap(), disturbances=replace(project.disturbances, people=0))
    name = project.routes[0].name
    log, start = virtual_drive(blind, name, seed=1), start_of(blind, name)
    columns = run(log, LocalizerSetup.of(blind), Belief(0, start.pose, np.diag(start.sigmas**2)))
    errors = pose_errors(columns.means, reference_at(columns.stamps_ns, log.reference_stamps_ns, log.reference_poses))
    known = np.isfinite(errors[:, 0])
    pose = start.pose
    for displacement in log.displacements:
        pose = compose(pose, displacement)
    drift = np.hypot(*(pose - log.reference_poses[-1])[:2])
    rms = np.sqrt(np.mean(np.sum(errors[known, :2] ** 2, axis=1)))
    assert (columns.modes == Mode.OPERATIONAL).all()
    assert rms < 0.02
    assert drift > 0.1


def test_laboratory_route_ends_where_it_starts() -> None:
    poses = poses_along(site("laboratory").routes[0], 0.05)
    assert poses[-1] == pytest.approx(poses[0], abs=2e-3)


def test_the_two_scanners_of_the_loading_bay_see_past_each_side_of_the_vehicle() -> None:
    project = site("loading_bay")
    assert [scanner.name for scanner in project.scanners] == ["front left", "rear right"]
    outline = np.array(project.vehicle.outline)
    for scanner in project.scanners:
        assert scanner.field_of_view_deg == (-137.5, 137.5)
        # On a corner of the outline, which leaves it three quarters of a turn and a little beside.
        assert np.hypot(*(outline - scanner.mounting[:2]).T).min() == 0.0
    # Together they see what neither sees alone.
    for pose in poses_along(project.routes[1], 2.0):
        front, rear = (sum(seen) for seen in seen_from("loading_bay", pose))
        assert max(front, rear) <= visible_counts("loading_bay", pose[np.newaxis])[0]
