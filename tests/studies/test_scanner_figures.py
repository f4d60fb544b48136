"""Mean residuals of each scanner against a slow plain recount, detection by detection, with formulas of its own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.localization.setup import LocalizerSetup
from commission.progress import silent
from commission.site.fields import with_field
from commission.site.reflectors import ReflectorMap
from commission.studies.run import RunInput, RunResult, judged_run, references_of
from commission.studies.scanner_figures import scanner_figures
from tests.app.sites import room


@pytest.fixture(scope="module")
def driven() -> RunResult:
    """A drive with two scanners and a range bias; its second half has a map with one reflector 0.2 m off."""
    from commission.app.run.actions import VirtualDrive
    from commission.app.run.drives import prepare

    project = room()
    (scanner,) = project.scanners
    project = replace(
        project,
        scanners=(scanner, replace(scanner, name="rear", mounting=(-0.3, 0.1, math.pi))),
        parameters=with_field(project.parameters, "observation.range_bias", 0.02),
    )
    drive = prepare(project, VirtualDrive(project.routes[0].name, seed=1), silent)
    run = judged_run(RunInput.of(project, drive.log, drive.start))
    first, *others = project.reflectors.reflectors
    changed = replace(project, reflectors=ReflectorMap((replace(first, x=first.x + 0.2), *others)))
    return judged_run(run.inputs.with_setup(LocalizerSetup.of(changed), run.cycles // 2), earlier=run)


def recounted(run: RunResult, poses: np.ndarray, index: int) -> tuple[float, float, int]:
    """Mean residuals [m, rad] of one scanner's detections within a metre of their reflector, and how many these are."""
    ranges, bearings, far = [], [], 0
    for cycle in range(run.cycles):
        estimate, setup = run.columns.estimate(cycle), run.columns.segment(cycle).setup
        if run.columns.detected.scanners[cycle] != index or not np.isfinite(poses[cycle]).all():
            continue
        px, py, heading = poses[cycle]
        mx, my, turn = setup.scanners[index].mounting
        sx = px + math.cos(heading) * mx - math.sin(heading) * my
        sy = py + math.sin(heading) * mx + math.cos(heading) * my
        for (distance, bearing), named in zip(estimate.detections, estimate.reflector, strict=True):
            if named < 0:
                continue
            x, y = setup.reflectors.centers[named]
            along = distance - setup.parameters.observation.range_bias - math.hypot(x - sx, y - sy)
            off = math.remainder(bearing - math.atan2(y - sy, x - sx) + heading + turn, 2.0 * math.pi)
            if math.hypot(along, (distance - along) * off) < 1.0:
                ranges.append(along)
                bearings.append(off)
            else:
                far += 1
    return float(np.mean(ranges)), float(np.mean(bearings)), far


def test_mean_residuals_equal_a_plain_recount_against_estimate_and_reference(driven: RunResult) -> None:
    references = references_of(driven.inputs.log, driven.columns)
    references[::7] = math.nan
    # So far off that some lie just nearer than a metre, and others just farther.
    references[::5, 0] += 0.99
    far = 0
    for index, figures in enumerate(scanner_figures(driven.columns, references)):
        own, known = (recounted(driven, poses, index) for poses in (driven.columns.means, references))
        assert (figures.range_residual, figures.bearing_residual) == pytest.approx(own[:2], abs=1e-12)
        assert (figures.reference_range_residual, figures.reference_bearing_residual) == pytest.approx(
            known[:2], abs=1e-12
        )
        assert figures.accepted > 100
        far += own[2] + known[2]
    # The other side of the limit was met as well.
    assert far > 10


def test_without_any_reference_only_the_residuals_against_the_estimate_are_known(driven: RunResult) -> None:
    for figures in scanner_figures(driven.columns, np.full((driven.cycles, 3), math.nan)):
        assert math.isfinite(figures.range_residual)
        assert math.isnan(figures.reference_range_residual)
        assert math.isnan(figures.reference_bearing_residual)


def test_without_reflectors_no_residual_is_known(driven: RunResult) -> None:
    (segment, *_) = driven.inputs.segments
    bare = LocalizerSetup(
        reflectors=ReflectorMap(()), scanners=segment.setup.scanners, parameters=segment.setup.parameters
    )
    run = judged_run(replace(driven.inputs, segments=(replace(segment, setup=bare),)))
    assert all(math.isnan(each.range_residual) and each.accepted == 0 for each in run.scanners)
