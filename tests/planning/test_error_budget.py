"""The error along a route and what it comes from: the filter's own covariance where it fits, and drives elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from commission.geometry.arrays import read_only
from commission.localization import whole_run
from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.planning.detection_noise import DetectionNoise
from commission.planning.error_budget import CONTRIBUTIONS, PredictedErrors, predict_errors
from commission.planning.error_kernels import ErrorModel, propagate_errors
from commission.planning.route_prediction import PredictionOptions, plan_route, predict_route
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.disturbances import Disturbances
from commission.site.parameters import (
    AssociationParameters,
    FilterParameters,
    ObservationParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.uncertainty import Uncertainty
from commission.studies.metrics import pose_errors, reference_at
from tests.constants_as_known import constants_as_known
from tests.odometry_of import PRECISE
from tests.planning.driven import EXACT, QUICK
from tests.planning.sites import open_field, surely_detected

LINE = ((2.0, 3.0), (6.0, -3.0), (11.0, 3.5), (15.0, -2.5), (19.0, 3.0))
FITTING = ObservationParameters(range_sigma=0.008, bearing_sigma=0.0025)


def squares_with(planned, prediction, worth: tuple[float, ...], start: tuple[float, float, float]) -> np.ndarray:
    """(K, 3, 3) errors when every detection is worth the same."""
    squares, parts = np.empty((len(planned.drive), 3, 3)), np.empty((len(planned.drive), 5, 3, 3))
    model, constants = planned.model(), planned.constants()
    noise = DetectionNoise(read_only(np.broadcast_to(np.array(worth), (1, 2, 6)).copy()), 0.2)
    propagate_errors(
        planned.drive.stamps_ns,
        planned.drive.poses,
        read_only(planned.visible.offsets),
        read_only(planned.visible.indices),
        planned.places,
        np.zeros((1, len(planned.places)), np.int64),
        planned.drive.scanners,
        prediction.prior_covariances,
        np.array(start),
        *constants,
        ErrorModel(
            *(model.odometry, model.observations, noise, model.gate_d2, model.inside_gate, model.free_per_m),
            np.array([(each.angle_min, each.angle_increment) for each in planned.scanners]),
            model.consider,
        ),
        squares,
        np.empty(len(squares)),
        parts,
    )
    np.testing.assert_allclose(parts.sum(axis=1), squares, rtol=1e-9, atol=1e-18)
    return squares


def test_error_is_what_the_filter_says_where_detections_are_as_its_parameters_say():
    project = open_field(
        LINE, parameters=Parameters(observation=FITTING, association=AssociationParameters(enabled=False))
    )
    planned = surely_detected(plan_route(project, "Line"))
    prediction = predict_route(planned)
    start = planned.options.start_sigmas
    squares = squares_with(planned, prediction, (1.0, 0.0, 0.008**2, 0.0025**2, 0.0, 0.0), start)
    np.testing.assert_allclose(squares, prediction.covariances, rtol=1e-6, atol=1e-12)


def test_a_start_that_is_better_than_the_filter_believes_shows_at_once_and_not_later():
    planned = plan_route(open_field(LINE, parameters=Parameters(observation=FITTING)), "Line")
    prediction = predict_route(planned)
    worth = (1.0, 0.0, 0.008**2, 0.0025**2, 0.0, 0.0)
    usual, better = (squares_with(planned, prediction, worth, s) for s in ((0.02, 0.02, 0.01), (0.0, 0.0, 0.0)))
    assert np.trace(better[0]) < 0.9 * np.trace(usual[0])
    np.testing.assert_allclose(better[-1], usual[-1], rtol=1e-3)


def test_a_range_that_is_always_too_long_does_not_average_out():
    planned = plan_route(open_field(LINE, parameters=Parameters(observation=FITTING)), "Line")
    prediction = predict_route(planned)
    without, with_bias = (
        squares_with(planned, prediction, (1.0, bias, 0.008**2, 0.0025**2, 0.0, 0.0), (0.02, 0.02, 0.01))
        for bias in (0.0, 0.005)
    )
    more = np.sqrt(np.diagonal(with_bias - without, axis1=1, axis2=2)[:, :2].sum(axis=1))
    assert 0.0005 < np.median(more) < 0.010
    # The bias alone turns no covariance: its second moment has the rank one.
    assert np.linalg.matrix_rank((with_bias - without)[-1], tol=1e-12) == 1


def test_errors_of_the_survey_stay_and_are_those_of_drives_among_displaced_reflectors():
    sigma, drives = 0.02, 48
    surveyed = ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y, sigma=sigma) for i, (x, y) in enumerate(LINE)))
    field = open_field(LINE, parameters=Parameters(observation=FITTING), uncertainty=EXACT)
    project = replace(field, reflectors=surveyed)
    start = start_of(project, "Line")
    planned = plan_route(project, "Line", PredictionOptions(start_sigmas=tuple(start.sigmas.tolist())))
    predicted = np.square(predict_errors(planned, predict_route(planned)).sigmas)
    squares = []
    for seed in range(drives):
        rng = np.random.default_rng((7, seed))
        moved = tuple(
            replace(r, x=r.x + sigma * rng.normal(), y=r.y + sigma * rng.normal()) for r in surveyed.reflectors
        )
        log = virtual_drive(replace(project, reflectors=ReflectorMap(moved)), "Line", seed, options=QUICK)
        run = whole_run.run(log, LocalizerSetup.of(project), Belief(0, start.pose, np.diag(start.sigmas**2)))
        truth = reference_at(run.stamps_ns, log.reference_stamps_ns, log.reference_poses)
        squares.append(pose_errors(run.means, truth)[100:450] ** 2)
    ratio = np.sqrt(predicted[100:450, :2].sum(axis=1) / np.mean(squares, axis=0)[:, :2].sum(axis=1))
    # An error that stays is one draw a drive: 48 drives of two axes know its RMS to 7 %.
    assert 0.8 < np.median(ratio) < 1.2
    # New in every scan, as the filter takes it, it would hardly show.
    certain = replace(project, reflectors=ReflectorMap(tuple(replace(r, sigma=0.0) for r in surveyed.reflectors)))
    planned = plan_route(certain, "Line")
    without = np.square(predict_errors(planned, predict_route(planned)).sigmas)
    assert np.median(predicted[100:450, :2].sum(axis=1)) > 4.0 * np.median(without[100:450, :2].sum(axis=1))


@pytest.mark.parametrize("gate", [0.7, 0.95, 0.999])
def test_a_gate_that_rejects_more_leaves_larger_errors(gate: float):
    def sigmas(probability: float) -> np.ndarray:
        association = AssociationParameters(gate_probability=probability)
        parameters = Parameters(observation=FITTING, association=association, odometry=PRECISE)
        planned = plan_route(open_field(LINE, parameters=parameters), "Line")
        return predict_errors(planned, predict_route(planned)).sigmas[50:].mean(axis=0)

    assert np.all(sigmas(gate) > 0.95 * sigmas(0.9999))
    assert np.all(sigmas(gate) < 2.0 * sigmas(0.9999))


def test_every_constant_has_its_own_part_of_the_error_and_none_that_is_exact():
    field = open_field(LINE, parameters=Parameters(observation=FITTING))
    alone = {
        "map": {"survey": 0.003},
        "mounting": {"mounting_position": 0.002, "mounting_heading": 0.001745},
        "range": {"range_bias": 0.005},
        "clock": {"clock": 0.005},
    }
    for name, known in alone.items():
        planned = plan_route(replace(field, uncertainty=replace(EXACT, **known)), "Line")
        errors = predict_errors(planned, predict_route(planned))
        share = np.abs(errors.parts[-1]).sum(axis=(1, 2))
        assert {CONTRIBUTIONS[i] for i in np.flatnonzero(share)} == {"noise", name}
        np.testing.assert_allclose(errors.parts.sum(axis=1), errors.squares, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("consider", [True, False], ids=["considered", "taken for noise"])
def test_predicted_error_is_that_of_drives_with_all_constants_drawn(consider: bool):
    drives, known = 40, Uncertainty()
    parameters = Parameters(observation=FITTING, odometry=PRECISE, filter=FilterParameters(consider=consider))
    project = open_field(LINE, parameters=parameters, disturbances=Disturbances(constants=constants_as_known(known)))
    start = start_of(project, "Line")
    planned = plan_route(project, "Line", PredictionOptions(start_sigmas=tuple(start.sigmas.tolist())))
    predicted = np.square(predict_errors(planned, predict_route(planned)).sigmas)
    squares = []
    for seed in range(drives):
        log = virtual_drive(project, "Line", seed, options=QUICK)
        run = whole_run.run(log, LocalizerSetup.of(project), Belief(0, start.pose, np.diag(start.sigmas**2)))
        truth = reference_at(run.stamps_ns, log.reference_stamps_ns, log.reference_poses)
        squares.append(pose_errors(run.means, truth)[100:450] ** 2)
    ratio = np.sqrt(predicted[100:450] / np.mean(squares, axis=0))
    # A drive is one draw of its constants: 40 of them know an RMS of one axis to 11 %.
    assert (np.abs(np.median(ratio, axis=0) - 1.0) < 0.25).all(), np.median(ratio, axis=0)


@pytest.mark.parametrize("rule", ["axes", "largest"])
def test_shares_are_those_along_the_direction_that_the_supervisor_looks_at(rule: str):
    # Noise of 2 mm along x, a map that is off by 6 mm along a diagonal: 4 + 18, 18 and 18 mm^2.
    parts = np.zeros((1, 5, 3, 3))
    parts[0, 0, 0, 0] = 4e-6
    parts[0, 1, :2, :2] = 18e-6
    parts[0, 4, 2, 2] = 9e-6
    errors = PredictedErrors(parts.sum(axis=1), np.ones(1), parts, SupervisorParameters(position_sigma=rule))
    # By hand: along x 22 mm^2, of which 4 are noise; in any direction 20 + sqrt(2^2 + 18^2).
    if rule == "axes":
        largest, noise = 22e-6, 4.0 / 22.0
    else:
        largest = (20.0 + np.sqrt(328.0)) * 1e-6
        angle = 0.5 * np.arctan2(36.0, 4.0)
        noise = 4e-6 * np.cos(angle) ** 2 / largest
    assert errors.position_two_sigma == pytest.approx([2.0 * np.sqrt(largest)], rel=1e-12)
    assert errors.position_shares[0] == pytest.approx([noise, 1.0 - noise, 0.0, 0.0, 0.0], rel=1e-9)
    assert errors.heading_shares[0].tolist() == [0.0, 0.0, 0.0, 0.0, 1.0]
    alone = {"axes": np.sqrt(18e-6), "largest": 6e-3}[rule]
    assert errors.part_two_sigma[0] == pytest.approx([4e-3, 2.0 * alone, 0.0, 0.0, 0.0])
