"""What contours tell over the floor, against closed forms and against what the localizer makes of a scan there."""

# pyright: basic

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.geometry.raycast import RayCaster
from commission.io.project_file import load_project
from commission.localization.estimate import Belief
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.planning import contour_coverage as module
from commission.planning.contour_coverage import contour_coverage
from commission.planning.coverage import Lattice
from commission.planning.dilution import FixOptions, Heading
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.parameters import ContourParameters, FilterParameters, Parameters
from commission.site.records import Odometry, Scan
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from tests.conftest import REPOSITORY

CELL = 0.05
ROUND = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.5, range=(0.05, 40.0))
ALL_ROUND = FixOptions(heading=Heading.ALL_ROUND)
GIVEN = ContourParameters()


def hall(width: float, depth: float, *, closed: bool = True) -> FloorMap:
    """A room from (0, 0) to (width, depth); open at its left and right end where it is a corridor."""
    cells = np.full((round(depth / CELL) + 2, round(width / CELL) + 2), FREE, dtype=np.int8)
    cells[0], cells[-1] = OCCUPIED, OCCUPIED
    if closed:
        cells[:, 0], cells[:, -1] = OCCUPIED, OCCUPIED
    return FloorMap(cells=cells, resolution=CELL, origin=np.array((-CELL, -CELL, 0.0)))


def at(x: float, y: float) -> Lattice:
    return Lattice(x=x, y=y, spacing=1.0, rows=1, columns=1)


def test_in_the_middle_of_a_square_room_it_is_the_closed_form():
    # Half of B beams end on the two walls across x: each tells x to sigma. The wall of half length a that is a away is
    # turned against the beam at phi by a lever of a tan(phi), whose mean square over 45 degrees to each side is
    # a^2 (4 / pi - 1).
    a, beams = 4.0, 720.0
    found = contour_coverage(hall(2 * a, 2 * a), (ROUND,), GIVEN, at(a, a), ALL_ROUND)
    sigma = GIVEN.beam_sigma
    assert found.told.tolist() == [3]
    assert found.beams[0] == pytest.approx(beams, rel=0.02)
    assert found.position_sigma[0] == pytest.approx(sigma / math.sqrt(beams / 2.0), rel=0.03)
    assert found.heading_sigma[0] == pytest.approx(sigma / math.sqrt(beams * a * a * (4.0 / math.pi - 1.0)), rel=0.06)


def test_a_corridor_tells_nothing_of_the_place_along_it():
    found = contour_coverage(hall(60.0, 3.0, closed=False), (ROUND,), GIVEN, at(30.0, 1.5), ALL_ROUND)
    assert found.told.tolist() == [2]
    assert np.isinf(found.position_sigma).all()
    assert np.isinf(found.heading_sigma).all()


def test_without_walls_in_reach_nothing_is_told():
    short = dataclasses.replace(ROUND, range=(0.05, 2.0))
    found = contour_coverage(hall(20.0, 20.0), (short,), GIVEN, at(10.0, 10.0), ALL_ROUND)
    assert found.told.tolist() == [0]
    assert found.beams.tolist() == [0]


def test_the_worst_heading_of_a_scanner_that_looks_ahead_is_that_of_the_given_ones():
    ahead = dataclasses.replace(ROUND, field_of_view_deg=(-100.0, 100.0), mounting=np.array((0.0, 0.0, 0.5)))
    floor, lattice = hall(9.0, 5.0), at(2.0, 3.0)
    worst, best = (
        contour_coverage(floor, (ahead,), GIVEN, lattice, FixOptions(heading=heading, headings=8))
        for heading in (Heading.WORST, Heading.BEST)
    )
    each = [
        contour_coverage(
            floor, (ahead,), GIVEN, lattice, FixOptions(heading=Heading.GIVEN, given_heading=math.radians(45.0 * k))
        )
        for k in range(8)
    ]
    told = [one.position_sigma[0] for one in each]
    assert worst.position_sigma[0] == max(told)
    assert best.position_sigma[0] == min(told)
    assert worst.told[0] == min(one.told[0] for one in each)
    assert max(told) > 1.05 * min(told)


def test_a_scanner_that_hides_behind_the_vehicle_tells_less_and_two_tell_more_than_one():
    floor, lattice = hall(9.0, 5.0), at(2.0, 3.0)
    one = contour_coverage(floor, (ROUND,), GIVEN, lattice, FixOptions(heading=Heading.GIVEN))
    blind = dataclasses.replace(ROUND, blind_sectors_deg=((-90.0, 90.0),))
    half = contour_coverage(floor, (blind,), GIVEN, lattice, FixOptions(heading=Heading.GIVEN))
    two = contour_coverage(
        floor, (ROUND, dataclasses.replace(ROUND, name="rear")), GIVEN, lattice, FixOptions(heading=Heading.GIVEN)
    )
    assert half.beams[0] == pytest.approx(0.5 * one.beams[0], rel=0.02)
    assert half.position_sigma[0] > one.position_sigma[0]
    assert two.position_sigma[0] == pytest.approx(one.position_sigma[0] / math.sqrt(2.0), rel=1e-9)


