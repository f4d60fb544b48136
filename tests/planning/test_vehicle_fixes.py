"""What several scanners see and measure together, against a plain and slow version that shares no code with it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry.gaussian import ellipse_axes
from commission.planning.dilution import FixOptions, Heading, Measurement
from commission.planning.fix_ellipses import position_covariances
from commission.planning.vehicle_fixes import fix_covariances, fixes
from commission.planning.vehicle_visibility import VehicleVisibility, vehicle_visibility
from commission.planning.visibility import visibility_models
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from tests.planning.sites import reflectors_at

CELL = 0.05
FRONT = Scanner(
    name="front left",
    mounting=(0.5, 0.3, math.radians(45.0)),
    field_of_view_deg=(-137.5, 137.5),
    range=(0.05, 7.0),
    resolution_deg=0.02,
)
REAR = replace(FRONT, name="rear right", mounting=(-0.6, -0.3, math.radians(-135.0)), range=(0.05, 5.0))
FULL_TURN = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.02, range=(0.05, 100.0), reflector_range=100.0)


def hall(seed: int, *scanners: Scanner, boxes: int = 8) -> Project:
    """A hall of 10 m x 8 m with boxes; every second reflector is known to 2 cm only."""
    rng = np.random.default_rng(seed)
    cells = np.full((round(8.0 / CELL), round(10.0 / CELL)), FREE, np.int8)
    for _ in range(boxes):
        row, column = rng.integers(0, cells.shape[0]), rng.integers(0, cells.shape[1])
        cells[row : row + rng.integers(4, 20), column : column + rng.integers(4, 20)] = OCCUPIED
    places = rng.uniform((0.0, 0.0), (10.0, 8.0), (9, 2))
    reflectors = tuple(Reflector(id=str(i), x=x, y=y, sigma=0.02 * (i % 2)) for i, (x, y) in enumerate(places.tolist()))
    return Project(floor_map=FloorMap(cells, CELL), reflectors=ReflectorMap(reflectors), scanners=scanners)


class Plain:
    """One scan of each scanner from one pose, step by step: rays in steps of a millimetre, matrices by differences."""

    def __init__(self, project: Project, options: FixOptions) -> None:
        assert project.floor_map is not None
        self.walls = project.floor_map.cells == OCCUPIED
        self.reflectors, self.scanners = project.reflectors.reflectors, project.scanners
        self.options = options

    def in_wall(self, x: float, y: float) -> bool:
        row, column = math.floor(y / CELL), math.floor(x / CELL)
        rows, columns = self.walls.shape
        return 0 <= row < rows and 0 <= column < columns and bool(self.walls[row, column])

    def stand(self, scanner: Scanner, pose) -> tuple[float, float, float]:
        """Pose of a scanner in the map."""
        x, y, theta = pose
        ahead, aside, turn = scanner.mounting
        c, s = math.cos(theta), math.sin(theta)
        return x + c * ahead - s * aside, y + s * ahead + c * aside, theta + turn

    def sees(self, scanner: Scanner, pose, reflector: Reflector) -> bool:
        x, y, heading = self.stand(scanner, pose)
        dx, dy = reflector.x - x, reflector.y - y
        distance = math.hypot(dx, dy) - reflector.radius
        if not scanner.range[0] <= distance <= scanner.range[1]:
            return False
        bearing = math.degrees(math.remainder(math.atan2(dy, dx) - heading, 2.0 * math.pi))
        first, last = scanner.field_of_view_deg
        if not first <= bearing <= last:
            return False
        along = np.arange(0.0, distance, 0.001) / math.hypot(dx, dy)
        rows, columns = np.floor((y + along * dy) / CELL).astype(int), np.floor((x + along * dx) / CELL).astype(int)
        inside = (rows >= 0) & (rows < self.walls.shape[0]) & (columns >= 0) & (columns < self.walls.shape[1])
        return not self.walls[rows[inside], columns[inside]].any()

    def measured(self, pose, seen, places) -> np.ndarray:
        """Ranges and bearings of (scanner, reflector) pairs, with the reflectors at places."""
        values: list[float] = []
        for scanner, index in seen:
            x, y, heading = self.stand(scanner, pose)
            dx, dy = places[index][0] - x, places[index][1] - y
            if self.options.measurement is not Measurement.BEARING_ONLY:
                values.append(math.hypot(dx, dy))
            values.append(math.remainder(math.atan2(dy, dx) - heading, 2.0 * math.pi))
        return np.array(values)

    def seen_from(self, pose) -> list[tuple[Scanner, int]]:
        return [(s, i) for s in self.scanners for i, r in enumerate(self.reflectors) if self.sees(s, pose, r)]

    def noise(self, scanner: Scanner) -> list[float]:
        """1-sigma of each number that a scanner measures of a reflector."""
        of_range, of_bearing = scanner.detection_range_sigma, scanner.detection_bearing_sigma_deg
        bearing = self.options.bearing_sigma if of_bearing is None else of_bearing * math.pi / 180.0
        if self.options.measurement is Measurement.BEARING_ONLY:
            return [bearing]
        return [self.options.range_sigma if of_range is None else of_range, bearing]

    def covariance(self, pose) -> np.ndarray:
        """(3, 3) covariance of the pose, with the places of the reflectors as unknowns that the survey has measured."""
        seen, options = self.seen_from(pose), self.options
        places = np.array([(r.x, r.y) for r in self.reflectors])
        unknowns = np.concatenate((pose, places.ravel()))

        def predicted(values: np.ndarray) -> np.ndarray:
            return self.measured(values[:3], seen, values[3:].reshape(-1, 2))

        steps = 1e-6 * np.eye(len(unknowns))
        jacobian = np.stack([(predicted(unknowns + e) - predicted(unknowns - e)) / 2e-6 for e in steps], axis=1)
        weights = np.array([sigma**-2.0 for scanner, _ in seen for sigma in self.noise(scanner)])
        information = jacobian.T @ (weights[:, np.newaxis] * jacobian)
        # A place that is known for certain: a sigma of a micrometre, far below all others.
        survey = np.repeat([max(r.sigma, 1e-6) for r in self.reflectors], 2)
        information[3:, 3:] += np.diag(survey**-2.0)
        if options.measurement is Measurement.RANGE_BEARING_PRIOR:
            information[:2, :2] += np.eye(2) / options.prior_position_sigma**2
            information[2, 2] += options.prior_heading_sigma**-2.0
        # What is left of the pose once the places are eliminated.
        left = information[:3, :3] - information[:3, 3:] @ np.linalg.solve(information[3:, 3:], information[3:, :3])
        if np.linalg.eigvalsh(left)[0] < 1e-5:
            return np.full((3, 3), np.inf)
        return np.linalg.inv(left)

    def figures(self, pose) -> tuple[float, float, float, float]:
        """Distinct reflectors, 1-sigma along the longest axis [m], of the heading [rad], and expected among people."""
        seen, covariance = self.seen_from(pose), self.covariance(pose)
        free: dict[int, float] = {}
        for scanner, index in seen:
            x, y, _ = self.stand(scanner, pose)
            ray = math.hypot(self.reflectors[index].x - x, self.reflectors[index].y - y)
            free[index] = max(free.get(index, 0.0), (1.0 - self.options.blocked_per_m) ** ray)
        if np.isinf(covariance).any():
            return len(free), math.inf, math.inf, sum(free.values())
        longest = float(np.linalg.eigvalsh(covariance[:2, :2])[1])
        return len(free), math.sqrt(longest), math.sqrt(covariance[2, 2]), sum(free.values())

    def stands(self, pose) -> bool:
        return not any(self.in_wall(*self.stand(scanner, pose)[:2]) for scanner in self.scanners)


POINTS = np.random.default_rng(5).uniform((0.3, 0.3), (9.7, 7.7), (14, 2))
MEASUREMENTS = list(Measurement)
HEADINGS = [heading for heading in Heading if heading is not Heading.BY_SCANNER]
"""Those of a fix: what by-scanner means is said before."""


def assert_close(found, expected) -> None:
    """Rays in steps of a millimetre and differences of a micrometre leave six digits of a covariance."""
    assert found[0] == expected[0]
    np.testing.assert_allclose(found[1:], expected[1:], rtol=1e-4)


COARSE = replace(REAR, detection_range_sigma=0.07, detection_bearing_sigma_deg=0.9)
"""Noisier than the rest by half an order of magnitude."""


@pytest.mark.parametrize(
    "scanners", [(FRONT, REAR), (FRONT, COARSE), (COARSE, FRONT)], ids=["alike", "second", "first"]
)
@pytest.mark.parametrize("measurement", MEASUREMENTS)
def test_a_given_heading_of_two_scanners_is_that_of_the_plain_version(measurement, scanners):
    project = hall(1, *scanners)
    options = FixOptions(measurement=measurement, heading=Heading.GIVEN, given_heading=0.7, blocked_per_m=0.05)
    plain, found = Plain(project, options), fixes(vehicle_visibility(project), POINTS, options)
    doubly = 0
    for n, point in enumerate(POINTS):
        pose = (*point.tolist(), 0.7)
        if not plain.stands(pose):
            assert found.visible[n] == 0
            continue
        seen = [index for _, index in plain.seen_from(pose)]
        doubly += len(seen) - len(set(seen))
        row = (found.visible[n], found.position_sigma[n], found.heading_sigma[n], found.expected_visible[n])
        assert_close(row, plain.figures(pose))
    # Else nothing of what two scanners measure of one reflector would be compared.
    assert doubly > 10


@pytest.mark.parametrize(("heading", "worse"), [(Heading.WORST, max), (Heading.BEST, min)])
def test_worst_and_best_heading_look_at_each_way_in_which_the_vehicle_can_stand(heading, worse):
    project = hall(1, FRONT, REAR, boxes=16)
    options = FixOptions(heading=heading, headings=6)
    plain, found = Plain(project, options), fixes(vehicle_visibility(project), POINTS, options)
    refused = 0
    for n, (x, y) in enumerate(POINTS.tolist()):
        poses = [(x, y, k * math.pi / 3.0) for k in range(6)]
        each = [plain.figures(pose) for pose in poses if plain.stands(pose)]
        refused += len(poses) - len(each)
        if not each:
            assert (found.visible[n], found.position_sigma[n]) == (0, math.inf)
            continue
        better = min if worse is max else max
        assert found.visible[n] == better(row[0] for row in each)
        assert found.position_sigma[n] == pytest.approx(worse(row[1] for row in each), rel=1e-4)
        assert found.heading_sigma[n] == pytest.approx(worse(row[2] for row in each), rel=1e-4)
    assert refused > 5


@pytest.mark.parametrize("rear", [REAR, COARSE], ids=["alike", "unequal"])
def test_covariances_of_poses_are_those_of_the_plain_version(rear):
    project = hall(2, FRONT, rear)
    options = FixOptions(heading=Heading.GIVEN)
    plain = Plain(project, options)
    poses = np.column_stack((POINTS, np.linspace(-3.0, 3.0, len(POINTS))))
    finite = 0
    for pose, found in zip(poses, fix_covariances(vehicle_visibility(project), poses, options), strict=True):
        expected = plain.covariance(pose)
        if np.isinf(expected).any():
            assert np.isinf(found[0, 0])
            continue
        finite += 1
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        np.testing.assert_allclose(found / scale, expected / scale, atol=1e-4)
    assert finite > 5


@pytest.mark.parametrize("options", [FixOptions(), FixOptions(heading=Heading.WORST, headings=5)], ids=str)
def test_ellipses_have_the_longest_axis_of_the_figures(options):
    visible = vehicle_visibility(hall(2, FRONT, REAR))
    figures, ellipses = fixes(visible, POINTS, options), position_covariances(visible, POINTS, options)
    known = np.isfinite(figures.position_sigma)
    assert known.any()
    assert np.isfinite(ellipses).all(axis=(1, 2)).tolist() == known.tolist()
    np.testing.assert_allclose(ellipse_axes(ellipses[known])[0].max(axis=-1), figures.position_sigma[known], rtol=1e-9)


def test_vehicle_sees_what_any_of_its_scanners_sees():
    project = hall(3, FRONT, REAR)
    poses = np.random.default_rng(4).uniform((0.0, 0.0, -3.0), (10.0, 8.0, 3.0), (200, 3))
    seen = vehicle_visibility(project).visible_from_poses(poses)
    each = [model.visible_from_poses(poses) for model in visibility_models(project)]
    for n in range(len(poses)):
        assert seen.of(n).tolist() == sorted({*each[0].of(n).tolist(), *each[1].of(n).tolist()})
    # Neither alone sees it all.
    assert all(len(one.indices) < len(seen.indices) for one in each)


def back_to_back(**changes) -> tuple[Scanner, Scanner]:
    """Two scanners in the middle of the base that share a full turn and nothing else."""
    half = replace(FULL_TURN, field_of_view_deg=(-90.0, 90.0), **changes)
    return replace(half, name="front"), replace(half, name="rear", mounting=(0.0, 0.0, math.pi))


@pytest.mark.parametrize("heading", HEADINGS)
def test_two_scanners_that_share_a_full_turn_are_one_that_sees_it(heading):
    reflectors = reflectors_at(np.random.default_rng(6).uniform(-8.0, 8.0, (7, 2)))
    options = FixOptions(heading=heading, given_heading=0.3, headings=5, blocked_per_m=0.02)
    points = np.random.default_rng(7).uniform(-6.0, 6.0, (20, 2))
    one, two = (
        fixes(vehicle_visibility(Project(reflectors=reflectors, scanners=scanners)), points, options)
        for scanners in ((FULL_TURN,), back_to_back())
    )
    for name, alone, shared in zip(one._fields, one, two, strict=True):
        np.testing.assert_allclose(shared, alone, rtol=1e-9, err_msg=name)


def test_two_scanners_in_one_place_are_one_of_half_the_variance_but_for_the_survey():
    centers = np.random.default_rng(8).uniform(-8.0, 8.0, (6, 2))
    points, given = np.random.default_rng(9).uniform(-6.0, 6.0, (10, 2)), FixOptions(heading=Heading.GIVEN)
    scanners = (FULL_TURN, replace(FULL_TURN, name="twin"))
    for sigma in (0.0, 0.05):
        reflectors = ReflectorMap(tuple(replace(r, sigma=sigma) for r in reflectors_at(centers).reflectors))
        one, two = (
            vehicle_visibility(Project(reflectors=reflectors, scanners=each)) for each in (scanners[:1], scanners)
        )
        sharper = replace(
            given, range_sigma=given.range_sigma / math.sqrt(2.0), bearing_sigma=given.bearing_sigma / math.sqrt(2.0)
        )
        twice, sharp = fixes(two, points, given), fixes(one, points, sharper)
        np.testing.assert_allclose(twice.position_sigma, sharp.position_sigma, rtol=1e-9)
        np.testing.assert_allclose(twice.heading_sigma, sharp.heading_sigma, rtol=1e-9)
        assert twice.visible.tolist() == [6] * 10


@pytest.mark.parametrize("heading", HEADINGS)
@pytest.mark.parametrize("measurement", MEASUREMENTS)
def test_noise_of_the_only_scanner_is_that_of_the_options_said_otherwise(measurement, heading):
    reflectors = reflectors_at(np.random.default_rng(6).uniform(-8.0, 8.0, (7, 2)))
    points = np.random.default_rng(7).uniform(-6.0, 6.0, (20, 2))
    options = FixOptions(measurement=measurement, heading=heading, headings=5)
    own = replace(FULL_TURN, detection_range_sigma=0.05, detection_bearing_sigma_deg=math.degrees(0.01))
    told = replace(options, range_sigma=0.05, bearing_sigma=0.01)
    by_scanner, by_options = (
        fixes(vehicle_visibility(Project(reflectors=reflectors, scanners=(scanner,))), points, asked)
        for scanner, asked in ((own, options), (FULL_TURN, told))
    )
    for name, one, other in zip(by_options._fields, by_scanner, by_options, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, err_msg=name)


def test_one_reflector_is_no_fix_however_many_scanners_see_it():
    project = Project(reflectors=reflectors_at([(3.0, 1.0)]), scanners=(FRONT, REAR))
    visible = vehicle_visibility(project)
    for measurement in (Measurement.RANGE_BEARING, Measurement.BEARING_ONLY):
        found = fixes(visible, [[0.0, 0.0]], FixOptions(measurement=measurement, heading=Heading.GIVEN))
        assert (found.visible[0], found.position_sigma[0]) == (1, math.inf)


def test_bearings_of_two_reflectors_from_two_places_are_a_fix_where_those_from_one_are_none():
    reflectors = reflectors_at([(3.0, 1.0), (1.0, 4.0)])
    scanners = tuple(
        replace(FULL_TURN, name=name, mounting=(x, 0.0, 0.0)) for name, x in (("front", 0.8), ("rear", -0.8))
    )
    options = FixOptions(measurement=Measurement.BEARING_ONLY, heading=Heading.GIVEN)
    for count, is_fix in ((1, False), (2, True)):
        project = Project(reflectors=reflectors, scanners=scanners[:count])
        assert np.isfinite(fixes(vehicle_visibility(project), [[0.0, 0.0]], options).position_sigma[0]) == is_fix


def test_all_round_a_reflector_counts_once_and_as_far_as_the_farthest_scanner_sees():
    project = Project(reflectors=reflectors_at([(6.0, 0.0), (0.0, 4.0)]), scanners=(REAR, FRONT))
    far = replace(FULL_TURN, range=(0.05, 7.0))
    together, alone = (
        fixes(vehicle_visibility(each), [[0.0, 0.0]], FixOptions())
        for each in (project, replace(project, scanners=(far,)))
    )
    assert together.visible[0] == alone.visible[0] == 2
    assert together.position_sigma[0] == pytest.approx(alone.position_sigma[0], rel=1e-9)


def test_scanners_among_different_reflectors_are_refused():
    one, other = (visibility_models(Project(reflectors=reflectors_at(places)))[0] for places in ([(1, 1)], [(2, 2)]))
    with pytest.raises(ValueError, match="expected the same ones"):
        VehicleVisibility((one, other))
    with pytest.raises(ValueError, match="expected one at least"):
        VehicleVisibility(())


def test_no_two_reflectors_farther_apart_than_the_widest_distance_are_seen_at_once():
    reach = 7.0 + 0.1
    alike = replace(REAR, range=FRONT.range)
    reflectors = ReflectorMap((Reflector(id="1", x=0.0, y=0.0, radius=0.1),))
    for scanners, widest in (
        ((FRONT,), 2.0 * reach),
        ((FRONT, alike), 2.0 * reach + math.hypot(1.1, 0.6)),
        # The rear one sees 2 m less far, so that the front one alone sees the widest pairs.
        ((FRONT, REAR), 2.0 * reach),
    ):
        visible = vehicle_visibility(Project(reflectors=reflectors, scanners=scanners))
        assert visible.widest == pytest.approx(widest, rel=1e-12)
