from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from commission.app.run import playback as playback_module
from commission.app.run.drives import Drive
from commission.app.run.playback import Playback
from commission.app.run.time_line import strip
from commission.app.run.view import RunView
from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.io.project_file import load_project
from commission.localization.estimate import Mode, Status
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.simulation.scenario import virtual_drive
from commission.site.fields import with_field
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.start import start_of

COVERED_FROM, COVERED_TO = 15, 75
"""Cycles in which no reflector is seen: with a limit of 30 mm the supervisor fails some seconds later."""


@pytest.fixture
def playback(result: RunResult) -> Playback:
    return Playback(result)


@pytest.fixture(scope="module")
def failing(project: Project, drive: Drive) -> RunResult:
    """A run that fails once while its reflectors are covered, and recovers when they are not."""
    tight = replace(project, parameters=with_field(project.parameters, "supervisor.position_limit", 0.03))
    inputs = RunInput.of(tight, drive.log, drive.start)
    return judged_run(inputs.with_cover(COVERED_FROM, covered=True).with_cover(COVERED_TO, covered=False))


def at(playback: Playback, seconds: float) -> RunView:
    playback.seek(seconds)
    return playback.view(covered=False)


def test_playing_lives_what_is_due_and_nothing_else(playback: Playback) -> None:
    playback.advance(1.05)
    assert playback.lived == 11
    view = playback.view(covered=False)
    assert view.result.times[view.newest] == pytest.approx(1.0)
    assert view.time == pytest.approx(1.05)


def test_played_backward_time_runs_back(playback: Playback) -> None:
    playback.seek(3.0)
    playback.advance(-1.05)
    assert playback.time == pytest.approx(1.95)
    assert playback.lived == 20
    playback.advance(-1e9)
    assert playback.at_start
    assert not playback.at_end