def test_several_scanners_stand_where_they_are_mounted_and_share_the_turn_all_round():
    floor, ahead = hall(9.0, 5.0), dataclasses.replace(ROUND, mounting=np.array((1.5, 0.0, 0.0)))
    pair = ahead, dataclasses.replace(ROUND, name="rear", mounting=np.array((-1.5, 0.0, math.pi)))
    # All round they stand at the point, and no direction counts twice.
    one, both = (contour_coverage(floor, each, GIVEN, at(4.0, 2.0), ALL_ROUND) for each in ((ROUND,), pair))
    assert both.position_sigma[0] == one.position_sigma[0]
    assert both.beams[0] == one.beams[0]
    # Of base, 1 m from a wall that the scanner would be behind: nothing is seen from there, and no heading is like it.
    given = FixOptions(heading=Heading.GIVEN)
    assert contour_coverage(floor, (ahead,), GIVEN, at(8.0, 2.5), given).told.tolist() == [0]
    in_wall = dataclasses.replace(ahead, mounting=np.array((1.02, 0.0, 0.0)))
    for heading in (Heading.GIVEN, Heading.WORST, Heading.BEST):
        asked = FixOptions(heading=heading, headings=1)
        assert np.isinf(contour_coverage(floor, (pair[1], in_wall), GIVEN, at(8.0, 2.5), asked).position_sigma).all()


def test_over_the_warehouse_it_is_what_the_localizer_believes_after_one_scan():
    """The localizer's own posterior from a wide prior, without the map's error: no formula of the coverage is in it.

    Of base, from which the scanner is mounted ahead and to the left.
    """
    scanner = dataclasses.replace(ROUND, mounting=np.array((1.0, 0.3, 0.2)))
    site = load_project(REPOSITORY / "maps" / "warehouse")
    floor = site.floor_map
    given = ContourParameters(enabled=True, map_sigma=0.0, map_heading_sigma=0.0)
    parameters = Parameters(contour=given, filter=FilterParameters(consider=False))
    setup = LocalizerSetup(
        reflectors=ReflectorMap(),
        scanners=(scanner,),
        parameters=parameters,
        floor=floor,
        uncertainty=dataclasses.replace(
            site.uncertainty, mounting_position=0.0, mounting_heading=0.0, range_bias=0.0, clock=0.0
        ),
    )
    caster, rng = RayCaster(floor.occupancy()), np.random.default_rng(4)
    compared = 0
    for x, y in ((3.0, 3.0), (50.0, 25.0), (95.0, 30.0), (52.0, 57.0), (20.0, 2.0), (50.0, 45.0)):
        found = contour_coverage(floor, (scanner,), given, at(x, y), FixOptions(heading=Heading.GIVEN))
        bearings = ROUND.angle_min + ROUND.angle_increment * np.arange(ROUND.beam_count)
        rays = np.array([(x + 1.0, y + 0.3, 0.2 + bearing) for bearing in bearings])
        ranges = caster.cast(rays, ROUND.range[1])
        noisy = np.where(np.isfinite(ranges), ranges + 0.005 * rng.standard_normal(len(ranges)), np.nan)
        localizer = Localizer(setup, Belief(0, np.array((x, y, 0.0)), np.diag(np.square((0.1, 0.1, 0.03)))))
        localizer.feed(Odometry(0, np.zeros(3)))
        (estimate,) = localizer.feed(
            Scan(
                stamp_ns=0,
                ranges=noisy.astype(np.float32),
                angle_min=ROUND.angle_min,
                angle_increment=ROUND.angle_increment,
                reflector=np.zeros(len(noisy), np.bool_),
            )
        )
        if found.told[0] < 3:
            continue
        compared += 1
        covariance = estimate.posterior.covariance
        believed = math.sqrt(np.linalg.eigvalsh(covariance[:2, :2]).max())
        assert found.position_sigma[0] == pytest.approx(believed, rel=0.15), (x, y)
        assert found.heading_sigma[0] == pytest.approx(math.sqrt(covariance[2, 2]), rel=0.15), (x, y)
    assert compared >= 4


def test_who_cancels_does_not_wait_for_the_rest_of_a_large_floor(monkeypatch: pytest.MonkeyPatch):
    class StoppedError(Exception):
        pass

    def stop(share: float, _: str) -> None:
        if share > 0.0:
            raise StoppedError

    told, tell = [], module._tell
    monkeypatch.setattr(module, "_tell", lambda points, *rest: (told.append(len(points)), tell(points, *rest)))
    lattice = Lattice(x=0.1, y=0.1, spacing=0.01, rows=280, columns=580)
    with pytest.raises(StoppedError):
        contour_coverage(hall(6.0, 3.0), (ROUND,), GIVEN, lattice, ALL_ROUND, stop)
    # As many threads as there are cores are at work when it is stopped, each with some hundred points.
    assert sum(told) < 0.2 * len(lattice)
