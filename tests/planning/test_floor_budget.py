"""The budget of a fix over the floor: without constants the figures of coverage, with them simulated least squares."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.planning.dilution import Heading, Measurement
from commission.planning.error_budget import CONTRIBUTIONS
from commission.planning.floor_budget import BudgetSite, floor_budget
from commission.site.project import Project
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from commission.studies.coverage import CoverageInput, CoverageOptions, CoverageResult, coverage
from tests.planning.driven import EXACT
from tests.planning.sites import open_field

LINE = ((2.0, 3.0), (6.0, -3.0), (11.0, 3.5), (15.0, -2.5))
LEVER, HEADING = (0.6, -0.3, 0.4), 0.7
FRONT = Scanner(mounting=LEVER, field_of_view_deg=(-180.0, 180.0))
REAR = Scanner(name="rear", mounting=(-0.8, 0.5, 2.9), field_of_view_deg=(-135.0, 135.0))
BLIND = Scanner(mounting=LEVER, field_of_view_deg=(-180.0, 180.0), blind_sectors_deg=((-25.0, 25.0),))
COARSE = replace(REAR, detection_range_sigma=0.08, detection_bearing_sigma_deg=1.0)
SPEED = 0.8


def field(*scanners: Scanner) -> Project:
    return replace(open_field(LINE), scanners=scanners)


def covered(project: Project, heading: Heading, **changes: object) -> CoverageResult:
    options = CoverageOptions(heading=heading, given_heading=HEADING, spacing=2.5)
    inputs = CoverageInput.of(project, replace(options, **changes))  # pyright: ignore[reportArgumentType]
    return coverage(inputs)


def budget(result: CoverageResult, uncertainty: Uncertainty):
    return floor_budget(result.coverage, BudgetSite(visible=result.visible, uncertainty=uncertainty, speed=SPEED))


@pytest.mark.parametrize("measurement", list(Measurement))
@pytest.mark.parametrize(
    "scanners",
    [(FRONT,), (FRONT, REAR), (BLIND,), (BLIND, REAR), (FRONT, COARSE)],
    ids=["one", "two", "blind ahead", "one of two blind", "unequal"],
)
@pytest.mark.parametrize("heading", list(Heading))
def test_without_constants_it_is_the_position_error_of_the_coverage(heading, scanners, measurement) -> None:
    result = covered(field(*scanners), heading, measurement=measurement)
    found, expected = budget(result, EXACT), result.coverage.fixes.position_sigma
    np.testing.assert_array_equal(np.isfinite(found.sigma), np.isfinite(expected))
    has_fix = np.isfinite(expected)
    assert has_fix.any()
    np.testing.assert_allclose(found.sigma[has_fix], expected[has_fix], rtol=1e-6)
    np.testing.assert_array_equal(found.shares[has_fix], np.tile([1.0, 0.0, 0.0, 0.0, 0.0], (has_fix.sum(), 1)))
    assert {part for part, there in zip(found.largest, has_fix, strict=True) if there} == {"noise"}


def measured(pose: np.ndarray, mounting: np.ndarray, centers: np.ndarray) -> np.ndarray:
    """Ranges, then bearings, of reflectors from a scanner that is mounted so."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y = pose[0] + c * mounting[0] - s * mounting[1], pose[1] + s * mounting[0] + c * mounting[1]
    d = centers - (x, y)
    return np.concatenate((np.hypot(*d.T), np.arctan2(d[:, 1], d[:, 0]) - pose[2] - mounting[2]))


def differences(function, at: np.ndarray) -> np.ndarray:
    return np.stack([(function(at + d) - function(at - d)) / 2e-6 for d in 1e-6 * np.eye(len(at))], axis=1)


