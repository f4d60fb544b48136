"""Figures of each reflector against a slow plain recount of a run, scan by scan, with formulas of its own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.localization.estimate import Status
from commission.localization.setup import LocalizerSetup
from commission.progress import silent
from commission.site.fields import with_field
from commission.site.floor_map import OCCUPIED
from commission.studies.reflector_figures import ReflectorFigures, ReflectorFiguresInput, reflector_figures
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.start import start_of
from tests.app.sites import room
from tests.studies.test_run import hall, replayed, standing_still


def figures(run: RunResult, floor_map=None) -> ReflectorFigures:
    return reflector_figures(ReflectorFiguresInput.of(run, floor_map))


@pytest.fixture(scope="module")
def driven() -> RunResult:
    """A drive in a room whose gate rejects some, and half of which has another map: one reflector less, one moved."""
    from commission.app.run.actions import VirtualDrive
    from commission.app.run.drives import prepare

    project = room()
    narrow = replace(project, parameters=with_field(project.parameters, "association.gate_probability", 0.6))
    drive = prepare(project, VirtualDrive(project.routes[0].name, seed=1), silent)
    run = judged_run(RunInput.of(narrow, drive.log, drive.start))
    kept = project.reflectors.reflectors[1:]
    changed = replace(narrow, reflectors=replace(project.reflectors, reflectors=(replace(kept[0], x=0.27), *kept[1:])))
    return judged_run(run.inputs.with_setup(LocalizerSetup.of(changed), run.cycles // 2), earlier=run)


def test_every_figure_equals_a_plain_recount(driven: RunResult) -> None:
    found = figures(driven, room().floor_map)
    accepted: dict[str, list[tuple[float, float]]] = {name: [] for name in found.names}
    near, scans, last = ({name: [] for name in found.names} for _ in range(3))
    for cycle in range(driven.cycles):
        estimate, setup = driven.columns.estimate(cycle), driven.columns.segment(cycle).setup
        px, py, heading = estimate.prior.mean
        mx, my, turn = setup.scanners[0].mounting
        sx, sy = (
            px + math.cos(heading) * mx - math.sin(heading) * my,
            py + math.sin(heading) * mx + math.cos(heading) * my,
        )
        for (distance, bearing), status, named, d2 in zip(
            estimate.detections, estimate.status, estimate.reflector, estimate.d2, strict=True
        ):
            if status == Status.OUTLIER_DETECTOR:
                continue
            index = named
            if named < 0:
                x, y = (
                    sx + distance * math.cos(heading + turn + bearing),
                    sy + distance * math.sin(heading + turn + bearing),
                )
                index = min(range(len(setup.reflectors)), key=lambda i: math.dist(setup.reflectors.centers[i], (x, y)))
            reflector = setup.reflectors.reflectors[index]
            true = math.hypot(reflector.x - sx, reflector.y - sy)
            along = distance - setup.parameters.observation.range_bias - true
            off = bearing - math.atan2(reflector.y - sy, reflector.x - sx) + heading + turn
            across = true * math.remainder(off, 2.0 * math.pi)
            if status == Status.INLIER:
                accepted[reflector.id].append((along, across))
                last[reflector.id].append(driven.times[cycle])
            if status == Status.INLIER or math.hypot(along, across) < 1.0:
                near[reflector.id].append(d2)  # NaN where the filter found nobody in its search
                scans[reflector.id].append(cycle)
    assert set(found.names) == {"R1", "R2", "R3", "R4"}
    assert found.rejected.sum() > 10
    for number, name in enumerate(found.names):
        pairs = np.array(accepted[name])
        assert found.accepted[number] == len(pairs)
        assert found.rejected[number] == len(near[name]) - len(pairs)
        assert found.seen[number] == len(set(scans[name]))
        if not near[name]:
            assert math.isnan(found.nis[number])
            assert math.isnan(found.last_seen[number])
            continue
        assert found.nis[number] == pytest.approx(np.nanmean(near[name]), rel=1e-9)
        assert found.last_seen[number] == pytest.approx(max(last[name]), abs=1e-9)
        for axis, (mean, spread) in enumerate(
            ((found.along_mean, found.along_spread), (found.across_mean, found.across_spread))
        ):
            assert mean[number] == pytest.approx(pairs[:, axis].mean(), rel=1e-6, abs=1e-9)
            assert spread[number] == pytest.approx(pairs[:, axis].std(ddof=1), rel=1e-6)
    assert sum(map(bool, near.values())) >= 3
    # The one that the second map does not have was seen in the first half alone, and stands where that map says.
    assert found.last_seen[0] < 0.51 * driven.duration
    assert found.places[:2].tolist() == [[0.25, 2.0], [0.27, 6.5]]


def test_a_reflector_that_was_surveyed_a_hand_off_is_seen_and_rejected_and_not_unseen() -> None:
    site = hall()
    one, *others = site.reflectors.reflectors
    askew = replace(site, reflectors=replace(site.reflectors, reflectors=(replace(one, x=one.x + 0.3), *others)))
    run = replayed(site, standing_still(50))
    found = figures(judged_run(run.inputs.with_setup(LocalizerSetup.of(askew)), earlier=run))
    seen = figures(run).seen
    assert seen[0] > 0
    assert (found.seen[0], found.rejected[0], found.accepted[0]) == (seen[0], seen[0], 0)
    assert found.seen[1:].tolist() == seen[1:].tolist()


def test_all_in_free_sight_are_expected_in_every_scan_and_none_behind_a_wall() -> None:
    run = replayed(hall(), standing_still(50))
    assert figures(run).expected.tolist() == [50] * 5
    # A wall before the third reflector, which stands at (9, 3.5), seen from the origin.
    site = room().floor_map
    assert site is not None
    cells = np.zeros_like(site.cells)
    cells[30:42, 80:83] = OCCUPIED  # x 4.0 to 4.15 m, y 1.5 to 2.1 m; the line passes (4.1, 1.59)
    walled = replace(site, cells=cells)
    assert figures(run, walled).expected.tolist() == [50, 50, 0, 50, 50]


def test_nothing_is_expected_while_reflectors_are_covered_or_out_of_reach() -> None:
    run = replayed(hall(), standing_still(50))
    covered = judged_run(run.inputs.with_cover(20, covered=True), earlier=run)
    assert figures(covered).expected.tolist() == [20] * 5
    project = hall()
    short = replace(project, scanners=(replace(project.scanners[0], reflector_range=4.0),))
    # Distances from the origin: 3.6, 6.7, 9.7, 4.7, 3.0 m.
    assert figures(replayed(short, standing_still(10))).expected.tolist() == [10, 0, 0, 0, 10]


def test_a_reflector_that_is_never_seen_has_no_figures_but_is_in_the_list() -> None:
    project = hall()
    run = replayed(project, standing_still(30, blind=range(30)))
    found = figures(run)
    assert len(found) == 5
    assert found.seen.tolist() == found.accepted.tolist() == found.rejected.tolist() == [0] * 5
    for values in (found.along_mean, found.along_spread, found.across_mean, found.nis, found.last_seen):
        assert np.isnan(values).all()


def test_a_rejected_detection_counts_for_a_reflector_within_a_metre_alone() -> None:
    run = replayed(hall(), standing_still(30))
    columns = run.columns
    for away, counts in ((0.9, True), (1.1, False)):
        measured = columns.range_bearing.copy()
        status = columns.status.copy()
        of_first = columns.reflector == 0
        measured[of_first, 0] = math.hypot(2.0, 3.0) + away
        status[of_first] = Status.OUTLIER_ASSOCIATION
        changed = replace(run, columns=replace(columns, range_bearing=measured, status=status))
        assert figures(changed).rejected[0] == (np.count_nonzero(of_first) if counts else 0)
        assert figures(changed).accepted[0] == 0


def test_a_run_without_reflectors_has_no_rows() -> None:
    project = replace(hall(), reflectors=replace(hall().reflectors, reflectors=()))
    log = replayed(hall(), standing_still(5)).inputs.log
    run = judged_run(RunInput.of(project, log, start_of(project, log, (0.0, 0.0, 0.0))))
    assert len(figures(run)) == 0
