"""Walls of the floor map as evidence of where a vehicle is: shares by hand, and a hall whose reflectors look alike."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.geometry.arrays import read_only
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.localization.beam_ends import BINS, no_ends
from commission.localization.estimate import Mode
from commission.localization.hypotheses import probabilities
from commission.localization.hypothesis_fit import ROW
from commission.localization.search_map import search_map
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_unlocated
from commission.localization.wall_evidence import log_walls, wall_beams
from commission.localization.whole_run import run
from commission.simulation.scan import VirtualScanner
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Odometry, Record, Scan
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

WALL = np.zeros((40, 40), dtype=np.bool_)
WALL[:, 25] = True
AHEAD = RayCaster(OccupancyGrid(WALL, 0.3, np.array([0.0, -6.0, 0.0]))).tables
"""A wall across, from x = 7.5 m on."""


@pytest.mark.parametrize(
    ("toward", "length", "right", "anywhere"),
    [
        (0.0, 7.34, 0.40, 0.40),  # before the wall: somebody stands there
        (0.0, 7.36, 0.55, 0.20),
        (0.0, 7.64, 0.55, 0.20),
        (0.0, 7.66, 0.05, 0.40),  # through it
        (math.pi, 3.0, 0.40, 0.40),  # where there is no wall
        (math.radians(80.0), 20.0, 0.40, 0.40),
    ],
)
def test_a_beam_counts_by_the_wall_it_ends_at_before_or_behind(
    toward: float, length: float, right: float, anywhere: float
) -> None:
    # The frame of odometry lies a quarter turn and 1 m off; the beam starts 2 m along its x, from the map's origin.
    beam = read_only(np.array([[2.0, 0.0, toward + 0.5 * math.pi, length]] * 8))
    found = log_walls(0.0, 2.0, -0.5 * math.pi, beam, AHEAD)
    # Of eight beams, two are independent.
    assert found == pytest.approx(2.0 * math.log(right / anywhere))


@pytest.mark.parametrize(("length", "bound"), [(7.5, math.log(1e6)), (9.0, -math.log(1e3))])
def test_however_many_beams_say_so_walls_are_not_believed_beyond_a_bound(length: float, bound: float) -> None:
    beams = read_only(np.array([[0.0, 0.0, 0.0, length]] * 400))
    assert log_walls(0.0, 0.0, 0.0, beams, AHEAD) == pytest.approx(bound)


def test_a_grazed_wall_may_be_met_farther_than_a_ray_says() -> None:
    toward = math.radians(74.0)
    for off, hit in ((0.0, True), (0.009, True), (0.03, False)):
        beam = read_only(np.array([[6.0, 0.0, toward, 1.5 / math.cos(toward + off)]]))
        assert beam[0, 3] - 1.5 / math.cos(toward) > 0.15 or off == 0.0
        assert (log_walls(0.0, 0.0, 0.0, beam, AHEAD) > 0.0) == hit


def test_one_beam_in_three_degrees_of_the_newest_view_is_taken_and_none_at_a_thing() -> None:
    views, ends = np.zeros((3, 5)), no_ends(3)
    views[1:, 0] = 1.0, 5.0
    views[2, 3] = 1.0
    ends[0], ends[1], ends[2, ::2] = 9.0, 4.0, 0.2
    ends[2, 90:96] = 2.0, np.inf, 2.0, 2.0, np.inf, 2.0
    beams = wall_beams(views, ends, np.array([[5.0, 0.0]]))
    assert 0.9 * BINS / 6 < len(beams) - 1 < BINS / 6
    assert (beams[:-1, 0] == 1.0).all()
    assert (beams[:-1, 3] == 4.0).all()
    ended = beams[:-1, :1] + 4.0 * np.cos(beams[:-1, 2:3])
    assert np.hypot(ended[:, 0] - 5.0, 4.0 * np.sin(beams[:-1, 2])).min() > 0.3
    # Of the second scanner nothing nearer than 0.3 m counts: its own vehicle.
    np.testing.assert_allclose(beams[-1], (5.0, 0.0, math.radians(45.25), 2.0))


def test_walls_speak_more_for_one_place_of_several_than_against_none_of_them() -> None:
    rows = np.zeros((2, ROW))
    rows[:, 9], rows[0, 12] = (30.0, 28.0), 29.0
    likelier, other, none = np.exp((1.0, -1.0, 0.0)) / np.exp((1.0, -1.0, 0.0)).sum()
    np.testing.assert_allclose(probabilities(rows), (likelier, other))
    assert 1.0 - probabilities(rows).sum() == pytest.approx(none)


MIDDLE = np.array((5.0, 4.0))
HALF = np.array(((3.4, 0.3), (-1.9, 2.6), (2.2, -2.4), (0.4, 2.7)))
ALIKE = ReflectorMap(
    tuple(
        Reflector(id=f"R{i}", x=float(x), y=float(y)) for i, (x, y) in enumerate((*(MIDDLE + HALF), *(MIDDLE - HALF)))
    )
)
"""Turned by half a turn about the middle, they are the same."""


def hall() -> FloorMap:
    """From (0, -3) to (16, 8) m: turned by half a turn about that middle it is another one."""
    cells = np.full((232, 332), FREE, dtype=np.int8)
    cells[5:7, 5:-5] = cells[-7:-5, 5:-5] = cells[5:-5, 5:7] = cells[5:-5, -7:-5] = OCCUPIED
    return FloorMap(cells, 0.05, np.array((-0.3, -3.3, 0.0)))


SCANNER = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.5)


def drive(floor: FloorMap, pose: np.ndarray, boxes: np.ndarray) -> RecordLog:
    """Two seconds at rest, among boxes that no map knows."""
    virtual = VirtualScanner.of(Project(reflectors=ALIKE, scanners=(SCANNER,), floor_map=floor), SCANNER)
    rng, records = np.random.default_rng(0), list[Record]()
    for stamp in range(0, 2_000_000_000, 40_000_000):
        ranges, flags = virtual.scan(pose, boxes, rng)
        records += [
            Odometry(stamp, np.zeros(3)),
            Scan(
                stamp_ns=stamp,
                ranges=ranges,
                angle_min=SCANNER.angle_min,
                angle_increment=SCANNER.angle_increment,
                reflector=flags,
            ),
        ]
    return RecordLog.collect(records)


@pytest.mark.parametrize("pose", [(4.1, 3.3, 0.4), (6.0, 5.6, 2.0)])
def test_walls_tell_apart_what_reflectors_cannot_and_boxes_on_no_map_do_not_mislead(
    pose: tuple[float, float, float],
) -> None:
    floor, boxes = hall(), np.array([(3.2, 3.0, 0.3), (5.8, 4.6, 0.25), (5.2, 2.4, 0.3)])
    log = drive(floor, np.array(pose), boxes)
    setup = LocalizerSetup(reflectors=ALIKE, scanners=(SCANNER,), parameters=Parameters(), floor=floor)
    for each, found in ((setup, True), (dataclasses.replace(setup, floor=None), False)):
        columns = run(log, each, state_unlocated(0, search_map(each).anywhere))
        located = columns.modes != Mode.INITIALIZING
        assert located.any() == found
        np.testing.assert_allclose(columns.means[located], np.tile(pose, (located.sum(), 1)), atol=0.05)
