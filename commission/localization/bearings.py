"""Bearings alone as an observation kind: one row each, at the reflex's own time (Alenya et al. 2005, section II).

Residual, Jacobian and variance of a bearing, whose it is, and its correction, with mounting, clock and the places of
reflectors considered like those of a scan. Order of a cycle: `bearing_cycle`. The paper's own way without a filter is
`dynamic_triangulation`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.geometry.directions import direction_of
from commission.geometry.gaussian import chi_square_gate
from commission.localization.consider import PER_REFLECTOR, PER_SCANNER, ConsiderModel, scanner_jacobian
from commission.localization.lasting import LastingRule, lasting_rule
from commission.localization.observation import ObservationModel, expect, scanner_offset
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.pose_rows import PoseRows, correct_all_by_rows, nis_of_rows
from commission.site.parameters import Parameters
from commission.site.reflectors import Reflector
from commission.site.scanner import Scanner

NOT_NAMED, NOT_IN_MAP = -1, -2
"""Entries of bearings without the id of a reflector, and with one that the map lacks."""
FARTHEST_NIS = 100.0
"""NIS up to which a bearing that fits no reflector is held against the likeliest one: 10 sigma. Farther off it is
something else, whose NIS says nothing of the filter."""
CONSTANTS = PER_SCANNER + PER_REFLECTOR
MOUNT_HEADING = 2
"""Column of the mounting's heading among them."""


class BearingUse(IntEnum):
    """What became of a bearing."""

    NONE = 0
    """It was not looked at, or a turn met no reflector."""
    ACCEPTED = 1
    REJECTED = 2
    """It fits no reflector, or not the one that it is said to be of."""
    UNKNOWN = 3
    """More than one reflector fits, or the map lacks the one that it is said to be of."""


ACCEPTED, REJECTED, UNKNOWN = int(BearingUse.ACCEPTED), int(BearingUse.REJECTED), int(BearingUse.UNKNOWN)
USE, REFLECTOR, NIS, OFF, LASTING = range(5)
"""Columns of what is known of a bearing: a `BearingUse`, index in the reflector map or -1, NIS, measured less expected
[rad], and whether innovations of late do not average out (`lasting`), so that the supervisor stops the vehicle."""
COLUMNS = 5
TURNS = 2.5
"""Turns in which a reflector that is in sight is met: a goniometer misses one now and then."""


class BearingModel(NamedTuple):
    """Goniometer and gate, for kernels."""

    observation: ObservationModel
    """Mounting, and variance of a bearing."""
    gate: float
    """Largest NIS of an accepted bearing, of one degree of freedom."""
    nearest: float
    farthest: float
    """Distances at which it meets reflectors [m]."""
    turned: float
    """1, or -1 where it hangs upside down and reports bearings clockwise."""
    late: float
    """What its clock shows more than the vehicle's [s]."""
    first: int
    """First column of its constants in `cross`."""
    turns_s: float
    """Time in which a reflector that is in sight is met [s]."""
    lasting: LastingRule
    """When innovations that do not average out stop the vehicle."""


def bearing_model(
    scanners: Sequence[Scanner], observations: Sequence[ObservationModel], parameters: Parameters, reflectors: int
) -> BearingModel | None:
    """Return what kernels need; None where bearings are switched off or the vehicle has no goniometer.

    Parameters
    ----------
    scanners : of the vehicle.
    observations : of each.
    parameters : of every stage.
    reflectors : N of the map: its constants come first.
    """
    given = parameters.bearing
    for index, scanner in enumerate(scanners):
        if scanner.is_goniometer and given.enabled:
            return BearingModel(
                observation=observations[index],
                gate=chi_square_gate(given.gate_probability, 1),
                nearest=float(scanner.range[0]),
                farthest=float(min(scanner.range[1], scanner.reflector_range)),
                turned=-1.0 if scanner.upside_down else 1.0,
                late=float(scanner.clock_offset),
                first=PER_REFLECTOR * reflectors + PER_SCANNER * index,
                turns_s=TURNS / scanner.rate,
                lasting=lasting_rule(given, parameters.supervisor),
            )
    return None


def entries_named(names: Sequence[str], reflectors: Sequence[Reflector], places: FloatArray) -> IntArray:
    """(n,) row of `places` of the reflector that each bearing is said to be of, or NOT_NAMED, NOT_IN_MAP.

    Parameters
    ----------
    names : ids that bearings come with.
    reflectors : of the map.
    places : see `ReflectorIndex`.
    """
    rows = {int(index): row for row, index in enumerate(places[:, 3])}
    known = {each.id: rows[index] for index, each in enumerate(reflectors)} if any(names) else {}
    entries = [known.get(name, NOT_IN_MAP) if name else NOT_NAMED for name in names]
    return read_only(np.array(entries, dtype=np.int64))


