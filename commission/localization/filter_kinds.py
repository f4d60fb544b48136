"""Kinds of filter: which of them corrects, by the number that stands for its name. Predicting is the same for all."""

from __future__ import annotations

from commission.compiled import compiled_inline
from commission.geometry.directions import UnitVector, turn_to
from commission.localization.consider import Considering, innovation_with, seen_with
from commission.localization.consider_correction import correct_aimed_with
from commission.localization.invariant import correct_invariant, landing_innovation
from commission.localization.kalman import Corrected, Innovation, correct_aimed, innovation
from commission.localization.observation import Expected, ObservationModel
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.sigma_points import UNSCENTED_CENTER, correct_by_points, fitted, fitted_innovation
from commission.site.parameters import FILTER_KINDS, FilterParameters

_, UKF, CKF, INVARIANT = range(len(FILTER_KINDS))


def filter_kind(parameters: FilterParameters) -> int | None:
    """Return the number of a kind, for kernels; None for `ekf`.

    None is a type of its own: kernels are compiled for it without the other kinds, which beside it cost a fifth of the
    time of a cycle.
    """
    return FILTER_KINDS.index(parameters.kind) or None


@compiled_inline
def is_invariant(kind: int | None) -> bool:
    """Whether a kind takes an error of the pose for a motion of the plane.

    Notes
    -----
    No formula: it compares.
    """
    return False if kind is None else kind == INVARIANT


@compiled_inline
def center_of(kind: int) -> float:
    """Weight of the mean among sigma points.

    Notes
    -----
    weight = beta of the unscented filter, 0 of the cubature one, by definition.
    """
    return UNSCENTED_CENTER if kind == UKF else 0.0


@compiled_inline
def innovation_by(  # noqa: PLR0917 - a measurement and a reflector, number by number
    kind: int | None,
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    ray: UnitVector,
    aim: UnitVector,
    expected: Expected,
    x: float,
    y: float,
    surveyed_variance: float,
    offset_x: float,
    offset_y: float,
    model: ObservationModel,
    given: Considering | None,
    at: int,
) -> Innovation:
    """Innovation of a detection against one reflector, as the filter of a kind has it.

    Parameters
    ----------
    kind : of the filter; None: `ekf`.
    belief, facing : before the correction, and the direction of its heading.
    measured_range : range bias already taken off [m].
    ray, aim : the bearing as a direction, of the map and of base.
    expected : from the mean of `belief`; its bearing is not read.
    x, y, surveyed_variance : the reflector's center [m], map frame, and variance of its place, each axis [m^2].
    offset_x, offset_y : see `scanner_offset` [m].
    model : of the observation.
    given, at : as in `seen_with`, or None.

    Notes
    -----
    No formula: that of the kind.
    """
    if kind is None:
        turn = turn_to(-expected.range_x, -expected.range_y, ray)
        if given is None:
            return innovation(belief, expected, measured_range, turn, surveyed_variance, model)
        seen = seen_with(facing, expected, surveyed_variance, given, at)
        return innovation_with(belief, expected, measured_range, turn, model, seen)
    if kind == INVARIANT:
        return landing_innovation(
            belief, facing, offset_x, offset_y, measured_range, ray, x, y, surveyed_variance, model, given, at
        )
    line = fitted(belief, facing, measured_range, aim, x, y, model, center_of(kind))
    return fitted_innovation(belief, facing, measured_range, line, surveyed_variance, model, given, at)


@compiled_inline
def correct_by(  # noqa: PLR0917 - a measurement and a reflector, number by number
    kind: int | None,
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    aim: UnitVector,
    x: float,
    y: float,
    surveyed_variance: float,
    model: ObservationModel,
    given: Considering | None,
    width: int,
    at: int,
) -> Corrected:
    """Correct a belief by one detection of one reflector, as the filter of a kind does.

    Parameters
    ----------
    kind : of the filter; None: `ekf`.
    belief, facing : before the correction, and the direction of its heading.
    measured_range : range bias already taken off [m].
    aim : measured bearing as a direction, in base.
    x, y, surveyed_variance : the reflector's center [m], map frame, and variance of its place, each axis [m^2].
    model : of the observation.
    given, width, at : as in `correct_aimed_with`, or None.

    Notes
    -----
    No formula: that of the kind.
    """
    if kind is None:
        if given is None:
            return correct_aimed(belief, facing, measured_range, aim, x, y, surveyed_variance, model)
        return correct_aimed_with(belief, facing, measured_range, aim, x, y, surveyed_variance, model, given, width, at)
    if kind == INVARIANT:
        return correct_invariant(belief, facing, measured_range, aim, x, y, surveyed_variance, model, given, width, at)
    return correct_by_points(
        belief,
        facing,
        measured_range,
        aim,
        x,
        y,
        surveyed_variance,
        model,
        given,
        width,
        at,
        center_of(kind),
    )
