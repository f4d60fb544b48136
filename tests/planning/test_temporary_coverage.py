"""How many reels are in sight over the floor: against beams that are followed one by one, and what hides a reel."""

# pyright: basic

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.planning.coverage import Lattice
from commission.planning.temporary_coverage import reels_in_sight
from commission.site.disturbances import Reel
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.parameters import TemporaryParameters
from commission.site.scanner import Scanner, ScannerKind

LASER = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.5, range=(0.1, 25.0))
GONIOMETER = replace(LASER, name="goniometer", kind=ScannerKind.GONIOMETER)
RULE = TemporaryParameters()


def at(x: float, y: float) -> Lattice:
    return Lattice(x=x, y=y, spacing=1.0, rows=1, columns=1)


def by_beams(place, reels, rule, laser) -> int:
    """Reels that enough beams of a scanner at a place meet, each beam's nearest hit found by the quadratic formula."""
    angles = laser.angle_increment * np.arange(round(2.0 * math.pi / laser.angle_increment))
    rays = np.column_stack((np.cos(angles), np.sin(angles)))
    hits = np.full((len(reels), len(rays)), np.inf)
    for index, reel in enumerate(reels):
        to = np.array((reel.x, reel.y)) - place
        b, c = rays @ to, to @ to - reel.radius**2
        with np.errstate(invalid="ignore"):
            near = b - np.sqrt(b * b - c)
        hits[index] = np.where(np.isfinite(near) & (near > 0.0), near, np.inf)
    count = 0
    for index, reel in enumerate(reels):
        mine = (hits[index] < np.inf) & (hits[index] <= hits.min(axis=0))
        if mine.sum() < rule.fewest_points:
            continue
        ends = place + hits[index, mine, np.newaxis] * rays[mine] - (reel.x, reel.y)
        facing = place - np.array((reel.x, reel.y))
        around = np.arctan2(ends @ (-facing[1], facing[0]), ends @ facing)
        away = math.hypot(*facing)
        count += (
            rule.least_arc <= np.ptp(around) <= rule.largest_arc
            and away - reel.radius <= laser.range[1]
            and away <= rule.reach
        )
    return count


def test_counts_are_those_of_beams_that_are_followed_one_by_one():
    """Reels apart from each other, so that none is half hidden."""
    rng, wrong, counts = np.random.default_rng(3), 0, []
    for _ in range(300):
        bearings = np.arange(6) * math.pi / 3.0 + rng.uniform(-0.2, 0.2, 6)
        distances = np.exp(rng.uniform(np.log(1.5), np.log(40.0), 6))
        reels = tuple(
            Reel(x=d * math.cos(b), y=d * math.sin(b), radius=r)
            for d, b, r in zip(distances.tolist(), bearings.tolist(), rng.uniform(0.35, 0.7, 6).tolist(), strict=True)
        )
        found = int(reels_in_sight(reels, RULE, (LASER,), None, at(0.0, 0.0))[0])
        counts.append(found)
        wrong += found != by_beams(np.zeros(2), reels, RULE, LASER)
    assert len(set(counts)) >= 5
    # Where a reel is as far away as it may be, one beam more or less decides.
    assert wrong <= 300 * 0.15


def test_a_reel_shows_enough_up_to_the_distance_at_which_its_width_is_eight_beams():
    reel, limit = Reel(x=0.0, y=0.0, radius=0.5), 0.5 / math.sin(0.5 * 8 * math.radians(0.5))
    for distance, seen in ((limit - 0.01, 1), (limit + 0.01, 0)):
        assert reels_in_sight((reel,), RULE, (LASER,), None, at(distance, 0.0)).tolist() == [seen]
    fine = replace(LASER, resolution_deg=0.25)
    assert reels_in_sight((reel,), RULE, (LASER, fine), None, at(limit + 0.01, 0.0)).tolist() == [1]


def test_too_near_only_a_piece_of_its_arc_is_in_sight():
    reel, limit = Reel(x=0.0, y=0.0, radius=0.5), 0.5 / math.cos(0.5 * RULE.least_arc)
    for distance, seen in ((limit - 0.001, 0), (limit + 0.001, 1)):
        assert reels_in_sight((reel,), RULE, (LASER,), None, at(distance, 0.0)).tolist() == [seen]


@pytest.mark.parametrize(
    ("change", "seen"),
    [
        ({}, 1),
        ({"radius": 0.2}, 0),
        ({"radius": 1.2}, 0),
        ({"appears": 5.0}, 0),
        ({"vanishes": 5.0}, 1),
    ],
)
def test_what_is_no_reel_or_comes_later_does_not_count(change, seen):
    reel = replace(Reel(x=0.0, y=0.0, radius=0.5), **change)
    assert reels_in_sight((reel,), RULE, (LASER,), None, at(3.0, 0.0)).tolist() == [seen]
    assert reels_in_sight((reel,), RULE, (GONIOMETER,), None, at(3.0, 0.0)).tolist() == [0]


def test_another_reel_before_it_and_a_wall_hide_a_reel_and_one_behind_it_does_not():
    near, far = Reel(x=2.0, y=0.0, radius=0.5), Reel(x=5.0, y=0.2, radius=0.5)
    assert reels_in_sight((near, far), RULE, (LASER,), None, at(0.0, 0.0)).tolist() == [1]
    assert reels_in_sight((near, replace(far, y=2.5)), RULE, (LASER,), None, at(0.0, 0.0)).tolist() == [2]
    # A wall at x = 1 m, from y = -1 to 1 m, and one behind the reel, in whose cells its center lies.
    cells = np.full((60, 60), FREE, np.uint8)
    wall, behind = cells.copy(), cells.copy()
    wall[20:40, 20] = OCCUPIED
    behind[:, 30] = OCCUPIED
    for hall, seen in ((cells, 1), (wall, 0), (behind, 1)):
        floor = FloorMap(hall, 0.1, (-1.0, -3.0, 0.0))
        assert reels_in_sight((near,), RULE, (LASER,), floor, at(0.0, 0.0)).tolist() == [seen]
