"""Prediction along a route: the filter's own numbers. What virtual drives come to is in `test_error_budget`."""

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry.angles import difference
from commission.geometry.gaussian import chi_square_gate
from commission.localization import whole_run
from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.planning.error_budget import predict_errors
from commission.planning.nominal_drive import DrivePlan, NominalDrive, nominal_drive
from commission.planning.route_prediction import (
    Damage,
    PredictionOptions,
    RoutePrediction,
    plan_route,
    predict_route,
    restricted,
    station_scans,
)
from commission.site.parameters import (
    AssociationParameters,
    DetectorParameters,
    OdometryParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.zones import ObservationKind, Zone
from tests.planning.sites import open_field, surely_detected

LINE = ((2.0, 3.0), (6.0, -3.0), (11.0, 3.5), (15.0, -2.5), (19.0, 3.0))
NO_GATE = Parameters(association=AssociationParameters(enabled=False))


def exact_records(project, planned) -> RecordLog:
    """The planned drive as a recording without any noise."""
    drive, mounting = planned.drive, project.scanners[0].mounting
    records = []
    for k, stamp in enumerate(drive.stamps_ns.tolist()):
        before, now = drive.poses[max(k - 1, 0)], drive.poses[k]
        c, s = math.cos(before[2]), math.sin(before[2])
        dx, dy = now[:2] - before[:2]
        records.append(Odometry(stamp, np.array([c * dx + s * dy, c * dy - s * dx, now[2] - before[2]])))
        c, s = math.cos(now[2]), math.sin(now[2])
        scanner = now[:2] + np.array([c * mounting[0] - s * mounting[1], s * mounting[0] + c * mounting[1]])
        delta = project.reflectors.centers[planned.visible.of(k)] - scanner
        bearings = difference(np.arctan2(delta[:, 1], delta[:, 0]), now[2] + mounting[2])
        records.append(Detections(stamp, np.stack((np.hypot(*delta.T), bearings), axis=1)))
    return RecordLog.collect(records)


def test_prediction_equals_the_localizer_on_exact_records():
    project = open_field(LINE, parameters=NO_GATE)
    planned = surely_detected(plan_route(project, "Line"))
    predicted = predict_route(planned)
    start = Belief(0, planned.drive.poses[0], np.diag(np.square(planned.options.start_sigmas)))
    run = whole_run.run(exact_records(project, planned), LocalizerSetup.of(project), start)
    # The detections of a scan are the same ones in the same order; the means differ by rounding.
    np.testing.assert_allclose(predicted.covariances, run.covariances, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(predicted.prior_covariances, run.priors.rows().covariances, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(predicted.means, run.means, atol=1e-9)
    assert np.array_equal(predicted.modes, run.modes)


def test_where_a_zone_leaves_reflectors_out_the_prediction_is_the_localizer_that_does_not_use_them():
    project = open_field(LINE, parameters=NO_GATE)
    box = ((8.0, -9.0), (14.0, -9.0), (14.0, 9.0), (8.0, 9.0))
    zoned = replace(project, zones=(Zone(name="Hall", outline=box, kinds=(ObservationKind.CONTOURS,)),))
    seen, planned = (surely_detected(plan_route(each, "Line")) for each in (project, zoned))
    assert planned.way_without_reflectors == pytest.approx(6.0, abs=0.1)
    predicted = predict_route(planned)
    columns = whole_run.run(
        exact_records(project, seen),
        LocalizerSetup.of(zoned),
        Belief(0, planned.drive.poses[0], np.diag(np.square(PredictionOptions().start_sigmas))),
    )
    np.testing.assert_allclose(predicted.covariances, columns.covariances, rtol=1e-6, atol=1e-12)
    assert predicted.two_sigma[:, 0].max() > 1.5 * predict_route(seen).two_sigma[:, 0].max()


def test_nominal_drive_rests_and_keeps_to_the_speed_of_the_route():
    project = open_field(LINE)
    drive = nominal_drive(project.routes[0], project.vehicle, project.scanners, DrivePlan(rest=2.0))
    seconds = drive.stamps_ns * 1e-9
    assert drive.length == pytest.approx(20.0)
    assert np.all(drive.metres[seconds <= 2.0] == 0.0)
    assert np.all(np.diff(drive.metres) >= 0.0)
    assert np.diff(drive.metres).max() == pytest.approx(1.0 / 25.0)
    # Speeding up and braking at 0.4 m/s^2 each cost v / 2a = 1.25 s over constant speed; creeping off, a little more.
    assert seconds[-1] == pytest.approx(20.0 + 2.5 + 4.0, abs=0.3)


def test_without_reflectors_the_uncertainty_only_grows_until_the_supervisor_stops_the_vehicle():
    predicted = predict_route(plan_route(open_field(()), "Line"))
    assert np.all(np.diff(np.trace(predicted.covariances[:, :2, :2], axis1=1, axis2=2)) >= 0.0)
    assert predicted.on_odometry[-1] == pytest.approx(20.0)
    assert len(predicted.trips()) == 1
    assert len(predicted.recoveries()) == 0
    assert predicted.failing_metres()[-1] == 20


def test_straight_odometry_grows_as_its_parameters_say():
    odometry = OdometryParameters(
        forward_per_sqrt_m=0.01,
        lateral_per_sqrt_m=0.003,
        heading_per_sqrt_m=0.006,
        forward_per_sqrt_s=0.0,
        heading_per_sqrt_s=0.0,
    )
    project = open_field((), parameters=Parameters(odometry=odometry))
    predicted = predict_route(plan_route(project, "Line", PredictionOptions(start_sigmas=(1e-6, 1e-6, 1e-6))))
    xx, yy, tt = np.diagonal(predicted.covariances[-1])
    # After s metres: forward^2 s, lateral^2 s + heading^2 s^3 / 3, heading^2 s.
    assert xx == pytest.approx(0.01**2 * 20.0, rel=1e-6)
    assert yy == pytest.approx(0.003**2 * 20.0 + 0.006**2 * 20.0**3 / 3.0, rel=1e-6)
    assert tt == pytest.approx(0.006**2 * 20.0, rel=1e-6)


def test_a_vehicle_recovers_where_reflectors_come_in_sight_again():
    scanner_range = replace(open_field(LINE).scanners[0], reflector_range=5.0)
    parameters = Parameters(odometry=OdometryParameters(heading_per_sqrt_m=0.03))
    project = open_field([(1.0, 2.0), (2.0, -2.0), (18.0, 2.0), (19.0, -2.0)], scanner=scanner_range)
    predicted = predict_route(plan_route(replace(project, parameters=parameters), "Line"))
    (trip,), (recovery,) = predicted.trips(), predicted.recoveries()
    assert 6.0 < trip < recovery < 19.0
    per_metre = predicted.per_metre()
    assert np.array_equal(np.flatnonzero(per_metre.fails), np.arange(int(trip), int(recovery) + 1))
    assert per_metre.seen[0] > 0
    assert per_metre.seen[10] == 0


def test_people_who_block_rays_make_the_prediction_worse_and_never_better():
    project = open_field(LINE)
    free, crowded = (
        predict_route(plan_route(project, "Line", PredictionOptions(blocked_per_m=p))).two_sigma for p in (0.0, 0.2)
    )
    assert np.all(crowded[1:] >= free[1:] * (1.0 - 1e-12))
    assert crowded[200:].mean() > 1.2 * free[200:].mean()


def test_a_blocked_reflector_is_as_good_as_none():
    project = open_field(LINE)
    blocked = predict_route(plan_route(project, "Line"), Damage(blocked=(1,)))
    without = predict_route(plan_route(open_field([place for i, place in enumerate(LINE) if i != 1]), "Line"))
    np.testing.assert_allclose(blocked.covariances, without.covariances, rtol=1e-12)
    assert np.array_equal(blocked.seen, without.seen)


def test_a_moved_reflector_pulls_the_pose_by_less_than_it_moved_and_a_far_move_is_rejected():
    project = open_field(LINE)
    planned = plan_route(project, "Line")
    exact = predict_route(planned)
    assert np.abs(exact.bias).max() < 1e-9
    moved = predict_route(planned, Damage(moved=((0, 0.0, 0.03),)))
    assert 0.002 < np.hypot(*moved.bias[:, :2].T).max() < 0.03
    # Half a metre is outside every gate: as good as blocked.
    far, blocked = predict_route(planned, Damage(moved=((0, 0.0, 0.5),))), predict_route(planned, Damage(blocked=(0,)))
    np.testing.assert_allclose(far.covariances, blocked.covariances, rtol=1e-12)


def test_a_dirty_reflector_is_seen_from_near_by_only():
    planned = plan_route(open_field([(10.0, 1.0)], 20.0), "Line", PredictionOptions(dirty_range=0.25))
    clean, dirty = predict_route(planned), predict_route(planned, Damage(dirty=(0,)))
    assert clean.seen.all()
    distance = np.hypot(10.0 - dirty.drive.poses[:, 0], 1.0)
    assert np.array_equal(dirty.seen == 1, distance <= 0.25 * planned.farthest[0] + 1e-6)


def test_gate_probability_is_the_probability_of_a_detection():
    project = open_field(LINE)
    gated = replace(project, parameters=Parameters(association=AssociationParameters(gate_probability=0.7)))
    tight, wide = (predict_route(plan_route(each, "Line")).two_sigma.mean() for each in (gated, project))
    assert tight > 1.1 * wide
    assert chi_square_gate(0.7, 2) < chi_square_gate(0.95, 2)


def by_hand(position_sigma: list[float], heading_sigma: list[float], bias: list[float], modes: list[int]):
    """A prediction along the x-axis with these numbers; limits of 100 mm and 50 mrad."""
    count = len(modes)
    poses = np.zeros((count, 3))
    poses[:, 0] = 0.75 * np.arange(count)
    covariances = np.zeros((count, 3, 3))
    covariances[:, 1, 1], covariances[:, 2, 2] = np.square(position_sigma), np.square(heading_sigma)
    means = poses.copy()
    means[:, 1] += bias
    return RoutePrediction(
        drive=NominalDrive(np.arange(count) * 100_000_000, poses, poses[:, 0]),
        limits=SupervisorParameters(position_limit=0.1, heading_limit=0.05),
        prior_covariances=covariances,
        means=means,
        covariances=covariances,
        modes=np.array(modes, dtype=np.int8),
        seen=np.full(count, 2),
        on_odometry=np.zeros(count),
        innovations=np.zeros((0, 3)),
    )


def test_load_is_bias_and_two_sigma_as_a_share_of_the_limit_of_the_worst_axis():
    found = by_hand([0.01, 0.049, 0.051, 0.03, 0.0], [0.0, 0.0, 0.0, 0.0, 0.02], [0.0, 0.0, 0.0, 0.045, 0.0], [0] * 5)
    # 20 mm, 98 mm, 102 mm, 60 + 45 mm of 100 mm; 40 mrad of 50 mrad.
    np.testing.assert_allclose(found.limit_share, [0.2, 0.98, 1.02, 1.05, 0.8])
    np.testing.assert_allclose(found.two_sigma[:, 1], [0.02, 0.098, 0.102, 0.06, 0.0])
    np.testing.assert_allclose(found.bias[:, 1], [0.0, 0.0, 0.0, 0.045, 0.0])
    assert found.over_limit().tolist() == [False, False, True, True, False]


def test_a_metre_fails_where_the_load_is_above_one_or_the_supervisor_says_so():
    sigma = [0.01, 0.01, 0.06, 0.01, 0.01, 0.01]
    # Scans every 0.75 m: over the limit at 1.5 m, in fail mode from 1.5 to 2.25 m and at the end.
    found = by_hand(sigma, [0.0] * 6, [0.0] * 6, [0, 0, 1, 1, 0, 1])
    assert found.failing_metres().tolist() == [1, 2, 3]
    assert (found.trips().tolist(), found.recoveries().tolist()) == ([1.5, 3.75], [3.0])
    per_metre = found.per_metre()
    assert per_metre.fails.tolist() == [False, True, True, True]
    np.testing.assert_allclose(per_metre.two_sigma[:, 1], [0.02, 0.12, 0.02, 0.02])
    # Bias alone is no matter of the supervisor's mode.
    assert by_hand(sigma[:2], [0.0] * 2, [0.09, -0.09], [0, 0]).failing_metres().tolist() == [0]


def test_a_station_is_reached_within_its_distance_and_looking_its_way():
    turns = np.radians([0.0, 29.9, 30.1, -29.9, 180.0])
    poses = np.column_stack((np.zeros(5), np.zeros(5), turns))
    drive = NominalDrive(np.arange(5), poses, np.arange(5.0))

    def scans_at(x: float, y: float, heading: float) -> list[int]:
        station = Station(name="S", x=x, y=y, heading=heading)
        return [scan for _, scans in station_scans(drive, (station,)) for scan in scans.tolist()]

    assert scans_at(0.0, 0.199, 0.0) == [0, 1, 3]
    assert scans_at(-0.2, 0.0, 0.0) == [0, 1, 3]
    assert scans_at(0.201, 0.0, 0.0) == []
    # Across half a turn, and beside the route.
    assert scans_at(0.0, 0.0, math.radians(-160.0)) == [4]


def test_a_restricted_route_is_that_of_a_site_with_only_those_reflectors():
    kept = np.array([True, False, True, False, True])
    planned = plan_route(open_field(LINE), "Line")
    few = restricted(planned, kept)
    for scan in range(0, len(planned.drive), 50):
        assert few.visible.of(scan).tolist() == [m for m in planned.visible.of(scan).tolist() if kept[m]]
    alone = plan_route(open_field([place for place, stays in zip(LINE, kept, strict=True) if stays]), "Line")
    np.testing.assert_array_equal(predict_route(few).covariances, predict_route(alone).covariances)


def test_a_reflector_that_is_detected_in_few_scans_is_relied_on_as_little():
    # Equation 3 rejects most of what beams of 1 deg see.
    printed = Parameters(detector=DetectorParameters(expected_beams="equation_3"))
    project = open_field(LINE, scanner=Scanner(beam_width_deg=1.0, resolution_deg=0.25), parameters=printed)
    planned = plan_route(project, "Line")
    sure = surely_detected(planned)
    assert (predict_route(planned).two_sigma >= predict_route(sure).two_sigma - 1e-12).all()
    assert (predict_route(planned).seen <= predict_route(sure).seen).all()
    assert predict_route(planned).seen.sum() < predict_route(sure).seen.sum()
    inliers = [predict_errors(each, predict_route(each)).inliers.sum() for each in (planned, sure)]
    assert inliers[0] < 0.5 * inliers[1]
