"""Centers of reflectors so far away that no beam's middle meets them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.localization.detector import detect
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
    project = Project(reflectors=ReflectorMap((Reflector("Far", distance, 0.0, radius=0.05),)), scanner=scanner)
    virtual, setup = VirtualScanner.of(project), LocalizerSetup.of(project)
    ranges, flags = virtual.scan(np.zeros(3), np.empty((0, 3)), np.random.default_rng(0))
    scan = Scan(0, ranges, scanner.angle_min, scanner.angle_increment, None, flags)
    seen = detect(scan, setup.detector, setup.parameters.detector)
    assert seen.beams.tolist() == [2]
    # The lit part of a beam is not known: a fifth of the radius remains, 10 mm.
    assert seen.range_bearing[0] == pytest.approx([distance, 0.0], abs=0.010)
