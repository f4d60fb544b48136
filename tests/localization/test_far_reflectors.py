"""Centers of reflectors that only a few beams meet: far away, between two beams, or partly hidden."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.localization.detector import detect
from commission.localization.estimate import Status
from commission.localization.setup import LocalizerSetup
from commission.simulation.scan import VirtualScanner
from commission.site.project import Project
from commission.site.records import Scan
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

STEP_DEG = 0.275
SCANNER = replace(Scanner(), resolution_deg=STEP_DEG, field_of_view_deg=(-10.5 * STEP_DEG, 10.5 * STEP_DEG))
"""Its two middle beams pass to the left and to the right of straight ahead."""


@pytest.mark.parametrize("distance", [21.0, 23.0, 24.5])
def test_reflector_between_two_wide_beams_is_not_drawn_nearer_by_its_radius(distance: float) -> None:
    scanner = replace(SCANNER, reflector_range=30.0, bearing_sigma_deg=0.0, range_sigma=0.001)
    project = Project(
        reflectors=ReflectorMap((Reflector(id="Far", x=distance, y=0.0, radius=0.05),)), scanners=(scanner,)
    )
    virtual, setup = VirtualScanner.of(project, project.scanners[0]), LocalizerSetup.of(project)
    ranges, flags = virtual.scan(np.zeros(3), np.empty((0, 3)), np.random.default_rng(0))
    scan = Scan(
        stamp_ns=0,
        ranges=ranges,
        angle_min=scanner.angle_min,
        angle_increment=scanner.angle_increment,
        intensities=None,
        reflector=flags,
    )
    seen = detect(scan, setup.detectors[0], setup.parameters.detector)
    assert seen.beams.tolist() == [2]
    # Two beams of 1 mm noise, and no bias of the lit parts.
    assert seen.range_bearing[0] == pytest.approx([distance, 0.0], abs=0.003)


SHOP_SCANNER = replace(Scanner(), resolution_deg=0.25, field_of_view_deg=(-5.0, 5.0), reflector_range=30.0)


def errors_of(distance: float, radius: float, hidden: float, scans: int = 600) -> np.ndarray:
    """Errors of range [m] and bearing [rad] of a reflector at evenly many bearings between two beams.

    `hidden` is the share of its width, from the left, behind a post at two thirds of the way.
    """
    project = Project(
        reflectors=ReflectorMap((Reflector(id="R", x=distance, y=0.0, radius=radius),)), scanners=(SHOP_SCANNER,)
    )
    virtual, setup = VirtualScanner.of(project, project.scanners[0]), LocalizerSetup.of(project)
    rng, post = np.random.default_rng(0), 0.1
    # The post's right edge on the line to the point at which the hidden part ends.
    edge = radius * (1.0 - 2.0 * hidden) * 2.0 / 3.0
    posts = np.array([[2.0 / 3.0 * distance, edge + post, post]]) if hidden else np.empty((0, 3))
    found = []
    for place in (np.arange(scans) + 0.5) / scans:
        heading = (place - 0.5) * SHOP_SCANNER.angle_increment
        ranges, flags = virtual.scan(np.array([0.0, 0.0, heading]), posts, rng)
        scan = Scan(
            stamp_ns=0,
            ranges=ranges,
            angle_min=SHOP_SCANNER.angle_min,
            angle_increment=SHOP_SCANNER.angle_increment,
            intensities=None,
            reflector=flags,
        )
        seen = detect(scan, setup.detectors[0], setup.parameters.detector)
        passed = seen.range_bearing[seen.status == Status.INLIER]
        found += list(passed + np.array([-distance, heading]))
    return np.array(found)


@pytest.mark.parametrize("distance", [3.0, 6.0, 10.0, 14.0, 18.0, 24.0])
def test_centers_have_no_bias_at_any_distance(distance: float) -> None:
    errors = errors_of(distance, 0.045, 0.0)
    # The mean of 600 draws of 10 mm scatters by 0.4 mm; what is left of the bias is below 1 mm.
    assert abs(errors[:, 0].mean()) < 0.002
    assert abs(errors[:, 1].mean()) < 3.0 * 0.3 * SHOP_SCANNER.angle_increment / math.sqrt(len(errors))


@pytest.mark.parametrize(("distance", "hidden"), [(4.0, 0.4), (6.0, 0.4), (8.0, 0.4)])
def test_center_of_a_partly_hidden_reflector_is_not_drawn_to_what_is_left_of_it(distance: float, hidden: float) -> None:
    errors = errors_of(distance, 0.045, hidden)
    assert len(errors) > 100
    # The middle of what is left is off by half of what is hidden.
    off = 0.045 * hidden / distance
    assert abs(errors[:, 1].mean()) < 0.35 * off