@pytest.mark.parametrize("part", ["map", "mounting", "range", "clock", "all"])
def test_constants_move_a_least_squares_fix_as_the_budget_says(part: str) -> None:
    known = Uncertainty()
    fields = {
        "map": ("survey",),
        "mounting": ("mounting_position", "mounting_heading"),
        "range": ("range_bias",),
        "clock": ("clock",),
    }
    chosen = [name for kind, names in fields.items() if part in (kind, "all") for name in names]
    uncertainty = replace(EXACT, **{name: getattr(known, name) for name in chosen})
    project = field(FRONT)
    result = covered(project, Heading.GIVEN)
    found = budget(result, uncertainty)
    fix = result.coverage.options
    centers = project.reflectors.centers
    mounting = np.array(LEVER)
    sees_all = np.flatnonzero(result.coverage.fixes.visible == len(centers))
    assert len(sees_all) > 5
    for index in sees_all[:: len(sees_all) // 4]:
        x, y = result.coverage.lattice.points()[index]
        pose = np.array([x, y, HEADING])
        by_pose = differences(lambda p: measured(p, mounting, centers), pose)
        r = measured(pose, mounting, centers)[: len(centers)]
        noise = np.concatenate((np.full(len(r), fix.range_sigma**2), np.full(len(r), fix.bearing_sigma**2)))
        survey = uncertainty.survey**2 * np.concatenate((np.ones(len(r)), 1.0 / r**2))
        gain = np.linalg.solve(by_pose.T @ np.diag(1.0 / (noise + survey)) @ by_pose, by_pose.T / (noise + survey))
        by_mounting = differences(lambda m, pose=pose: measured(pose, m, centers), mounting)
        moved = by_pose[:, :2] @ [math.cos(HEADING), math.sin(HEADING)]
        covariances = {
            "noise": np.diag(noise),
            "map": np.diag(survey),
            "mounting": by_mounting
            @ np.diag([uncertainty.mounting_position**2] * 2 + [uncertainty.mounting_heading**2])
            @ by_mounting.T,
            "range": uncertainty.range_bias**2 * np.outer(*[np.repeat([1.0, 0.0], len(r))] * 2),
            "clock": (uncertainty.clock * SPEED) ** 2 * np.outer(moved, moved),
        }
        each = {name: (gain @ of @ gain.T)[:2, :2] for name, of in covariances.items()}
        values, vectors = np.linalg.eigh(sum(each.values()))
        assert found.sigma[index] == pytest.approx(math.sqrt(values[1]), rel=1e-6)
        shares = [vectors[:, 1] @ each[name] @ vectors[:, 1] / values[1] for name in CONTRIBUTIONS]
        np.testing.assert_allclose(found.shares[index], shares, atol=1e-6)


def test_a_scanner_displaced_on_its_vehicle_displaces_the_vehicle_as_far() -> None:
    result = covered(field(replace(FRONT, mounting=(0.0, 0.0, 0.0))), Heading.ALL_ROUND)
    found = budget(result, replace(EXACT, mounting_position=0.002))
    alone = result.coverage.fixes.position_sigma
    np.testing.assert_allclose(found.sigma**2, alone**2 + 0.002**2, rtol=1e-6)


def test_two_scanners_share_what_each_of_them_is_displaced_by() -> None:
    # At the same place and with the same field of view, each constant counts half: 1 / sqrt(2) of one scanner's.
    twin = replace(FRONT, name="twin")
    displaced = replace(EXACT, mounting_position=0.05)
    added: list[np.ndarray] = []
    for scanners in ((FRONT,), (FRONT, twin)):
        result = covered(field(*scanners), Heading.GIVEN)
        has_fix = np.isfinite(result.coverage.fixes.position_sigma)
        found = budget(result, displaced)
        added.append(found.sigma[has_fix] ** 2 * found.shares[has_fix, CONTRIBUTIONS.index("mounting")])
    # Displacements of a scanner are alike in all directions, so that the longest axis is that of the noise.
    np.testing.assert_allclose(added[1], 0.5 * added[0], rtol=1e-9)