def test_what_stands_at_the_cursor_is_what_the_live_localizer_said_there(
    playback: Playback, project: Project, drive: Drive
) -> None:
    localizer = Localizer(LocalizerSetup.of(project), drive.start.belief)
    estimates = [estimate for record in drive.log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    # Not in order: the cursor costs nothing wherever it goes.
    for cycle in (40, 3, len(estimates) - 1, 0):
        playback.seek((estimates[cycle].stamp_ns - playback.start_ns) * 1e-9)
        view = playback.view(covered=False)
        assert view.estimate is not None
        assert view.pose.tobytes() == estimates[cycle].posterior.mean.tobytes()
        assert view.covariance.tobytes() == estimates[cycle].posterior.covariance.tobytes()
        assert view.estimate.points_map.tobytes() == estimates[cycle].points_map.tobytes()
        assert view.mode is estimates[cycle].mode


def test_steps_go_from_scan_to_scan_and_end_where_the_drive_does(playback: Playback) -> None:
    lived = []
    for cycles in (1, 1, 1, -1, 1, -1, -1, -1, -1, 1):
        playback.step(cycles)
        lived.append(playback.lived)
    # Before the first scan lies the start, at which the first one stands as well where the drive begins with it.
    assert lived[:7] == [2, 3, 4, 3, 4, 3, 2]
    assert lived[-1] == lived[-2] + 1 == 2
    playback.seek(1e9)
    playback.step(1)
    assert playback.lived == playback.result.cycles


def test_a_step_back_from_between_two_scans_goes_to_the_one_before_the_newest(playback: Playback) -> None:
    playback.seek(1.05)
    playback.step(-1)
    assert (playback.lived, playback.time) == (10, pytest.approx(0.9))


@pytest.mark.parametrize("seconds", [1e9, 1e300, float("inf")])
def test_a_seek_beyond_the_end_ends_at_the_end(playback: Playback, seconds: float) -> None:
    playback.seek(seconds)
    assert playback.at_end
    assert playback.time == pytest.approx(playback.result.duration)


def test_another_run_over_the_drive_leaves_the_cursor(playback: Playback, project: Project) -> None:
    before = at(playback, 2.0)
    wider = with_field(project.parameters, "association.gate_probability", 0.9999)
    setup = LocalizerSetup.of(replace(project, parameters=wider))
    playback.replace(judged_run(playback.result.inputs.with_setup(setup), earlier=playback.result))
    after = playback.view(covered=False)
    assert (after.time, after.lived) == (before.time, before.lived)
    assert after.estimate is not None and before.estimate is not None
    assert after.estimate.gate > before.estimate.gate
    assert np.ptp(after.gates, axis=1).mean() > 1.5 * np.ptp(before.gates, axis=1).mean()


def test_nothing_behind_the_cursor_is_counted_or_marked_as_lived(failing: RunResult) -> None:
    playback = Playback(failing)
    (episode,) = failing.episodes
    start, end = ((stamp - playback.start_ns) * 1e-9 for stamp in (episode.start_ns, episode.end_ns))
    # Uncovered after 7.5 s, it takes a few scans.
    assert 1.5 < start < 7.5 <= end < 8.0
    before = at(playback, start - 0.05)
    assert (before.lived_episodes, before.coming_episodes) == ((), ((start, end),))
    assert before.mode is Mode.OPERATIONAL
    within = at(playback, 0.5 * (start + end))
    assert within.mode is Mode.FAIL
    assert within.lived_episodes == ((start, within.time),)
    assert within.coming_episodes == ((within.time, end),)
    behind = at(playback, end)
    assert (behind.lived_episodes, behind.coming_episodes) == (((start, end),), ())


def test_an_episode_begins_with_its_cycle_and_not_before(failing: RunResult) -> None:
    playback = Playback(failing)
    first = int(np.flatnonzero(failing.columns.modes == Mode.FAIL)[0])
    start = float(failing.times[first])
    for seconds, count in ((start - 1e-6, 0), (start, 1)):
        view = at(playback, seconds)
        assert (len(view.lived_episodes), view.lived > first) == (count, count == 1)


def test_the_time_line_shows_what_is_lived_solid_and_what_is_computed_pale(failing: RunResult) -> None:
    playback = Playback(failing)
    start, end = at(playback, 0.0).coming_episodes[0]
    bars = {
        name: strip(at(playback, time))
        for name, time in (("before", start - 0.1), ("within", start + 0.1), ("behind", end))
    }
    counts = {
        name: (bar.count("opacity='1.0'"), bar.count("opacity='0.45'"), "data-episodes='1'" in bar)
        for name, bar in bars.items()
    }
    assert counts == {"before": (0, 1, False), "within": (1, 1, True), "behind": (1, 0, True)}
    assert "data-edits='2'" in bars["before"]


def test_what_was_covered_on_the_way_is_said_by_the_segment(failing: RunResult) -> None:
    playback = Playback(failing)
    assert at(playback, 0.0).edits == pytest.approx((1.5, 7.5))
    assert not at(playback, 1.4).segment.covered
    assert at(playback, 3.0).segment.covered
    # The scan is still there: what is covered does not shine, and is not gone.
    assert at(playback, 3.0).scan_map.size > 0
    assert at(playback, 3.0).estimate is not None
    assert len(at(playback, 3.0).estimate.status) == 0


def test_accumulated_detections_are_those_up_to_the_cursor(playback: Playback) -> None:
    columns = playback.result.columns
    points = columns.points_map()
    for seconds in (4.0, 0.0, 9.0):
        view = at(playback, seconds)
        rows = int(columns.offsets[view.lived])
        inlier = columns.status[:rows] == Status.INLIER
        assert view.accumulated is not None
        np.testing.assert_array_equal(view.accumulated.inliers, points[:rows][inlier])
        np.testing.assert_array_equal(view.accumulated.outliers, points[:rows][~inlier])
    assert playback.view(covered=False, whole=False).accumulated is None


def test_of_too_many_detections_some_are_drawn_over_the_whole_drive(
    result: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(playback_module, "MOST_POINTS", 50)
    view = at(Playback(result), 1e9)
    assert view.accumulated is not None
    every = result.columns.points_map()[result.columns.status == Status.INLIER]
    drawn = view.accumulated.inliers
    assert 25 <= len(drawn) <= 50
    np.testing.assert_array_equal(drawn, every[:: -(-len(every) // 50)])


def test_before_the_first_scan_the_vehicle_stands_at_its_initial_pose(project: Project, drive: Drive) -> None:
    records = [Odometry(0, np.zeros(3))]
    for k in range(1, 6):
        records += [Odometry(k * 10**8, np.zeros(3)), Detections(k * 10**8, np.array([[3.0, 0.1]]))]
    playback = Playback(judged_run(RunInput.of(project, RecordLog.collect(records), drive.start)))
    view = playback.view(covered=False)
    assert (view.lived, view.newest, view.estimate) == (0, -1, None)
    assert (view.lived_episodes, view.gates.size, view.mode) == ((), 0, Mode.OPERATIONAL)
    np.testing.assert_array_equal(view.pose, drive.start.belief.mean)
    # The sensor's own detections need no scan.
    view = at(playback, 1e9)
    assert view.lived == 5
    assert view.scan_map.shape == (0, 2)
    assert np.isnan(view.result.position_errors).all()


def test_points_of_the_first_scanner_and_of_the_others_are_told_apart(repository: Path) -> None:
    site = load_project(repository / "maps" / "loading_bay")
    site = replace(site, disturbances=site.disturbances.undisturbed())
    log = virtual_drive(site, site.routes[0].name, 1)
    playback = Playback(judged_run(RunInput.of(site, log, start_of(site, log))))
    playback.seek(4.0)
    view = playback.view(covered=False)
    assert 0 < view.first_scan < len(view.scan_map)
    # Each sees past another corner of the vehicle: none of its points lies where its field of view ends.
    parts = view.scan_map[: view.first_scan], view.scan_map[view.first_scan :]
    columns = view.result.columns
    for index, (scanner, points) in enumerate(zip(site.scanners, parts, strict=True)):
        # They take turns: each saw its points from where the vehicle was at its own scan.
        x, y, heading = columns.means[np.flatnonzero(columns.detected.scanners[: view.lived] == index)[-1]]
        c, s = np.cos(heading), np.sin(heading)
        offsets = (points - (x, y)) @ np.array([[c, -s], [s, c]]) - scanner.mounting[:2]
        bearings = wrap(np.arctan2(offsets[:, 1], offsets[:, 0]) - scanner.mounting[2])
        assert 130.0 < np.degrees(np.abs(bearings)).max() <= 137.5 + 1e-6


def test_points_of_a_scanner_upside_down_lie_on_the_walls(repository: Path) -> None:
    site = load_project(repository / "maps" / "shop_floor")
    scanner = replace(site.scanners[0], upside_down=True, field_of_view_deg=(-100.0, 60.0))
    site = replace(site, scanners=(scanner,), disturbances=site.disturbances.undisturbed())
    log = virtual_drive(site, site.routes[0].name, 1)
    playback = Playback(judged_run(RunInput.of(site, log, start_of(site, log))))
    view = at(playback, 4.0)
    assert site.floor_map is not None
    grid = site.floor_map.occupancy()
    cells = np.argwhere(grid.occupied.copy())[:, ::-1]
    centers = np.asarray(grid.origin[:2]) + (cells + 0.5) * grid.resolution
    apart = KDTree(np.concatenate((centers, site.reflectors.centers))).query(view.scan_map)[0]
    # Nothing else than walls and reflectors is met: noise of ranges, and errors of the pose.
    assert np.quantile(apart, 0.9) < 0.15


@pytest.mark.parametrize("upside_down", [False, True])
def test_beams_of_a_sweep_are_drawn_from_where_the_scanner_was_at_their_own_time(
    repository: Path, upside_down: bool
) -> None:
    """Beams that a reflector flagged lie on it while the vehicle turns; by the pose at the stamp they would not."""
    site = load_project(repository / "maps" / "shop_floor")
    timed = replace(site.scanners[0], rate=8.0, sweep_duration=0.125, upside_down=upside_down, range_sigma=0.0)
    site = replace(site, scanners=(timed,), disturbances=site.disturbances.undisturbed())
    log = virtual_drive(site, site.routes[0].name, 1)
    result = judged_run(RunInput.of(site, log, start_of(site, log)))
    playback, centers = Playback(result), KDTree(site.reflectors.centers)
    turns = np.abs(wrap(np.diff(result.columns.means[:, 2])))
    drawn, undone = [], []
    for cycle in np.argsort(turns)[-20:].tolist():
        scan = log.scans[0].scan(cycle)
        hit = np.isfinite(scan.ranges)
        flagged = scan.reflector[hit]
        points = at(playback, float(result.times[cycle]) + 1e-6).scan_map
        drawn += centers.query(points[flagged])[0].tolist()
        pose = result.columns.means[cycle]
        bearings = scan.bearings[hit][flagged] * (-1.0 if upside_down else 1.0)
        T_map_scanner = se2.compose(pose, timed.mounting)
        ends = scan.ranges[hit][flagged, np.newaxis] * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
        undone += centers.query(se2.transform_points(T_map_scanner, ends))[0].tolist()
    radius = float(site.reflectors.radii.max())
    assert len(drawn) > 100
    # A radius off its center, and what a beam's width and the estimate add.
    assert np.quantile(drawn, 0.95) < radius + 0.05
    assert np.quantile(undone, 0.95) > radius + 0.15
