"""The coverage study: what it counts as floor, and what its summary says of it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.planning.coverage import LiveCoverage
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap
from commission.site.parameters import SupervisorParameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.zones import ObservationKind, Zone
from commission.studies.coverage import (
    CoverageInput,
    CoverageOptions,
    CoverageResult,
    coverage,
    summary,
    within_limits,
)

CORNERS = ReflectorMap(
    tuple(Reflector(id=str(i), x=x, y=y) for i, (x, y) in enumerate([(0.5, 0.5), (9.5, 0.5), (9.5, 5.5), (0.5, 5.5)]))
)

REFLECTORS, CONTOURS, TAGS = ObservationKind
ALL = ((-1.0, -1.0), (11.0, -1.0), (11.0, 7.0), (-1.0, 7.0))

TURNING = Scanner(resolution_deg=0.1, field_of_view_deg=(-180.0, 180.0))


def hall() -> Project:
    """A 10 m x 6 m hall; its left fifth is unknown, a wall of one cell crosses it at x = 6 m."""
    cells = np.full((60, 100), FREE, dtype=np.int8)
    cells[:, :20] = UNKNOWN
    cells[:, 60] = OCCUPIED
    return Project(floor_map=FloorMap(cells, 0.1), reflectors=CORNERS, scanners=(TURNING,))


def covered(project: Project, spacing: float, blocked_per_m: float = 0.0) -> CoverageResult:
    return coverage(CoverageInput.of(project, CoverageOptions(spacing=spacing, blocked_per_m=blocked_per_m)))


def told(project: Project, spacing: float, blocked_per_m: float = 0.0) -> dict[str, int | float | None]:
    return summary(covered(project, spacing, blocked_per_m), project.parameters.supervisor)


def test_floor_is_what_the_map_knows_to_be_free():
    project = hall()
    on = covered(project, 0.5).drivable.reshape(12, 20)
    # The lattice has points at 0.25 m, 0.75 m, ...: none of them lies in the wall.
    assert not on[:, :4].any()
    assert on[:, 4:].all()
    assert told(project, 0.5)["area_m2"] == pytest.approx(8.0 * 6.0)


def test_a_wall_between_two_pairs_of_reflectors_leaves_two_on_each_side():
    project = hall()
    entries = told(project, 0.5)
    assert (entries["visible_min"], entries["visible_mean"]) == (2, 2.0)
    assert (entries["share_2_visible"], entries["share_3_visible"], entries["share_with_fix"]) == (1.0, 0.0, 1.0)
    assert "expected_visible_mean" not in entries


def test_people_lower_what_is_expected_to_be_seen():
    project = hall()
    entries = told(project, 0.5, blocked_per_m=0.1)
    assert 0.0 < entries["two_or_more_mean"] < entries["expected_visible_mean"] < entries["visible_mean"]


def test_without_reflectors_nothing_is_promised_and_quantiles_do_not_exist():
    project = Project(floor_map=hall().floor_map)
    entries = told(project, 1.0)
    assert (entries["share_with_fix"], entries["share_within_limits"]) == (0.0, 0.0)
    assert entries["position_sigma_median_m"] is None


def test_a_site_that_is_all_wall_has_no_shares():
    project = Project(floor_map=FloorMap(np.full((5, 5), OCCUPIED, dtype=np.int8), 1.0), reflectors=CORNERS)
    entries = told(project, 1.0)
    assert (entries["points"], entries["visible_mean"], entries["heading_sigma_p95_rad"]) == (0, None, None)


def with_figures(found: CoverageResult, **figures: list[float]) -> CoverageResult:
    """The same floor, of which the first points have other figures, and are all that counts as drivable."""
    fixes, on = found.coverage.fixes, np.zeros(len(found.drivable), dtype=np.bool_)
    changed = {}
    for name, values in figures.items():
        changed[name] = np.array(getattr(fixes, name), dtype=np.float64)
        changed[name][: len(values)] = values
        on[: len(values)] = True
    return replace(found, coverage=replace(found.coverage, fixes=fixes._replace(**changed)), drivable=on)


def test_two_sigma_of_position_and_of_heading_are_held_against_the_limits():
    # Limits of 100 mm and 3 degrees: half of each, a hair more and a hair less.
    position = [0.05, 0.0501, 0.0499, 0.01, 0.01, 0.06, math.inf]
    heading = np.radians([0.1, 0.1, 1.5, 1.501, 1.499, 1.6, 0.1]).tolist()
    found = with_figures(covered(hall(), 0.5), position_sigma=position, heading_sigma=heading)
    limits = SupervisorParameters(position_limit=0.1, heading_limit=math.radians(3.0) + 1e-12)
    expected = [True, False, True, False, True, False, False]
    assert within_limits(found.coverage, limits)[:7].tolist() == expected
    entries = summary(found, limits)
    assert entries["share_within_limits"] == pytest.approx(3 / 7)
    assert entries["share_with_fix"] == pytest.approx(6 / 7)


def test_quantiles_are_those_of_the_drivable_floor_and_none_where_they_have_no_fix():
    tenths = [0.01 * n for n in range(1, 21)]
    found = with_figures(covered(hall(), 0.5), position_sigma=tenths, heading_sigma=[*tenths[:18], math.inf, math.inf])
    entries = summary(found, SupervisorParameters())
    # The value that half (19 of 20) do not exceed, of 10, 20, ... 200 mm.
    assert (entries["position_sigma_median_m"], entries["position_sigma_p95_m"]) == pytest.approx((0.11, 0.2))
    assert entries["heading_sigma_median_rad"] == pytest.approx(0.11)
    assert entries["heading_sigma_p95_rad"] is None


def test_a_zone_leaves_out_reflectors_or_contours_of_the_floor_it_covers():
    left = ((-1.0, -1.0), (5.0, -1.0), (5.0, 7.0), (-1.0, 7.0))
    zones = (Zone(name="Left", outline=left, kinds=(CONTOURS,)), Zone(name="All", outline=ALL, kinds=(REFLECTORS,)))
    site = hall()
    walls = CoverageOptions(spacing=0.5, with_contours=True)
    result = coverage(CoverageInput.of(replace(site, zones=zones), walls))
    plain = coverage(CoverageInput.of(site, walls))
    is_left = result.coverage.lattice.points()[:, 0] < 5.0
    fixes, before = result.coverage.fixes, plain.coverage.fixes
    assert not fixes.visible[is_left].any()
    assert np.isinf(fixes.position_sigma[is_left]).all()
    assert fixes.visible[~is_left].tolist() == before.visible[~is_left].tolist()
    assert fixes.position_sigma[~is_left].tolist() == before.position_sigma[~is_left].tolist()
    assert result.contours is not None and plain.contours is not None
    assert not result.contours.told[~is_left].any()
    assert result.contours.position_sigma[is_left].tolist() == plain.contours.position_sigma[is_left].tolist()
    # A reflector that is dragged does not bring it back.
    live = LiveCoverage(result.visible, result.coverage)
    live.move(0, replace(CORNERS.reflectors[0], x=1.0))
    assert not live.coverage.fixes.visible[is_left].any()
