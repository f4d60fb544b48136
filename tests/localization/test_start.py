"""Matching what was seen to a part of the map: against brute force over all pairs, and numbers by hand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from commission.geometry.arrays import read_only
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.localization.beam_ends import HIDDEN, THROUGH, UNKNOWN, beam_ends, what_beams_say
from commission.localization.hypotheses import probabilities
from commission.localization.hypothesis_fit import ROW, Prior, judge
from commission.localization.missed import BEHIND_SEEN, SEEN, THROUGH_SEEN, Sights
from commission.localization.reflector_index import build_index
from commission.localization.start import CANDIDATES, candidates, pair_table
from commission.site.records import Scan
from commission.site.reflectors import Reflector, ReflectorMap
from tests.localization.drives import random_map

SIGMA = 0.03
EVEN = Prior(math.log(1e-3), False, 0.0, 0.0, 0.0, 1.0, 1.0)
NO_WALLS = RayCaster(OccupancyGrid(np.zeros((1, 1), dtype=np.bool_), 1.0)).tables
AHEAD = np.array([[0.0, -0.5 * math.pi, math.pi, 0.1, 10.0]])
"""One scanner that sees half a turn, from 0.1 m to 10 m."""
ORIGIN = np.array([[0.0, 0.0, 0.0, 0.0, 1.0]])
"""A single view, from the origin along x."""


def things_at(points: np.ndarray, sigma: float = SIGMA) -> np.ndarray:
    square = np.full(len(points), sigma**2)
    return read_only(np.column_stack((points, square, np.zeros(len(points)), square)))


def seen_from(pose: np.ndarray, points_map: np.ndarray) -> np.ndarray:
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return (points_map - pose[:2]) @ np.array([[c, -s], [s, c]])


def brute_force(things: np.ndarray, centers: np.ndarray, reach: float) -> tuple[int, np.ndarray]:
    """Most things that any motion brings onto a reflector, and that motion: every pair onto every pair, in numpy."""
    best, motion = 0, np.full(3, np.nan)
    for i, j in itertools.combinations(range(len(things)), 2):
        local = complex(*(things[j] - things[i]))
        for a, b in itertools.permutations(range(len(centers)), 2):
            target = complex(*(centers[b] - centers[a]))
            if abs(abs(local) - abs(target)) > reach:
                continue
            turn = target / local
            turn /= abs(turn)
            middle = complex(*(0.5 * (centers[a] + centers[b]))) - turn * complex(*(0.5 * (things[i] + things[j])))
            moved = turn * (things[:, 0] + 1j * things[:, 1]) + middle
            gaps = np.abs(moved[:, np.newaxis] - (centers[:, 0] + 1j * centers[:, 1])).min(axis=1)
            fits = int((gaps < reach).sum())
            if fits > best:
                best, motion = fits, np.array([middle.real, middle.imag, math.atan2(turn.imag, turn.real)])
    return best, motion


def found_in(reflectors: ReflectorMap, things: np.ndarray) -> np.ndarray:
    index, found = build_index(reflectors), np.empty((CANDIDATES, 4))
    table = pair_table(index.places, 40.0)
    pairs = read_only(np.array(list(itertools.combinations(range(len(things)), 2)), dtype=np.int64))
    count = candidates(things_at(things), pairs, table.distances, table.ends, index, found)
    return found[:count]


def test_the_table_holds_every_pair_both_ways_by_distance() -> None:
    index = build_index(random_map(np.random.default_rng(0), 9))
    table = pair_table(index.places, 12.0)
    expected = sorted(
        (math.dist(index.places[a, :2], index.places[b, :2]), a, b) for a, b in itertools.permutations(range(9), 2)
    )
    expected = [row for row in expected if row[0] <= 12.0]
    assert 0 < len(expected) < 72
    assert [(a, b) for _, a, b in expected] == [tuple(row) for row in table.ends.tolist()]
    np.testing.assert_allclose(table.distances, [distance for distance, _, _ in expected])


@pytest.mark.parametrize("seed", range(6))
def test_the_best_candidate_is_that_of_brute_force_over_all_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    reflectors = random_map(rng, 12)
    pose = np.array([*rng.uniform(2.0, 18.0, 2), rng.uniform(-math.pi, math.pi)])
    seen = seen_from(pose, reflectors.centers[rng.choice(12, 6, replace=False)]) + rng.normal(0.0, 0.01, (6, 2))
    things = rng.permutation(np.concatenate((seen, rng.uniform(-8.0, 8.0, (3, 2)))))
    fits, motion = brute_force(things, reflectors.centers, 0.1)
    assert fits >= 6
    best = found_in(reflectors, things)[0]
    np.testing.assert_allclose(best[:2], motion[:2], atol=0.12)
    assert abs(math.remainder(best[2] - motion[2], 2.0 * math.pi)) < 0.03
    np.testing.assert_allclose(best[:2], pose[:2], atol=0.12)


def test_candidates_come_best_first_and_each_place_once() -> None:
    rng = np.random.default_rng(3)
    reflectors = random_map(rng, 40)
    found = found_in(reflectors, seen_from(np.array([10.0, 10.0, 1.0]), reflectors.centers[:8]))
    assert (np.diff(found[:, 3]) <= 0.0).all()
    assert found[0, 3] == pytest.approx(8.0, abs=0.5)
    assert len(np.unique(np.round(found[:, :3], 9), axis=0)) == len(found) > 1


TRIANGLE = ReflectorMap(
    (Reflector(id="A", x=4.0, y=1.0), Reflector(id="B", x=6.0, y=-2.0), Reflector(id="C", x=3.0, y=-1.0))
)


def judged(
    pose: tuple[float, float, float],
    things: np.ndarray,
    reflectors: ReflectorMap = TRIANGLE,
    *,
    prior: Prior = EVEN,
    walls: RayCaster | None = None,
    facings: np.ndarray | None = None,
    scan: Scan | None = None,
) -> np.ndarray:
    index, row = build_index(reflectors), np.empty((1, ROW))
    every = np.full(len(index.places), np.nan)
    judge(
        read_only(np.array([pose])),
        things_at(things),
        0.0,
        0.0,
        0.05,
        prior,
        Sights(
            read_only(ORIGIN),
            beam_ends(scan, upside_down=False),
            read_only(AHEAD),
            NO_WALLS if walls is None else walls.tables,
            walls is not None,
            read_only(every if facings is None else facings),
        ),
        index,
        row,
    )
    return row[0]


def test_evidence_is_the_laplace_approximation_of_the_likelihood_ratio() -> None:
    things = TRIANGLE.centers.copy()
    row = judged((0.02, -0.03, 0.004), things)
    np.testing.assert_allclose(row[:3], 0.0, atol=1e-6)
    assert row[10] == 3.0
    # J of a point that turns about the origin; W of every thing is 1 / sigma^2.
    J = np.concatenate([[[1.0, 0.0, -y], [0.0, 1.0, x]] for x, y in things])
    P = np.linalg.inv(J.T @ J / SIGMA**2)
    np.testing.assert_allclose(row[3:9], P[np.triu_indices(3)], rtol=1e-6, atol=1e-12)
    each = SEEN * multivariate_normal(np.zeros(2), SIGMA**2 * np.eye(2)).pdf(np.zeros(2)) / 0.05
    expected = 3.0 * math.log(each) + 0.5 * math.log((2.0 * math.pi) ** 3 * np.linalg.det(P)) + math.log(1e-3)
    assert row[9] == pytest.approx(expected, rel=1e-6)


def test_things_that_scatter_more_than_stated_tell_a_pose_less_surely() -> None:
    # Six numbers of three things, three of a pose: what is left of (d / sigma)^2 has the mean 3.
    things = TRIANGLE.centers + 1.8 * SIGMA * np.array([[1.0, 0.5], [-1.0, 0.5], [0.5, -1.0]])
    row = judged((0.0, 0.0, 0.0), things)
    assert row[10] == 3.0
    c, s = math.cos(row[2]), math.sin(row[2])
    on_floor = things @ np.array([[c, s], [-s, c]])
    J = np.concatenate([[[1.0, 0.0, -y], [0.0, 1.0, x]] for x, y in on_floor])
    left = (on_floor + row[:2] - TRIANGLE.centers) / SIGMA
    misfit = (left**2).sum() / 3.0
    assert misfit > 1.5
    P = misfit * np.linalg.inv(J.T @ J / SIGMA**2)
    np.testing.assert_allclose(row[3:9], P[np.triu_indices(3)], rtol=1e-3, atol=1e-9)


def test_a_thing_that_is_no_reflector_changes_nothing() -> None:
    row = judged((0.0, 0.0, 0.0), TRIANGLE.centers)
    more = judged((0.0, 0.0, 0.0), np.vstack((TRIANGLE.centers, (5.0, 4.0))))
    np.testing.assert_allclose(more[:11], row[:11])


MISSED = math.log(1.0 - SEEN)
WALL = np.zeros((40, 40), dtype=np.bool_)
WALL[:, 25] = True


@pytest.mark.parametrize(
    ("x", "y", "missed"),
    [
        (9.9, 0.5, 1.0),  # within range
        (10.1, 0.5, 0.0),
        (0.05, 5.0, 1.0),  # within the field of view, which ends across
        (-0.05, 5.0, 0.0),
    ],
)
def test_a_reflector_that_should_be_seen_and_is_not_speaks_against_a_pose(x: float, y: float, missed: float) -> None:
    one_more = ReflectorMap((*TRIANGLE.reflectors, Reflector(id="D", x=x, y=y)))
    change = judged((0.0, 0.0, 0.0), TRIANGLE.centers, one_more)[9] - judged((0.0, 0.0, 0.0), TRIANGLE.centers)[9]
    assert change == pytest.approx(missed * MISSED)


def test_what_a_wall_hides_or_faces_away_is_not_missed() -> None:
    one_more = ReflectorMap((*TRIANGLE.reflectors, Reflector(id="D", x=9.0, y=0.5)))
    without = judged((0.0, 0.0, 0.0), TRIANGLE.centers)[9]
    # The wall's cells lie at x = 7.5 to 7.8 m.
    hall = RayCaster(OccupancyGrid(WALL, 0.3, np.array([0.0, -6.0, 0.0])))
    assert judged((0.0, 0.0, 0.0), TRIANGLE.centers, one_more, walls=hall)[9] == pytest.approx(without)
    places = build_index(one_more).places
    for facing, missed in ((math.pi, 1.0), (0.0, 0.0)):
        facings = np.where(places[:, 3] == 3.0, facing, np.nan)
        change = judged((0.0, 0.0, 0.0), TRIANGLE.centers, one_more, facings=facings)[9] - without
        assert change == pytest.approx(missed * MISSED)


def ranges_of(toward: float, end: float, elsewhere: float = 9.0) -> Scan:
    """A scan that ends somewhere, but in some directions somewhere else."""
    bearings = np.radians(np.arange(-90.0, 90.0, 0.25))
    ranges = np.where(np.abs(bearings - toward) < math.radians(10.0), end, elsewhere).astype(np.float32)
    return Scan(stamp_ns=0, ranges=ranges, angle_min=float(bearings[0]), angle_increment=math.radians(0.25))


D = (6.0, 2.0)
AWAY, TOWARD = math.hypot(*D), math.atan2(2.0, 6.0)


@pytest.mark.parametrize(
    ("end", "seen_in_a_field", "seen_in_a_hall"),
    [
        (AWAY - 0.32, 0.0, BEHIND_SEEN),  # ends before it: hidden, and in a hall by what the map does not know
        (AWAY - 0.28, SEEN, SEEN),
        (AWAY + 0.48, SEEN, SEEN),
        (AWAY + 0.52, THROUGH_SEEN, THROUGH_SEEN),  # went through its place
        (math.nan, SEEN, SEEN),  # nothing came back
    ],
)
def test_beams_say_what_is_hidden_and_what_is_not_there(
    end: float, seen_in_a_field: float, seen_in_a_hall: float
) -> None:
    one_more = ReflectorMap((*TRIANGLE.reflectors, Reflector(id="D", x=D[0], y=D[1])))
    hall = RayCaster(OccupancyGrid(np.zeros((2, 2), dtype=np.bool_), 1.0))
    for walls, seen in ((None, seen_in_a_field), (hall, seen_in_a_hall)):
        scan = ranges_of(TOWARD, end)
        change = (
            judged((0.0, 0.0, 0.0), TRIANGLE.centers, one_more, walls=walls, scan=scan)[9]
            - judged((0.0, 0.0, 0.0), TRIANGLE.centers, walls=walls, scan=scan)[9]
        )
        assert change == pytest.approx(math.log(1.0 - seen))


def test_a_single_beam_before_a_reflector_hides_it_and_a_mirrored_scanner_looks_the_other_way() -> None:
    scan = ranges_of(TOWARD, AWAY + 2.0)
    scan.ranges[np.argmin(np.abs(scan.bearings - TOWARD))] = 3.0
    for upside_down, bearing in ((False, TOWARD), (True, -TOWARD)):
        ends = beam_ends(scan, upside_down=upside_down)
        assert what_beams_say(0, AWAY, bearing, ends) == HIDDEN
        assert what_beams_say(0, AWAY, -bearing, ends) == THROUGH
        assert what_beams_say(0, AWAY, bearing + 2.0 * math.pi, ends) == HIDDEN
        assert what_beams_say(0, AWAY, math.pi, ends) == UNKNOWN
    assert (beam_ends(None, upside_down=False) == np.inf).all()


@pytest.mark.parametrize("resolution_deg", [1.0, 0.5, 0.36, 0.25])
def test_beams_of_any_resolution_that_go_on_behind_a_place_went_through_it(resolution_deg: float) -> None:
    bearings = np.radians(np.arange(-90.0, 90.0, resolution_deg))
    for end, expected in ((9.0, THROUGH), (6.0, UNKNOWN), (3.0, HIDDEN), (math.nan, UNKNOWN)):
        scan = Scan(
            stamp_ns=0,
            ranges=np.full(len(bearings), end, dtype=np.float32),
            angle_min=float(bearings[0]),
            angle_increment=math.radians(resolution_deg),
        )
        ends = beam_ends(scan, upside_down=False)
        for away, toward in itertools.product((5.9, 5.7), np.radians(np.linspace(-80.0, 80.0, 97))):
            assert what_beams_say(0, away, toward, ends) == expected, (end, away, toward)


def test_a_wall_of_the_map_hides_what_beams_seem_to_go_up_to() -> None:
    one_more = ReflectorMap((*TRIANGLE.reflectors, Reflector(id="D", x=9.0, y=0.5)))
    hall = RayCaster(OccupancyGrid(WALL, 0.3, np.array([0.0, -6.0, 0.0])))
    scan = ranges_of(0.0, 7.6)
    without = judged((0.0, 0.0, 0.0), TRIANGLE.centers, walls=hall, scan=scan)[9]
    assert judged((0.0, 0.0, 0.0), TRIANGLE.centers, one_more, walls=hall, scan=scan)[9] == pytest.approx(without)


def test_the_last_good_pose_makes_places_around_it_likelier() -> None:
    near = judged((0.0, 0.0, 0.0), TRIANGLE.centers, prior=Prior(math.log(1e-3), True, 0.0, 0.0, 0.0, 1.0, 0.09))
    far = judged((0.0, 0.0, 0.0), TRIANGLE.centers, prior=Prior(math.log(1e-3), True, 50.0, 0.0, 0.0, 1.0, 0.09))
    even = judged((0.0, 0.0, 0.0), TRIANGLE.centers)
    peak = 1.0 / ((2.0 * math.pi) ** 1.5 * 0.3)
    assert near[9] - even[9] == pytest.approx(math.log(0.5 + 0.5 * peak / 1e-3), rel=1e-6)
    assert far[9] - even[9] == pytest.approx(math.log(0.5), rel=1e-6)


def test_probabilities_leave_room_for_none_of_the_hypotheses() -> None:
    rows = np.zeros((2, ROW))
    rows[:, 9] = math.log(6.0), math.log(3.0)
    np.testing.assert_allclose(probabilities(rows), [0.6, 0.3])
    assert probabilities(rows[:0]).shape == (0,)
    rows[:, 9] = 2000.0, 1000.0
    np.testing.assert_allclose(probabilities(rows), [1.0, 0.0])
