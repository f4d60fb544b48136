"""A virtual scanner sees reflectors as often as its table says, each by a chance of its own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.simulation.scan import VirtualScanner
from commission.site.disturbances import Disturbances, ShinyObject
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from tests.simulation.halls import QUIET

TABLE = ((5.0, 0.8), (15.0, 0.2))
PLACES = {"near": (3.0, 2.0), "between": (9.0, -4.0), "far": (-16.0, 3.0)}
SCANS = 2000
TURN = replace(QUIET, field_of_view_deg=(-180.0, 180.0), reflector_range=25.0)


def project(rates: tuple[tuple[float, float], ...], shiny: tuple[ShinyObject, ...] = ()) -> Project:
    reflectors = ReflectorMap(tuple(Reflector(id=id_, x=x, y=y, radius=0.1) for id_, (x, y) in PLACES.items()))
    scanner = replace(TURN, detection_rates=rates)
    return Project(reflectors=reflectors, scanners=(scanner,), disturbances=Disturbances(shiny_objects=shiny))


def flagged(site: Project, place: tuple[float, float], flags: np.ndarray) -> bool:
    """Whether the beam nearest to a place is flagged, from the origin."""
    beam = round((math.atan2(place[1], place[0]) - site.scanners[0].angle_min) / site.scanners[0].angle_increment)
    return bool(flags[beam])


def shares(site: Project, *more: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Share of scans that flag each place, and (SCANS, places) in which."""
    virtual, rng = VirtualScanner.of(site, site.scanners[0]), np.random.default_rng(1)
    places = (*PLACES.values(), *more)
    seen = np.array(
        [
            [flagged(site, place, flags) for place in places]
            for _, flags in (virtual.scan(np.zeros(3), np.empty((0, 3)), rng) for _ in range(SCANS))
        ]
    )
    return seen.mean(axis=0), seen


def test_reflectors_are_seen_as_often_as_the_table_says_each_by_its_own_chance():
    found, seen = shares(project(TABLE))
    # By hand: at 3.6 m as at 5; at 9.849 m 0.8 - 0.6 * 0.4849; at 16.3 m as at 15.
    expected = np.array([0.8, 0.5091, 0.2])
    sigmas = np.sqrt(expected * (1.0 - expected) / SCANS)
    assert (np.abs(found - expected) < 4.0 * sigmas).all()
    both = (seen[:, 0] & seen[:, 1]).mean()
    assert both == pytest.approx(0.8 * 0.5091, abs=4.0 * math.sqrt(0.24 / SCANS))


def test_what_is_not_seen_still_stands_in_the_way():
    site = project(((0.0, 0.0),))
    ranges, flags = VirtualScanner.of(site, site.scanners[0]).scan(
        np.zeros(3), np.empty((0, 3)), np.random.default_rng(1)
    )
    assert not flags.any()
    assert np.nanmin(ranges) == pytest.approx(math.hypot(3.0, 2.0) - 0.1, abs=2e-3)


def test_shiny_objects_are_taken_for_reflectors_in_every_scan():
    found, _ = shares(project(((0.0, 0.0),), (ShinyObject(0.0, 6.0, 0.1),)), (0.0, 6.0))
    assert found.tolist() == [0.0, 0.0, 0.0, 1.0]


def test_a_table_of_all_scans_changes_no_flag():
    without, (_, with_table) = project(()), shares(project(((5.0, 1.0),)))
    assert with_table.all()
    virtual, rng = VirtualScanner.of(without, without.scanners[0]), np.random.default_rng(1)
    assert all(flagged(without, p, virtual.scan(np.zeros(3), np.empty((0, 3)), rng)[1]) for p in PLACES.values())


def test_scans_without_the_other_beams_show_the_same():
    site = project(TABLE)
    virtual = VirtualScanner.of(site, site.scanners[0])
    for seed in range(20):
        (_, whole), (_, part) = (
            virtual.scan(np.zeros(3), np.empty((0, 3)), np.random.default_rng(seed), whole=each)
            for each in (True, False)
        )
        assert np.array_equal(whole, part)
