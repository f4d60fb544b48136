"""Prediction of the error along a route, and what each source contributes: noise, map, mounting, range, clock.

`route_prediction` tells what the filter will say of itself; this tells how far off it will be, as far as noise and
`uncertainty` say. The two agree where the filter's parameters fit the scanner and nothing repeats from scan to scan.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from commission.geometry.arrays import FloatArray, read_only
from commission.localization.supervisor import position_directions, position_two_sigma, position_variances
from commission.planning.error_kernels import ErrorModel, propagate_errors
from commission.planning.route_prediction import PerMetre, PlannedRoute, RoutePrediction, predict_route, smallest_route
from commission.site.parameters import SupervisorParameters

CONTRIBUTIONS = ("noise", "map", "mounting", "range", "clock")
"""What an error comes from: noise of odometry and beams; survey; mounting; range bias and clock of the scanners."""


@dataclass(frozen=True, slots=True, eq=False)
class PredictedErrors:
    """Expected error of the filter's poses after each of K scans. Read-only."""

    squares: FloatArray
    """(K, 3, 3) second moments of the error of x [m], y [m] and heading [rad]: over many drives, biases included."""
    inliers: FloatArray
    """(K,) expected number of inliers: of the visible reflectors, those that pass the detector filter and the gate."""
    parts: FloatArray
    """(K, 5, 3, 3) what each of `CONTRIBUTIONS` has in `squares`; together they are all of it."""
    supervisor: SupervisorParameters = field(default_factory=SupervisorParameters)
    """Says which 2-sigma of the position counts: the largest in any direction, or of x and y."""

    @property
    def sigmas(self) -> FloatArray:
        """(K, 3) expected RMS error of x [m], y [m] and heading [rad]."""
        return np.sqrt(np.diagonal(self.squares, axis1=1, axis2=2))

    @property
    def two_sigma(self) -> FloatArray:
        """(K, 3) twice the expected RMS error of x [m], y [m] and heading [rad]: as the filter's own is told."""
        return 2.0 * self.sigmas

    @property
    def position_two_sigma(self) -> FloatArray:
        """(K,) twice the expected RMS error of the position, of the direction that the supervisor looks at [m]."""
        return position_two_sigma(self.squares, self.supervisor)

    @property
    def part_two_sigma(self) -> FloatArray:
        """(K, 5) 2-sigma of the position that each of `CONTRIBUTIONS` alone has, of its own worst direction [m]."""
        alone = self.parts.reshape(-1, 3, 3)
        return position_two_sigma(alone, self.supervisor).reshape(-1, len(CONTRIBUTIONS))

    @property
    def position_shares(self) -> FloatArray:
        """(K, 5) share of each of `CONTRIBUTIONS` in the square of `position_two_sigma` [0..1]; they add up to 1."""
        directions = position_directions(self.squares, self.supervisor)
        parts = position_variances(self.parts, directions)
        return parts / np.maximum(parts.sum(axis=1, keepdims=True), 1e-300)

    @property
    def heading_shares(self) -> FloatArray:
        """(K, 5) share of each of `CONTRIBUTIONS` in the square of the heading's error [0..1]; they add up to 1."""
        parts = self.parts[:, :, 2, 2]
        return parts / np.maximum(parts.sum(axis=1, keepdims=True), 1e-300)

    def parts_per_metre(self, metres: PerMetre) -> FloatArray:
        """(B, 5) the largest `part_two_sigma` of each metre of the prediction [m]."""
        return np.maximum.reduceat(self.part_two_sigma, metres.first, axis=0)

    def position_per_metre(self, metres: PerMetre) -> tuple[FloatArray, FloatArray]:
        """(B,) the largest `position_two_sigma` of each metre [m], and (B, 5) `position_shares` where it is that."""
        return self._worst_per_metre(metres, self.position_two_sigma, self.position_shares)

    def heading_per_metre(self, metres: PerMetre) -> tuple[FloatArray, FloatArray]:
        """(B,) the largest 2-sigma of the heading in each metre [rad], and (B, 5) `heading_shares` where it is that."""
        return self._worst_per_metre(metres, self.two_sigma[:, 2], self.heading_shares)

    @staticmethod
    def _worst_per_metre(metres: PerMetre, total: FloatArray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The largest of each metre, and the shares at that scan."""
        ends = (*metres.first[1:].tolist(), len(total))
        worst = [first + int(total[first:end].argmax()) for first, end in zip(metres.first.tolist(), ends, strict=True)]
        return total[worst], shares[worst]

    def per_metre(self, metres: PerMetre) -> FloatArray:
        """(B, 3) the largest `two_sigma` of each metre of the prediction."""
        return np.maximum.reduceat(self.two_sigma, metres.first, axis=0)


def predict_errors(planned: PlannedRoute, prediction: RoutePrediction) -> PredictedErrors:
    """Predict the error along a planned drive on which all reflectors are as in the map but for their survey.

    Parameters
    ----------
    planned : drive and visible reflectors.
    prediction : of that drive, without damage.

    Returns
    -------
    errors : one row per scan.

    Notes
    -----
    Four kinds of error, with a law of their own each. What is new in every scan (odometry, noise of the beams) adds to
    a covariance. A detection's mean error adds to a mean. What repeats where a reflector stands alike between two beams
    comes and goes with the bearing: a wave whose relative phase along the drive is known and whose absolute phase, a
    tenth of a degree of heading, is not. An error of the survey stays. The last two are carried as the response of the
    pose to each reflector; taken as new in every scan, as the filter takes them, they would average out.
    """
    quality, count = planned.quality, len(planned.drive)
    squares, inliers, parts = np.empty((count, 3, 3)), np.empty(count), np.empty((count, len(CONTRIBUTIONS), 3, 3))
    cross, blocks = planned.constants()
    model = planned.model()
    propagate_errors(
        planned.drive.stamps_ns,
        planned.drive.poses,
        read_only(planned.visible.offsets),
        read_only(planned.visible.indices),
        planned.places,
        quality.classes,
        planned.drive.scanners,
        prediction.prior_covariances,
        np.array(planned.options.start_sigmas),
        cross,
        blocks,
        ErrorModel(
            model.odometry,
            model.observations,
            quality.noise,
            model.gate_d2,
            model.inside_gate,
            model.free_per_m,
            np.array([(scanner.angle_min, scanner.angle_increment) for scanner in planned.scanners]),
            model.consider,
        ),
        squares,
        inliers,
        parts,
    )
    supervisor = planned.parameters.supervisor
    return PredictedErrors(read_only(squares), read_only(inliers), read_only(parts), supervisor)


def larger_variances(prediction: RoutePrediction, errors: PredictedErrors) -> FloatArray:
    """(K, 3) variances of x [m^2], y [m^2] and heading [rad^2]: the larger of the filter's own and of its error."""
    return np.maximum(*(np.diagonal(each, axis1=1, axis2=2) for each in (prediction.covariances, errors.squares)))


def two_sigma_of(planned: PlannedRoute) -> FloatArray:
    """(K, 3) 2-sigma of x [m], y [m] and heading [rad]: the larger of the filter's own and of its error."""
    prediction = predict_route(planned)
    return 2.0 * np.sqrt(larger_variances(prediction, predict_errors(planned, prediction)))


def warm_up() -> None:
    """Compile the propagation of errors, and what finds out how good detections are."""
    two_sigma_of(smallest_route())
