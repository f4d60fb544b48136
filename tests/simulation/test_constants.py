"""The virtual world has errors of its own: none of them is the filter's, each is drawn once for a seed and told."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from commission.localization import whole_run
from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.simulation.constants import draw_truth, true_site
from commission.simulation.drive import DriveOptions, scaled
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.disturbances import ConstantErrors, Disturbances, ScannerError, WheelNoise
from commission.site.parameters import (
    AssociationParameters,
    DetectorParameters,
    ObservationParameters,
    OdometryParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.truth import TrueWheels, truth_told
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle
from commission.studies.metrics import pose_errors, reference_at
from tests.odometry_of import PRECISE
from tests.simulation.halls import QUIET, hall

ROUTE = "Out and back"
QUICK = DriveOptions(whole_scans=False)
ALL = ConstantErrors(
    survey_factor=1.0,
    survey_sigma=0.01,
    mounting_sigma=(0.01, 0.01, 0.01),
    range_bias_sigma=0.01,
    clock_offset_sigma=0.01,
    forward_scale_sigma=0.01,
    wheel_scale_sigma=0.01,
    separation_scale_sigma=0.01,
)
TRUTHS = {
    "survey_sigma": ("reflectors",),
    "mounting_sigma": ("mounting",),
    "range_bias_sigma": ("range_bias",),
    "clock_offset_sigma": ("clock_offset",),
    "forward_scale_sigma": ("forward_scale",),
    "wheel_scale_sigma": ("wheel_scales",),
    "separation_scale_sigma": ("separation_scale",),
}
"""What each constant changes of the truth."""


def with_errors(project: Project, **errors) -> Project:
    return replace(project, disturbances=replace(project.disturbances, constants=ConstantErrors(**errors)))


def same(one: RecordLog, other: RecordLog) -> bool:
    return (
        np.array_equal(one.order, other.order)
        and np.array_equal(one.stamps_ns, other.stamps_ns)
        and np.array_equal(one.displacements, other.displacements)
        and np.array_equal(one.reference_poses, other.reference_poses)
        and np.array_equal(one.scans[0].ranges, other.scans[0].ranges, equal_nan=True)
        and np.array_equal(one.scans[0].reflector, other.scans[0].reflector)
    )


def told(project: Project, seed: int) -> dict[str, object]:
    """Everything that is drawn for a seed, by its name."""
    truth = draw_truth(project, ROUTE, seed)
    scanner, wheels = truth.scanners[0], truth.wheels
    return {
        **{name: getattr(scanner, name) for name in ("mounting", "range_bias", "clock_offset")},
        **{name: getattr(wheels, name) for name in ("forward_scale", "wheel_scales", "separation_scale")},
        "reflectors": truth.reflectors,
    }


@pytest.mark.parametrize("name", [field.name for field in fields(OdometryParameters)])
def test_no_odometry_parameter_of_the_filter_changes_a_virtual_drive(name: str) -> None:
    site = hall(scanner=Scanner(resolution_deg=1.0))
    odometry = replace(site.parameters.odometry, **{name: 5.0 * getattr(site.parameters.odometry, name)})
    other = replace(site, parameters=replace(site.parameters, odometry=odometry))
    assert same(*(virtual_drive(each, ROUTE, 3, options=QUICK) for each in (site, other)))


def test_no_parameter_at_all_changes_a_virtual_drive() -> None:
    site = with_errors(hall(scanner=Scanner(resolution_deg=1.0)), survey_sigma=0.01, range_bias_sigma=0.01)
    parameters = Parameters(
        observation=ObservationParameters(range_sigma=0.5, bearing_sigma=0.5, range_bias=0.3),
        odometry=OdometryParameters(forward_per_sqrt_m=0.5, heading_per_sqrt_rad=0.5),
        detector=DetectorParameters(enabled=False, intensity_threshold=0.1, min_model_error=9, range_jump=0.01),
        association=AssociationParameters(enabled=False, gate_probability=0.5),
        supervisor=SupervisorParameters(enabled=False, position_limit=0.001),
    )
    one, other = (virtual_drive(each, ROUTE, 3, options=QUICK) for each in (site, replace(site, parameters=parameters)))
    assert same(one, other)
    assert one.truth == other.truth


@pytest.mark.parametrize("name", [field.name for field in fields(WheelNoise)])
def test_each_noise_of_the_true_wheels_changes_the_reported_motion_alone(name: str) -> None:
    site = hall(scanner=Scanner(resolution_deg=1.0))
    wheels = replace(WheelNoise(), **{name: 5.0 * getattr(WheelNoise(), name)})
    other = replace(site, disturbances=Disturbances(wheels=wheels))
    one, changed = (virtual_drive(each, ROUTE, 3, options=QUICK) for each in (site, other))
    assert not np.array_equal(one.displacements, changed.displacements)
    assert np.array_equal(one.reference_poses, changed.reference_poses)
    assert np.array_equal(one.scans[0].ranges, changed.scans[0].ranges, equal_nan=True)
    assert changed.truth.wheels.noise == wheels


def test_constants_are_nothing_unless_the_project_says_otherwise() -> None:
    truth = draw_truth(hall(), ROUTE, 3)
    assert truth.reflectors == ()
    assert truth.scanners == (ScannerError(scanner="scanner"),)
    assert truth.wheels == TrueWheels(noise=WheelNoise())
    assert [what for what, _ in truth_told(truth)] == ["wheels", "scanner", "reflectors"]


def test_constants_are_the_same_for_the_same_seed_and_others_for_another() -> None:
    site = replace(hall(), disturbances=Disturbances(constants=ALL))
    one, again, other = (told(site, seed) for seed in (7, 7, 8))
    assert one == again
    assert all(one[name] != other[name] for name in one)


@pytest.mark.parametrize("name", TRUTHS)
def test_turning_a_constant_on_changes_neither_the_others_nor_the_noise_of_the_drive(name: str) -> None:
    site = hall(scanner=Scanner(resolution_deg=1.0))
    alone, none = with_errors(site, **{name: getattr(ALL, name)}), told(site, 3)
    together = told(replace(site, disturbances=Disturbances(constants=ALL)), 3)
    for key, value in told(alone, 3).items():
        assert value == (together if key in TRUTHS[name] else none)[key]
    before, after = (virtual_drive(each, ROUTE, 3, options=QUICK) for each in (site, alone))
    assert np.array_equal(before.reference_poses, after.reference_poses)
    is_wheel = "scale" in name
    assert np.array_equal(before.displacements, after.displacements) is not is_wheel
    seen = before.scans[0].ranges.shape == after.scans[0].ranges.shape and np.array_equal(
        before.scans[0].ranges, after.scans[0].ranges, equal_nan=True
    )
    # A clock that is late stamps the same scans; one that is early loses the first.
    assert seen is (is_wheel or (name == "clock_offset_sigma" and after.truth.scanners[0].clock_offset >= 0.0))


def test_reflectors_stand_off_by_their_own_sigma_and_those_without_by_the_stated_one() -> None:
    known = tuple(Reflector(id=f"K{i}", x=float(i), y=0.0, sigma=0.002) for i in range(400))
    unknown = tuple(Reflector(id=f"U{i}", x=float(i), y=1.0) for i in range(400))
    site = with_errors(Project(reflectors=ReflectorMap((*known, *unknown))), survey_factor=2.0, survey_sigma=0.01)
    truth = draw_truth(site, "", 1)
    off = true_site(site, truth).reflectors.centers - site.reflectors.centers
    # 800 draws each: 1-sigma of a standard deviation is 2.5 %; four of them.
    assert np.std(off[:400]) == pytest.approx(0.004, rel=0.1)
    assert np.std(off[400:]) == pytest.approx(0.01, rel=0.1)
    assert abs(np.corrcoef(off[:, 0], off[:, 1])[0, 1]) < 0.15
    assert len(draw_truth(with_errors(site, survey_sigma=0.01), "", 1).reflectors) == 400


def test_a_reflector_taken_off_the_map_leaves_the_others_where_they_stand() -> None:
    site = with_errors(hall(), survey_sigma=0.01)
    fewer = replace(site, reflectors=ReflectorMap(site.reflectors.reflectors[1:]))
    assert draw_truth(fewer, ROUTE, 3).reflectors == draw_truth(site, ROUTE, 3).reflectors[1:]


def test_a_scanner_turned_by_a_degree_sees_everything_a_degree_to_the_right() -> None:
    still = DriveOptions(start_sigma=(0.0, 0.0, 0.0))
    site = hall(scanner=replace(QUIET, resolution_deg=0.5, beam_width_deg=0.0))
    turned = with_errors(site, scanners=(ScannerError(scanner="scanner", mounting=(0.0, 0.0, math.radians(1.0))),))
    one, other = (virtual_drive(each, ROUTE, 1, options=still).scans[0] for each in (site, turned))
    # One degree is two beams: what beam i met is met by beam i - 2. Reflectors are flagged by the same geometry.
    assert np.array_equal(one.reflector[:10, 2:], other.reflector[:10, :-2])
    assert one.ranges[:10, 2:] == pytest.approx(other.ranges[:10, :-2], abs=1e-5, nan_ok=True)


def test_an_error_of_a_scanner_of_another_name_does_nothing() -> None:
    site = hall(scanner=Scanner(resolution_deg=1.0))
    other = with_errors(site, scanners=(ScannerError(scanner="rear", range_bias=0.5),))
    assert same(*(virtual_drive(each, ROUTE, 3, options=QUICK) for each in (site, other)))


def test_a_range_bias_is_added_to_each_range() -> None:
    site = hall(scanner=Scanner(resolution_deg=1.0))
    biased = with_errors(site, scanners=(ScannerError(scanner="scanner", range_bias=0.25),))
    one, other = (virtual_drive(each, ROUTE, 3).scans[0] for each in (site, biased))
    # Ranges are float32.
    np.testing.assert_allclose(other.ranges, one.ranges + 0.25, atol=1e-6)


@pytest.mark.parametrize("late_ns", [13_000_000, -13_000_000])
def test_a_clock_that_is_off_stamps_the_same_scans_at_other_times(late_ns: int) -> None:
    site = hall(scanner=Scanner(resolution_deg=1.0))
    off = with_errors(site, scanners=(ScannerError(scanner="scanner", clock_offset=late_ns * 1e-9),))
    one, other = (virtual_drive(each, ROUTE, 3) for each in (site, off))
    lost = 1 if late_ns < 0 else 0
    assert np.array_equal(other.scans[0].stamps_ns, one.scans[0].stamps_ns[lost:] + late_ns)
    assert np.array_equal(other.scans[0].ranges, one.scans[0].ranges[lost:])
    assert np.array_equal(other.reference_stamps_ns, one.reference_stamps_ns)
    assert (np.diff(other.stamps_ns) >= 0).all()
    assert other.stamps_ns[0] == 0


DIFFERENTIAL, TRICYCLE = DifferentialVehicle(wheel_separation=0.5), TricycleVehicle(wheelbase=1.2)
OMNIDIRECTIONAL = OmnidirectionalVehicle(wheel_angles_deg=(0.0, 120.0, 240.0))


@pytest.mark.parametrize(
    ("vehicle", "wheels", "true", "believed"),
    [
        # The left wheel reports 1.01 times 1 m/s: forward by half of it, turning right by 0.01 / 0.5.
        (DIFFERENTIAL, TrueWheels(wheel_scales=(0.01, 0.0)), (1.0, 0.0, 0.0), (1.005, 0.0, -0.02)),
        (DIFFERENTIAL, TrueWheels(forward_scale=0.01), (1.0, 0.0, 0.4), (1.01, 0.0, 0.404)),
        # Wheels 2 % farther apart run 2 % farther in a turn.
        (DIFFERENTIAL, TrueWheels(separation_scale=0.02), (1.0, 0.0, 0.4), (1.0, 0.0, 0.408)),
        (TRICYCLE, TrueWheels(wheel_scales=(0.01,)), (1.0, 0.0, 0.4), (1.01, 0.0, 0.404)),
        # A longer wheelbase steers farther for the same bend.
        (TRICYCLE, TrueWheels(separation_scale=0.02), (-1.0, 0.0, 0.4), (-1.0, 0.0, 0.408)),
        (OMNIDIRECTIONAL, TrueWheels(forward_scale=0.01), (0.3, -0.2, 0.4), (0.303, -0.202, 0.404)),
        (OMNIDIRECTIONAL, TrueWheels(separation_scale=0.02), (0.3, -0.2, 0.4), (0.3, -0.2, 0.408)),
    ],
)
def test_wheels_of_the_wrong_size_report_another_motion(vehicle, wheels, true, believed) -> None:
    assert scaled(np.array([true]), vehicle, wheels)[0] == pytest.approx(believed, abs=1e-12)


def test_wheels_as_the_vehicle_says_report_the_motion_to_the_last_bit() -> None:
    twists = np.random.default_rng(0).standard_normal((5, 3))
    assert scaled(twists, DIFFERENTIAL, TrueWheels(wheel_scales=(0.0, 0.0))) is twists


def anees(project: Project, *, believed: float = 1.0, true: float = 1.0) -> float:
    """Average NEES per degree of freedom over drives, wheels and what the filter thinks of them times a factor."""
    odometry = OdometryParameters(**{f.name: believed * getattr(PRECISE, f.name) for f in fields(WheelNoise)})
    wheels = WheelNoise(**{f.name: true * getattr(WheelNoise(), f.name) for f in fields(WheelNoise)})
    site = replace(project, disturbances=Disturbances(wheels=wheels))
    setup = LocalizerSetup.of(replace(site, parameters=replace(site.parameters, odometry=odometry)))
    start, nees = start_of(site, ROUTE), []
    for seed in range(8):
        log = virtual_drive(site, ROUTE, seed, options=QUICK)
        run = whole_run.run(log, setup, Belief(0, start.pose, np.diag(start.sigmas**2)))
        errors = pose_errors(run.means, reference_at(run.stamps_ns, log.reference_stamps_ns, log.reference_poses))
        nees.append(
            np.einsum("ki,ki->k", errors, np.linalg.solve(run.covariances, errors[..., None])[..., 0]).mean() / 3
        )
    return float(np.mean(nees))


@pytest.mark.with_all_seeds
def test_anees_moves_when_the_filters_figures_are_wrong() -> None:
    # A scanner that is trusted as little as it deserves: what is wrong is the odometry alone.
    site = hall(scanner=Scanner(resolution_deg=0.25, range_sigma=0.02, bearing_sigma_deg=0.1, rate=5.0))
    consistent = anees(site)
    too_careful, too_sure = anees(site, believed=5.0), anees(site, true=5.0)
    assert too_careful < 0.7 * consistent
    assert too_sure > 1.5 * consistent
