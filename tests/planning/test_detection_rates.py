"""What is planned reckons with how often the scanner sees reflectors: everywhere by the same share."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.planning.detection_noise import Worth, detection_noise, detection_quality, detection_table, worth
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.planning.visibility import VisibilityOptions
from commission.site.parameters import DetectorParameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.studies.coverage import CoverageInput, CoverageOptions, coverage
from commission.studies.detector_problems import detector_findings
from commission.studies.sight import SightInput, sight

TABLE = ((5.0, 0.8), (15.0, 0.12))
HALF = 5.0 + 10.0 * (0.8 - 0.5) / (0.8 - 0.12)
"""Where the table says that every other scan sees a reflector, by hand [m]: 9.41."""
ALL_ROUND = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.25, beam_width_deg=0.5)
POST = ReflectorMap((Reflector(id="R", x=0.0, y=0.0, radius=0.05),))
DETECTOR = DetectorParameters()


def by_hand(distance: float) -> float:
    """Share of the scans that see a reflector."""
    return min(max(0.8 - 0.068 * (distance - 5.0), 0.12), 0.8)


@pytest.mark.parametrize("distance", [0.4, 3.0, 4.9, 6.0, 9.0, 12.0, 14.0, 16.0, 19.9])
def test_the_probability_of_detection_is_that_of_the_detector_times_the_share_of_the_table(distance: float) -> None:
    always = worth(detection_noise(POST, ALL_ROUND, DETECTOR), 0, distance)
    seldom = worth(detection_noise(POST, replace(ALL_ROUND, detection_rates=TABLE), DETECTOR), 0, distance)
    # Between two distances of the table, 7 % apart, the bend at an entry is cut: by at most 0.068 / m * 1 m / 4.
    assert seldom.probability == pytest.approx(always.probability * by_hand(distance), abs=0.018)
    assert seldom[1:] == always[1:]


def test_each_scanner_has_its_own_rates() -> None:
    scanners = ALL_ROUND, replace(ALL_ROUND, detection_rates=((0.0, 0.25),))
    quality = detection_quality(POST, scanners, DETECTOR)
    one, other = (Worth(*worth(quality.noise, int(quality.classes[s, 0]), 4.0)).probability for s in (0, 1))
    assert other == pytest.approx(0.25 * one)


def test_what_the_detector_rejects_and_the_beams_miss_is_told_as_without_rates() -> None:
    thick = replace(ALL_ROUND, beam_width_deg=0.86, beam_aperture=0.008)
    printed = DetectorParameters(expected_beams="equation_3")
    without, given = (
        detection_table(POST, replace(thick, detection_rates=rates), printed)
        for rates in ((), ((5.0, 0.8), (15.0, 0.0)))
    )
    seen = given.rates > 0.0
    assert seen.any()
    assert not seen.all()
    np.testing.assert_allclose(given.rejected()[:, seen], without.rejected()[:, seen], atol=1e-12)
    assert (given.rejected()[:, ~seen] == 0.0).all()
    assert np.array_equal(given.shown, without.shown)


def site(distance: float, rates: tuple[tuple[float, float], ...]) -> Project:
    """Three reflectors at a distance from a station at the origin."""
    turns = np.radians([0.0, 100.0, 220.0])
    reflectors = ReflectorMap(
        tuple(
            Reflector(id=f"R{i}", x=distance * math.cos(turn), y=distance * math.sin(turn), radius=0.05)
            for i, turn in enumerate(turns.tolist())
        )
    )
    return Project(
        reflectors=reflectors,
        scanners=(replace(ALL_ROUND, detection_rates=rates),),
        stations=(Station(name="Here", x=0.0, y=0.0, heading=0.0),),
    )


@pytest.mark.parametrize(("distance", "visible"), [(HALF - 0.15, 3), (HALF + 0.15, 0)])
def test_reflectors_count_as_visible_where_every_other_scan_sees_them(distance: float, visible: int) -> None:
    here = site(distance, TABLE)
    seen = vehicle_visibility(here, VisibilityOptions(detector=DETECTOR))
    assert seen.visible_from_poses(np.zeros((1, 3))).counts().tolist() == [visible]
    found = [each.text for each in sight(SightInput.of(here)).problems]
    assert bool(found) == (visible == 0)
    assert not sight(SightInput.of(site(distance, ()))).problems


def test_coverage_counts_what_every_other_scan_sees() -> None:
    near, far = (
        coverage(CoverageInput.of(_with_floor(site(distance, TABLE)), CoverageOptions(spacing=0.5)))
        for distance in (HALF - 0.5, HALF + 0.5)
    )
    at_origin = [
        each.coverage.fixes.visible[np.argmin(np.hypot(*each.coverage.lattice.points().T))] for each in (near, far)
    ]
    assert at_origin == [3, 0]


def _with_floor(project: Project) -> Project:
    """The site with a little floor around its station."""
    from commission.site.floor_map import FREE, FloorMap

    cells = np.full((20, 20), FREE, dtype=np.int8)
    return replace(project, floor_map=FloorMap(cells, 0.05, np.array([-0.5, -0.5, 0.0])))


def test_where_reflectors_are_seldom_seen_is_a_problem_of_the_scanner() -> None:
    (text,) = [
        each.text
        for each in detector_findings(POST, replace(ALL_ROUND, detection_rates=TABLE), DETECTOR)
        if "detection rates" in each.text
    ]
    # The distances of the table are 7 % apart.
    assert float(text.split(" m on")[0].rsplit(" ", 1)[1]) == pytest.approx(HALF * 1.035, rel=0.04)
    assert "12 % at worst" in text
    near = detector_findings(POST, replace(ALL_ROUND, detection_rates=TABLE), DETECTOR, farthest=HALF)
    assert not [each for each in near if "detection rates" in each.text]
    half = detector_findings(POST, replace(ALL_ROUND, detection_rates=((0.0, 0.5),)), DETECTOR)
    assert not [each for each in half if "detection rates" in each.text]


def test_a_table_of_all_scans_changes_no_bit() -> None:
    one, other = (detection_noise(POST, replace(ALL_ROUND, detection_rates=r), DETECTOR) for r in ((), ((3.0, 1.0),)))
    assert np.array_equal(one.columns, other.columns)