@compiled
def bearing_rows(
    belief: PoseGaussian, bearing: float, place: FloatArray, model: BearingModel, twist: tuple[float, float, float]
) -> PoseRows:
    """Row of a bearing of one reflector, with the goniometer's and the reflector's constants beside it.

    Parameters
    ----------
    belief : before it.
    bearing : measured [rad], scanner frame, upright.
    place : (4,) of the reflector, see `ReflectorIndex`.
    model : mounting and noise.
    twist : velocity of base [m/s, m/s, rad/s], in base.

    Notes
    -----
    residual = bearing - (h - H xdot late), with h and H of Sobreira et al. 2016, equation 2, and what is known of a
    late clock. Of the constants: `scanner_jacobian`, -1 of the mounting's heading, 0 of the range bias, -H_xy of the
    reflector's place.
    """
    observation = model.observation
    offset_x, offset_y = scanner_offset(belief.theta, observation)
    e = expect(belief.x, belief.y, belief.theta, offset_x, offset_y, place[0], place[1], observation.mount_theta)
    j = scanner_jacobian(direction_of(belief.theta), e, twist[0], twist[1], twist[2])
    residuals, variances = np.empty(1), np.empty(1)
    H, J = np.empty((1, 3)), np.empty((1, CONSTANTS))
    residuals[0] = wrap_scalar(bearing - e.bearing - j.clock_b * model.late)
    variances[0] = observation.bearing_variance
    H[0, 0], H[0, 1], H[0, 2] = e.bearing_x, e.bearing_y, e.bearing_theta
    J[0, 0], J[0, 1], J[0, 2], J[0, 3], J[0, 4] = j.mount_xb, j.mount_yb, -1.0, 0.0, j.clock_b
    J[0, 5], J[0, 6] = -e.bearing_x, -e.bearing_y
    return PoseRows(residuals, H, variances, J)


@compiled_inline
def considered_by(place: FloatArray, variances: ConsiderModel) -> FloatArray:
    """(7,) variances of the constants of goniometer and reflector.

    Parameters
    ----------
    place : of the reflector.
    variances : of the constants of every scanner.

    Notes
    -----
    No formula: in the order of the columns of `bearing_rows`.
    """
    return np.array(
        (
            variances.mount_position,
            variances.mount_position,
            variances.mount_heading,
            variances.range_bias,
            variances.clock,
            place[2],
            place[2],
        )
    )


@compiled_inline
def lasting_part(
    belief: PoseGaussian,
    place: FloatArray,
    model: BearingModel,
    twist: tuple[float, float, float],
    variances: ConsiderModel,
) -> tuple[float, float]:
    """Variance that constants give a bearing of a reflector [rad^2], and how far the reflector is [m].

    Parameters
    ----------
    belief, place, model, twist : as in `bearing_rows`.
    variances : of the constants.

    Notes
    -----
    sum j^2 B with the columns of `bearing_rows` but the heading of the mounting, which turns all bearings alike: the
    variance of a sum of independent constants, by definition.
    """
    rows = bearing_rows(belief, 0.0, place, model, twist)
    known, constant = considered_by(place, variances), 0.0
    for i in range(CONSTANTS):
        constant += rows.constants[0, i] * rows.constants[0, i] * known[i] if i != MOUNT_HEADING else 0.0
    offset_x, offset_y = scanner_offset(belief.theta, model.observation)
    return constant, math.hypot(place[0] - belief.x - offset_x, place[1] - belief.y - offset_y)


@compiled_inline
def stands_apart(belief: PoseGaussian, entry: int, places: FloatArray, model: BearingModel, variance: float) -> bool:
    """Whether no other reflector could have the bearings of one: else those in between are left out, and the rest lean.

    Parameters
    ----------
    belief : before the bearing.
    entry : row of the reflector.
    places : the map, see `ReflectorIndex`.
    model : of the goniometer.
    variance : of the innovation [rad^2], taken for that of the others as well.

    Notes
    -----
    |b - b_other| >= 2 sqrt(gate S) for each other reflector within reach: their gates do not overlap, by definition.
    """
    offset_x, offset_y = scanner_offset(belief.theta, model.observation)
    x, y = belief.x + offset_x, belief.y + offset_y
    direction = math.atan2(places[entry, 1] - y, places[entry, 0] - x)
    apart = 2.0 * math.sqrt(model.gate * variance)
    for other in range(len(places)):
        dx, dy = places[other, 0] - x, places[other, 1] - y
        square = dx * dx + dy * dy
        if other == entry or square > model.farthest * model.farthest or square < model.nearest * model.nearest:
            continue
        if abs(wrap_scalar(math.atan2(dy, dx) - direction)) < apart:
            return False
    return True


