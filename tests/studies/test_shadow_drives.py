"""Drives without beams: in distribution what the beams of the virtual scanner and the detector give, fault by fault."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from commission.geometry.se2 import compose
from commission.localization.detection_log import extract_detections
from commission.localization.setup import LocalizerSetup
from commission.simulation.drive import DriveOptions
from commission.simulation.scenario import virtual_drive
from commission.site.disturbances import ConstantErrors, CoveredPeriod, Disturbances, ShinyObject, TiltedStretch
from commission.site.floor_map import OCCUPIED
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.shadow_drives import ShadowWorld, needs_beams, shadow_drive
from tests.conftest import few_of
from tests.simulation.halls import corner_reflectors, hall, room

ROUTE = "Out and back"
SCANNER = Scanner(
    field_of_view_deg=(-137.5, 137.5), resolution_deg=0.275, rate=25.0, mounting=np.array([0.3, 0.1, 0.2])
)
LIBRARY_SCANS = 8 * 128
"""Scans at each distance of the library: what is drawn from them knows a variance no better than they do."""
BEYOND = norm.isf(1e-5)
"""Each of some hundred comparisons fails by chance once in 50,000 times."""


def in_hall(scanner: Scanner = SCANNER, **fields: Any) -> Project:
    """The room with five reflectors off the walls: one of another size, one in the middle."""
    more = (Reflector(id="M", x=6.0, y=4.5, radius=0.05), Reflector(id="B", x=1.0, y=6.5, radius=0.08))
    moved = tuple(replace(each, x=0.4 + 0.93 * each.x, y=0.4 + 0.9 * each.y) for each in corner_reflectors().reflectors)
    return replace(hall(scanner=scanner), reflectors=ReflectorMap((*moved, *more)), **fields)


def plates() -> Project:
    places = [(0.5, 4.0, 0.0), (6.0, 7.5, -np.pi / 2), (11.5, 4.0, np.pi), (6.0, 0.5, np.pi / 2)]
    kind = ReflectorKind.FLAT
    flat = (Reflector(id=f"P{n}", x=x, y=y, radius=0.1, kind=kind, heading=h) for n, (x, y, h) in enumerate(places))
    return replace(in_hall(), reflectors=ReflectorMap(tuple(flat)))


class Found:
    """Detections of a drive beside the truth, a row each."""

    def __init__(self, project: Project, log: RecordLog) -> None:
        detected = extract_detections(log, LocalizerSetup.of(project))
        kept = detected.status == 0
        self.scans = np.repeat(np.arange(len(detected)), np.diff(detected.offsets))[kept]
        self.stamps = detected.stamps_ns
        where = np.searchsorted(log.reference_stamps_ns, self.stamps[self.scans])
        scanner = project.scanners[0]
        pose = compose(log.reference_poses[where], scanner.mounting)
        seen = detected.range_bearing[kept] * (1.0, -1.0 if scanner.upside_down else 1.0)
        angle = pose[:, 2] + seen[:, 1]
        points = pose[:, :2] + seen[:, :1] * np.stack((np.cos(angle), np.sin(angle)), 1)
        centers = project.reflectors.centers
        apart = np.hypot(*(points[:, np.newaxis] - centers).transpose(2, 0, 1))
        self.reflector, self.misses = apart.argmin(1), apart.min(1)
        offset = centers[self.reflector] - pose[:, :2]
        self.distances = np.hypot(*offset.T)
        bearing = np.arctan2(offset[:, 1], offset[:, 0]) - pose[:, 2]
        self.range_errors = seen[:, 0] - self.distances
        self.bearing_errors = np.angle(np.exp(1j * (seen[:, 1] - bearing)))
        bearings = np.arctan2(*(centers - pose[:, np.newaxis, :2]).transpose(2, 0, 1)[::-1]) - pose[:, 2:]
        mine = np.take_along_axis(bearings, self.reflector[:, np.newaxis], 1)
        between = np.abs(np.angle(np.exp(1j * (bearings - mine))))
        np.put_along_axis(between, self.reflector[:, np.newaxis], np.inf, 1)
        inside = np.abs(np.angle(np.exp(1j * mine[:, 0]))) < np.radians(134.0)
        facing = np.array([each.heading or 0.0 for each in project.reflectors.reflectors])[self.reflector]
        incidence = np.abs(np.angle(np.exp(1j * (facing - bearing - pose[:, 2] - np.pi))))
        flat = np.array([each.kind is ReflectorKind.FLAT for each in project.reflectors.reflectors])[self.reflector]
        inside &= ~flat | (incidence < np.radians(55.0))
        self.alone = inside & (between.min(1) > np.radians(4.0))
        """Whole, for beams and without: no other reflector beside it, and not at the edge of the field of view."""

    def pairs(self) -> set[tuple[int, int]]:
        return set(zip(self.scans.tolist(), self.reflector.tolist(), strict=True))


@functools.cache
def world_of(name: str) -> ShadowWorld:
    """The library takes longer than the drives."""
    return ShadowWorld.of(VARIANTS[name], LocalizerSetup.of(VARIANTS[name]), (ROUTE,))


def both(project: Project, seeds: range = range(1, 3)) -> list[tuple[Found, Found]]:
    """The same true motion, by beams and without."""
    world = ShadowWorld.of(project, LocalizerSetup.of(project), (ROUTE,))
    options = DriveOptions(whole_scans=False)
    logs = [
        (virtual_drive(project, ROUTE, seed, options=options), shadow_drive(world, project, ROUTE, seed))
        for seed in seeds
    ]
    for beams, shadows in logs:
        assert np.array_equal(beams.odometry_stamps_ns, shadows.odometry_stamps_ns)
        assert np.array_equal(beams.displacements, shadows.displacements)
        assert np.array_equal(beams.reference_poses, shadows.reference_poses)
        assert beams.truth == shadows.truth
    return [(Found(project, beams), Found(project, shadows)) for beams, shadows in logs]


def agree(one: np.ndarray, other: np.ndarray, name: str) -> None:
    """Means and variances agree as well as their samples, and the library, tell them."""
    sizes = np.array([len(one), len(other), LIBRARY_SCANS])
    both = np.concatenate((one - one.mean(), other - other.mean()))
    variance, fourth = np.mean(both**2), np.mean(both**4)
    assert abs(one.mean() - other.mean()) < BEYOND * np.sqrt((variance / sizes).sum()), name
    assert abs(one.var() - other.var()) < BEYOND * np.sqrt(((fourth - variance**2) / sizes).sum()), name


VARIANTS = {
    "posts": in_hall(),
    "upside down": in_hall(replace(SCANNER, upside_down=True)),
    "a sweep": in_hall(replace(SCANNER, sweep_duration=0.04)),
    "coarse beams": in_hall(replace(SCANNER, resolution_deg=0.5, beam_width_deg=0.5, bearing_sigma_deg=0.1)),
    "plates": plates(),
}


@pytest.mark.parametrize("name", few_of(tuple(VARIANTS), ("plates",)))
def test_share_seen_and_residuals_are_those_of_beams_at_every_distance(name: str) -> None:
    found = both(VARIANTS[name])
    columns = ("distances", "range_errors", "bearing_errors")
    # What is seen in part (at the edge of the field of view, or beside another reflector) is not claimed.
    beams, shadows = ([np.concatenate([getattr(f[i], c)[f[i].alone] for f in found]) for c in columns] for i in (0, 1))
    assert len(beams[0]) > 2000
    for low, high in ((0.5, 3.0), (3.0, 5.0), (5.0, 7.0), (7.0, 12.0)):
        chosen = [(each[0] >= low) & (each[0] < high) for each in (beams, shadows)]
        counts = [np.count_nonzero(each) for each in chosen]
        # Of the same poses: the two differ by what is missed by chance, in each of them by itself.
        tried = max(counts)
        missed = max(1.0, tried - counts[0], tried - counts[1])
        assert abs(counts[0] - counts[1]) <= BEYOND * np.sqrt(2.0 * missed + 2.0 * tried / LIBRARY_SCANS) + 1, name
        if min(counts) > 200:
            for column in (1, 2):
                agree(beams[column][chosen[0]], shadows[column][chosen[1]], f"{columns[column]} at {low} to {high} m")


def test_a_wall_hides_the_same_reflectors_but_where_its_edge_cuts_through_one() -> None:
    floor = room()
    cells = floor.cells.copy()
    cells[60:100, 118:122] = OCCUPIED  # 3 to 5 m in y, at 6 m
    project = in_hall(floor_map=replace(floor, cells=cells))
    few = tuple(each for each in project.reflectors.reflectors if each.id != "M")
    open_hall = replace(in_hall(), reflectors=ReflectorMap(few))
    ((beams, shadows),) = both(replace(project, reflectors=ReflectorMap(few)), range(1, 2))
    ((unhidden, _),) = both(open_hall, range(1, 2))
    hidden = unhidden.pairs() - beams.pairs()
    assert len(hidden) > 100
    # At 0.5 m/s an edge takes about 0.4 s (10 scans) to pass a post of 0.16 m; it passes a few posts a few times.
    assert len(beams.pairs() ^ shadows.pairs()) < 0.2 * len(hidden)


def test_detection_rates_and_dirt_are_shares_of_what_is_seen() -> None:
    project = in_hall(replace(SCANNER, detection_rates=((2.0, 0.9), (8.0, 0.5))))
    world = ShadowWorld.of(project, LocalizerSetup.of(project), (ROUTE,))
    dirt = {"R1": 0.6, "B": 1.0}
    found = [
        Found(project, virtual_drive(project, ROUTE, 5, options=DriveOptions(whole_scans=False), dirt=dirt)),
        Found(project, shadow_drive(world, project, ROUTE, 5, dirt=dirt)),
    ]
    names = [each.id for each in project.reflectors.reflectors]
    counts = np.array([np.bincount(each.reflector[each.alone], minlength=len(names)) for each in found])
    assert (counts[:, names.index("B")] == 0).all()
    # Each count is a sum of independent chances: no larger variance than itself.
    assert (np.abs(counts[0] - counts[1]) < BEYOND * np.sqrt(counts.sum(axis=0) + 1.0)).all()
    clean = Found(project, shadow_drive(world, project, ROUTE, 5))
    # Where the distance says 50 to 90 %, the dirt leaves 40 % of them; a share of two counts, one a part of the other.
    share = counts[1, 1] / np.count_nonzero((clean.reflector == 1) & clean.alone)
    assert share == pytest.approx(0.4, abs=BEYOND * np.sqrt(0.6 / counts[1, 1]) + 0.02)


def test_what_covers_hides_tilts_and_shines_does_so_without_beams() -> None:
    disturbances = Disturbances(
        covered=(CoveredPeriod(5.0, 2.0),),
        shiny_objects=(ShinyObject(9.0, 0.2, 0.05),),
        tilted_stretches=(TiltedStretch(4.0, 2.0, 0.5, 3.0),),
        dropped_scans=0.1,
        constants=ConstantErrors(range_bias_sigma=0.05, clock_offset_sigma=0.01, mounting_sigma=(0.02, 0.02, 0.02)),
    )
    project = in_hall(disturbances=disturbances)
    for beams, shadows in both(project, range(1, 3)):
        # Which scans are lost has its own random numbers: those of both are the same.
        assert np.array_equal(beams.stamps, shadows.stamps)
        hidden = (beams.stamps >= 5.1e9) & (beams.stamps < 6.9e9)
        assert not np.isin(shadows.scans, np.flatnonzero(hidden)).any()
        near = [(each.misses < 0.5) & each.alone for each in (beams, shadows)]
        counts = [np.count_nonzero(each) for each in near]
        assert abs(counts[0] - counts[1]) < 0.02 * max(counts)
        one, other = beams.range_errors[near[0]], shadows.range_errors[near[1]]
        assert one.mean() == pytest.approx(other.mean(), abs=BEYOND * one.std() * np.sqrt(3.0 / LIBRARY_SCANS))


def test_moved_missing_and_new_reflectors_are_seen_where_they_are() -> None:
    project, world = VARIANTS["posts"], world_of("posts")
    each = project.reflectors.reflectors
    changed = (replace(each[1], x=each[1].x - 0.3), replace(each[2], y=each[2].y + 0.01), *each[3:])
    now = replace(project, reflectors=ReflectorMap(changed))
    found = Found(now, shadow_drive(world, now, ROUTE, 2))
    assert found.misses[found.alone].max() < 0.15
    assert set(found.reflector.tolist()) == set(range(len(changed)))


def test_the_same_seed_gives_the_same_drive_and_another_one_another() -> None:
    project, world = VARIANTS["posts"], world_of("posts")
    one, again, other = (shadow_drive(world, project, ROUTE, seed) for seed in (3, 3, 4))
    assert np.array_equal(one.range_bearing, again.range_bearing)
    assert len(one.range_bearing) != len(other.range_bearing) or not np.array_equal(
        one.range_bearing, other.range_bearing
    )


def test_people_glints_and_intensities_need_beams() -> None:
    own = Disturbances()
    assert needs_beams(own) == ""
    assert needs_beams(replace(own, people=1, glints_per_scan=0.1)) == "people and glints"
    assert needs_beams(replace(own, intensity=replace(own.intensity, enabled=True))) == "intensities"
