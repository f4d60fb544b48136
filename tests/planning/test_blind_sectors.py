"""A reflector whose center lies in a blind sector is not visible: against plain loops, for one scanner and for two."""

from __future__ import annotations

import math

import numpy as np
import pytest

from commission.planning.dilution import FixOptions, Heading
from commission.planning.vehicle_fixes import fix_covariances, fixes
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

FRONT = Scanner(
    name="front",
    mounting=np.array([0.4, 0.3, 0.7]),
    field_of_view_deg=(-135.0, 120.0),
    blind_sectors_deg=((-100.0, -35.0), (20.0, 60.0)),
)
REAR = Scanner(
    name="rear",
    mounting=np.array([-0.5, -0.2, -2.4]),
    field_of_view_deg=(-180.0, 180.0),
    blind_sectors_deg=((-180.0, -110.0), (95.0, 150.0)),
    upside_down=True,
)
VEHICLES = {"front": (FRONT,), "upside down": (REAR,), "both": (FRONT, REAR)}


def site(scanners: tuple[Scanner, ...]) -> Project:
    rng = np.random.default_rng(3)
    places = rng.uniform(-8.0, 8.0, (40, 2)).tolist()
    reflectors = tuple(Reflector(id=str(i), x=x, y=y, radius=0.05) for i, (x, y) in enumerate(places))
    return Project(reflectors=ReflectorMap(reflectors), scanners=scanners)


def placed(scanner: Scanner, x: float, y: float, heading: float) -> tuple[float, float, float]:
    dx, dy, turn = scanner.mounting.tolist()
    c, s = math.cos(heading), math.sin(heading)
    return x + c * dx - s * dy, y + s * dx + c * dy, heading + turn


def sees(scanner: Scanner, sensor: tuple[float, float, float], reflector: Reflector) -> bool:
    dx, dy = reflector.x - sensor[0], reflector.y - sensor[1]
    bearing = math.degrees(math.atan2(dy, dx) - sensor[2])
    bearing = (-bearing if scanner.upside_down else bearing + 0.0) % 360.0
    bearing = bearing - 360.0 if bearing > 180.0 else bearing
    first, last = scanner.field_of_view_deg
    near = scanner.range[0] + 0.05 <= math.hypot(dx, dy)
    return near and first <= bearing <= last and not any(a <= bearing <= b for a, b in scanner.blind_sectors_deg)


def seen_from(project: Project, x: float, y: float, heading: float) -> list[int]:
    return [
        index
        for index, reflector in enumerate(project.reflectors.reflectors)
        if any(sees(scanner, placed(scanner, x, y, heading), reflector) for scanner in project.scanners)
    ]


@pytest.mark.parametrize("scanners", VEHICLES.values(), ids=VEHICLES.keys())
def test_visible_from_poses_is_what_a_plain_loop_sees(scanners: tuple[Scanner, ...]) -> None:
    project = site(scanners)
    poses = np.random.default_rng(4).uniform((-3.0, -3.0, -4.0), (3.0, 3.0, 4.0), (60, 3))
    visible = vehicle_visibility(project).visible_from_poses(poses)
    for index, pose in enumerate(poses.tolist()):
        assert visible.of(index).tolist() == seen_from(project, *pose), pose


@pytest.mark.parametrize("scanners", [VEHICLES["upside down"], VEHICLES["both"]], ids=["one", "two"])
@pytest.mark.parametrize("heading", [Heading.WORST, Heading.BEST, Heading.GIVEN])
def test_coverage_counts_what_a_plain_loop_sees_in_each_heading(
    scanners: tuple[Scanner, ...], heading: Heading
) -> None:
    project = site(scanners)
    points = np.random.default_rng(5).uniform(-3.0, 3.0, (40, 2))
    options = FixOptions(heading=heading, headings=8, given_heading=0.3)
    counts = fixes(vehicle_visibility(project), points, options).visible
    headings = [0.3] if heading is Heading.GIVEN else [k * math.pi / 4.0 for k in range(8)]
    chosen = max if heading is Heading.BEST else min
    for index, (x, y) in enumerate(points.tolist()):
        if len(scanners) > 1 or heading is Heading.GIVEN:
            bases = [(x, y)] * len(headings)
        else:
            # Of a single scanner, the point is its own place.
            levers = [placed(scanners[0], 0.0, 0.0, each) for each in headings]
            bases = [(x - lever[0], y - lever[1]) for lever in levers]
        found = [len(seen_from(project, *base, each)) for base, each in zip(bases, headings, strict=True)]
        assert counts[index] == chosen(found), (x, y)


@pytest.mark.parametrize("scanners", VEHICLES.values(), ids=VEHICLES.keys())
def test_covariance_of_a_fix_adds_up_what_is_not_in_a_blind_sector(scanners: tuple[Scanner, ...]) -> None:
    project = site(scanners)
    poses = np.random.default_rng(6).uniform((-3.0, -3.0, -4.0), (3.0, 3.0, 4.0), (20, 3))
    options = FixOptions(heading=Heading.GIVEN, range_sigma=0.01, bearing_sigma=0.002)
    found = fix_covariances(vehicle_visibility(project), poses, options)
    for pose, covariance in zip(poses.tolist(), found, strict=True):
        information = np.zeros((3, 3))
        for scanner in scanners:
            for reflector in project.reflectors.reflectors:
                if sees(scanner, placed(scanner, *pose), reflector):
                    rows = slopes(scanner, pose, reflector)
                    information += rows.T @ np.diag([0.01**-2, 0.002**-2]) @ rows
        np.testing.assert_allclose(covariance, np.linalg.inv(information), rtol=1e-5)


def slopes(scanner: Scanner, pose: list[float], reflector: Reflector) -> np.ndarray:
    """(2, 3) central differences of range and bearing by the pose."""

    def measured(values: np.ndarray) -> np.ndarray:
        x, y, heading = placed(scanner, *values.tolist())
        offset = complex(reflector.x - x, reflector.y - y) * complex(math.cos(heading), -math.sin(heading))
        return np.array([abs(offset), math.atan2(offset.imag, offset.real)])

    steps = 1e-6 * np.eye(3)
    columns = [(measured(np.array(pose) + step) - measured(np.array(pose) - step)) / 2e-6 for step in steps]
    return np.stack(columns, axis=1)


def test_all_round_no_sector_is_blind() -> None:
    project = site((FRONT,))
    options = FixOptions(heading=Heading.ALL_ROUND)
    counts = fixes(vehicle_visibility(project), np.zeros((1, 2)), options).visible
    assert counts.tolist() == [40]