@compiled_inline
def _columns(cross: FloatArray | None, entry: int, first: int) -> FloatArray:
    """(3, 7) covariance of the pose with the constants of goniometer and reflector; zeros where none is considered."""
    columns = np.zeros((3, CONSTANTS))
    if cross is not None:
        for row in range(3):
            for i in range(PER_SCANNER):
                columns[row, i] = cross[row, first + i]
            for i in range(PER_REFLECTOR):
                columns[row, PER_SCANNER + i] = cross[row, PER_REFLECTOR * entry + i]
    return columns


@compiled
def whose_bearing(  # noqa: PLR0917 - a bearing and the map
    belief: PoseGaussian,
    bearing: float,
    places: FloatArray,
    model: BearingModel,
    twist: tuple[float, float, float],
    variances: ConsiderModel,
    cross: FloatArray | None,
) -> tuple[int, int]:
    """Row of the likeliest reflector of a bearing without a name, or -1, and how many are inside the gate.

    Parameters
    ----------
    belief, bearing, model, twist : as in `bearing_rows`.
    places : the map, see `ReflectorIndex`.
    variances : of the constants.
    cross : covariance with the constants, or None.

    Notes
    -----
    No formula: the one of least NIS among those at a distance at which the goniometer meets reflectors, on the side
    where the laser points. A bearing does not tell near from far: of two inside the gate, neither is taken.
    """
    found, inside, least = -1, 0, math.inf
    offset_x, offset_y = scanner_offset(belief.theta, model.observation)
    for entry in range(len(places)):
        dx, dy = places[entry, 0] - belief.x - offset_x, places[entry, 1] - belief.y - offset_y
        square = dx * dx + dy * dy
        if square > model.farthest * model.farthest or square < model.nearest * model.nearest:
            continue
        rows = bearing_rows(belief, bearing, places[entry], model, twist)
        if abs(rows.residuals[0]) >= 0.5 * math.pi:
            continue
        nis = nis_of_rows(belief, _columns(cross, entry, model.first), considered_by(places[entry], variances), rows)
        inside += 1 if nis <= model.gate else 0
        if nis < least:
            found, least = entry, nis
    return found, inside


@compiled
def correct_by_bearing_alone(  # noqa: PLR0917 - the filter's state around one bearing
    belief: PoseGaussian,
    measured: float,
    entry: int,
    places: FloatArray,
    model: BearingModel,
    twist: tuple[float, float, float],
    variances: ConsiderModel,
    cross: FloatArray | None,
    busy: IntArray | None,
    figures: FloatArray,
    invariant: bool,
) -> PoseGaussian:
    """Correct a belief by a bearing, where it lies inside the gate.

    Parameters
    ----------
    belief : at the time of the reflex.
    measured : bearing as reported [rad], or NaN.
    entry : row of its reflector, or NOT_NAMED, NOT_IN_MAP.
    places : the map, see `ReflectorIndex`.
    model : of the goniometer.
    twist : velocity of base [m/s, m/s, rad/s], in base.
    variances : of the constants.
    cross : (3, M) covariance of the pose with the constants at `belief`, written in place, or None: the constants then
        count as noise, as they do for tags.
    busy : see `busy_chunks`.
    figures : (COLUMNS,) out: what became of it.
    invariant : whether the covariance is that of a right-invariant error.

    Notes
    -----
    K = (P h + C j) / S with S = h P h + 2 h C j + j B j + R: Bar-Shalom, Li, Kirubarajan 2001, equation 5.2.3-18, of
    one row, with constants considered as in `correct_all_by_rows`.
    """
    figures[USE], figures[REFLECTOR], figures[NIS], figures[OFF] = 0.0, -1.0, math.nan, math.nan
    if math.isnan(measured):
        return belief
    if entry == NOT_IN_MAP:
        figures[USE] = UNKNOWN
        return belief
    bearing, inside = model.turned * measured, 1
    named = entry != NOT_NAMED
    if not named:
        entry, inside = whose_bearing(belief, bearing, places, model, twist, variances, cross)
    if entry < 0:
        figures[USE] = REJECTED
        return belief
    rows = bearing_rows(belief, bearing, places[entry], model, twist)
    columns, considered = _columns(cross, entry, model.first), considered_by(places[entry], variances)
    nis = nis_of_rows(belief, columns, considered, rows)
    if inside > 1:
        figures[USE] = UNKNOWN
        return belief
    if named or nis <= FARTHEST_NIS:
        figures[REFLECTOR], figures[NIS], figures[OFF] = places[entry, 3], nis, rows.residuals[0]
    if not nis <= model.gate:
        figures[USE] = REJECTED
        return belief
    figures[USE] = ACCEPTED
    stretches = (model.first, PER_SCANNER), (PER_REFLECTOR * entry, PER_REFLECTOR)
    return correct_all_by_rows(belief, columns, considered, rows, stretches, cross, busy, invariant)
