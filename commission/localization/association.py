"""Associate: which reflector a detection belongs to, and the association filter (Sobreira et al. 2016, Algorithm 3).

The likelihood of line 4 lacks the power -1/2 on det(2 pi S): as printed it would favor uncertain reflectors. The
search looks only at reflectors near the detection and yet returns what a search over all of them would.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.gaussian import chi_square_gate
from commission.localization.consider import BLOCKS, Considering, innovation_with, seen_with
from commission.localization.consider_columns import take_out
from commission.localization.estimate import Status
from commission.localization.kalman import innovation, squared_distance
from commission.localization.observation import (
    SMALLEST_RANGE,
    ObservationModel,
    UnitVector,
    composed,
    direction_of,
    expect,
    expect_at,
    scanner_offset,
    turn_to,
)
from commission.localization.pose_gaussian import PoseGaussian, larger_eigenvalue
from commission.localization.reflector_index import Cells, cell_range
from commission.site.parameters import AssociationParameters

INLIER = int(Status.INLIER)
OUTLIER_ASSOCIATION = int(Status.OUTLIER_ASSOCIATION)
NOBODY = -1
USUAL_RADIUS = 0.25
"""A search around a detection that is mostly wide enough [m]."""


class Gate(NamedTuple):
    """Association filter, for kernels."""

    enabled: bool
    d2: float
    """Largest squared Mahalanobis distance of an inlier."""


class Viewpoint(NamedTuple):
    """What is common to all detections of a scan: scanner's place and bounds of its uncertainty."""

    offset_x: float
    offset_y: float
    position_sigma: float
    """Largest 1-sigma of the scanner's position in any direction [m]."""
    heading_sigma: float


def gate_of(parameters: AssociationParameters) -> Gate:
    """Return the gate for two degrees of freedom, range and bearing."""
    return Gate(bool(parameters.enabled), chi_square_gate(parameters.gate_probability, 2))


@compiled_inline
def viewpoint(belief: PoseGaussian, model: ObservationModel) -> Viewpoint:
    """Scanner's place, and the largest 1-sigma of its position and heading.

    Notes
    -----
    sigma^2 = `larger_eigenvalue` of J P J^T, J = [[1, 0, -oy], [0, 1, ox]]: derived from the lever (ox, oy) of the
    scanner.
    """
    offset_x, offset_y = scanner_offset(belief.theta, model)
    # The scanner moves by (-offset_y, offset_x) per radian of heading.
    xx = belief.xx - 2.0 * offset_y * belief.xt + offset_y * offset_y * belief.tt
    xy = belief.xy + offset_x * belief.xt - offset_y * belief.yt - offset_x * offset_y * belief.tt
    yy = belief.yy + 2.0 * offset_x * belief.yt + offset_x * offset_x * belief.tt
    largest = larger_eigenvalue(xx, xy, yy)
    return Viewpoint(offset_x, offset_y, math.sqrt(max(largest, 0.0)), math.sqrt(max(belief.tt, 0.0)))


@compiled_inline
def widened(view: Viewpoint, largest_variance: float, given: Considering) -> Viewpoint:
    """Bounds that hold the constants, too, whatever their covariance with the pose is.

    Parameters
    ----------
    view : of the belief alone.
    largest_variance : of all surveyed places, each axis [m^2].
    given : of the scan.

    Notes
    -----
    sigma(a + b) <= sigma(a) + sigma(b), whatever their covariance is; the constants are independent of each other.
    Derived.
    """
    p = given.variances
    # The scanner is as fast as base, and faster by what it turns about base.
    speed2 = given.speed_x * given.speed_x + given.speed_y * given.speed_y
    lever2 = view.offset_x * view.offset_x + view.offset_y * view.offset_y
    speed = math.sqrt(speed2) + abs(given.turn_rate) * math.sqrt(lever2)
    position2 = largest_variance + p.mount_position + p.range_bias + p.clock * speed * speed
    heading2 = p.mount_heading + p.clock * given.turn_rate * given.turn_rate
    return Viewpoint(
        view.offset_x,
        view.offset_y,
        view.position_sigma + math.sqrt(position2),
        view.heading_sigma + math.sqrt(heading2),
    )


@compiled_inline
def search_radius(
    d2: float, measured_range: float, view: Viewpoint, model: ObservationModel, largest_variance: float
) -> float:
    """Distance on the floor, from a detection, within which every reflector of Mahalanobis distance <= d2 lies [m].

    Parameters
    ----------
    d2 : largest squared Mahalanobis distance.
    measured_range : of the detection [m].
    view : scanner's place and the bounds of its uncertainty.
    model : of the observation.
    largest_variance : of all surveyed places, each axis [m^2].

    Notes
    -----
    sqrt(u^2 + r (r + u) c^2), u = sqrt(d2 var_r), c the chord of a turn by sqrt(d2 var_b). Derived: each innovation is
    at most sqrt(d2) of its own sigma. The sigma of the range is bounded by that of the scanner's position; the sigma of
    the bearing too, seen from the nearest range that the first bound leaves.
    """
    range_variance = view.position_sigma * view.position_sigma + model.range_variance + largest_variance
    depth = math.sqrt(d2 * range_variance)
    nearest = measured_range - depth
    chord2 = 4.0
    if nearest > SMALLEST_RANGE:
        bearing_sigma = view.position_sigma / nearest + view.heading_sigma
        bearing_variance = bearing_sigma * bearing_sigma + model.bearing_variance
        bearing_variance += largest_variance / (nearest * nearest)
        # (2 sin(b / 2))^2 <= b^2, and <= 4 for any turn.
        chord2 = min(4.0, d2 * bearing_variance)
    distance = abs(measured_range)
    # The margin covers the rounding of everything above.
    return math.sqrt(depth * depth + distance * (distance + depth) * chord2) * (1.0 + 1e-9) + 1e-9


@compiled_inline
def score(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    measured_range: float,
    measured_bearing: float,
    x: float,
    y: float,
    surveyed_variance: float,
    view: Viewpoint,
    model: ObservationModel,
    given: Considering | None,
    work: FloatArray | None,
    aim: UnitVector | None,
) -> tuple[float, float]:
    """Squared Mahalanobis distance to one reflector, and -2 ln(likelihood) up to a constant.

    Parameters
    ----------
    belief : the detection is judged at it.
    measured_range, measured_bearing : range bias already taken off [m], [rad].
    x, y : the reflector's center [m], map frame.
    surveyed_variance : of the reflector's place, each axis [m^2].
    view, model : scanner's place, and model of the observation.
    given, work : of the scan, where constants are considered, else None; the reflector's columns are the first free.
    aim : the bearing as a direction of the map, where constants are considered, else None.

    Notes
    -----
    d2 = v^T S^-1 v, and d2 + ln(det S / det R): Sobreira et al. 2016, Algorithm 3, line 4, with the power -1/2 that its
    likelihood lacks.
    """
    if given is None or work is None or aim is None:
        e = expect(belief.x, belief.y, belief.theta, view.offset_x, view.offset_y, x, y, model.mount_theta)
        v = innovation(belief, e, measured_range, measured_bearing, surveyed_variance, model)
    else:
        dx, dy = x - (belief.x + view.offset_x), y - (belief.y + view.offset_y)
        e = expect_at(dx, dy, math.nan, view.offset_x, view.offset_y)
        seen = seen_with(given.facing, e, surveyed_variance, given, work, BLOCKS)
        v = innovation_with(belief, e, measured_range, turn_to(-e.range_x, -e.range_y, aim), model, seen)
    d2 = squared_distance(v)
    return d2, d2 + math.log(v.s_rr * v.schur / (model.range_variance * model.bearing_variance))


@compiled_inline
def aimed_at(belief: PoseGaussian, bearing: float, model: ObservationModel, aim: UnitVector | None) -> UnitVector:
    """UnitVector of a detection on the map.

    Parameters
    ----------
    belief : pose of base.
    bearing : measured [rad].
    model : mounting of the scanner.
    aim : the direction, where it is known already, else None.

    Notes
    -----
    angle = theta + mount + bearing, by definition.
    """
    if aim is None:
        return direction_of(belief.theta + model.mount_theta + bearing)
    return aim


@compiled_inline
def likeliest(  # noqa: PLR0917 - a measurement, number by number, and the map
    belief: PoseGaussian,
    measured_range: float,
    measured_bearing: float,
    view: Viewpoint,
    reach: Viewpoint,
    model: ObservationModel,
    gate: Gate,
    cells: Cells,
    places: FloatArray,
    cell_offsets: IntArray,
    cross: FloatArray | None,
    given: Considering | None,
    work: FloatArray | None,
    aim: UnitVector | None,
) -> tuple[int, float]:
    """Most likely reflector of the whole map, found near the detection: its row in `places`, and d2.

    First those that may be inside the gate. A reflector outside the gate may still be more likely than one inside,
    when its det S is smaller; since S >= R, it must then lie within d2 <= cost of the best so far: if that reaches
    farther than the first search, search again. Equal to a search over all reflectors whenever the result is inside
    the gate, or the filter is disabled; of equals it is the first in the map. Otherwise the detection is an outlier,
    and the result is the most likely of those near it, for the engineer to see, or NOBODY and NaN.

    Parameters
    ----------
    belief : the detection is judged at it.
    measured_range, measured_bearing : range bias already taken off [m], [rad].
    view, reach, model : scanner's place, bounds of the search (`reach_of`), and model of the observation.
    gate : of the association filter.
    cells, places, cell_offsets : the map, see `ReflectorIndex`.
    cross, given, work : of the scan, where constants are considered, else None.
    aim : direction of the detection, where it is known already, else None.

    Notes
    -----
    argmin over reflectors of d2 + ln(det S), see `score`: Sobreira et al. 2016, Algorithm 3, line 4.
    """
    direction = aimed_at(belief, measured_bearing, model, aim)
    px = belief.x + view.offset_x + measured_range * direction.cos - cells.origin_x
    py = belief.y + view.offset_y + measured_range * direction.sin - cells.origin_y
    best, best_d2, best_cost = NOBODY, math.nan, math.inf
    bound, spread = gate.d2, cells.largest_variance if given is None else 0.0
    while True:
        radius = search_radius(bound, measured_range, reach, model, spread)
        # Nearly always the usual cells hold it: they are known before the radius is.
        first_row, last_row = cell_range(py - USUAL_RADIUS, py + USUAL_RADIUS, cells.per_metre, cells.rows)
        first_column, last_column = cell_range(px - USUAL_RADIUS, px + USUAL_RADIUS, cells.per_metre, cells.columns)
        if radius > USUAL_RADIUS:
            first_row, last_row = cell_range(py - radius, py + radius, cells.per_metre, cells.rows)
            first_column, last_column = cell_range(px - radius, px + radius, cells.per_metre, cells.columns)
        for row in range(first_row, last_row + 1 if last_column >= first_column else first_row):
            start = cell_offsets[row * cells.columns + first_column]
            for entry in range(start, cell_offsets[row * cells.columns + last_column + 1]):
                x, y = places[entry, 0], places[entry, 1]
                dx, dy = x - cells.origin_x - px, y - cells.origin_y - py
                if dx * dx + dy * dy > radius * radius:
                    continue
                if cross is not None and given is not None and work is not None:
                    take_out(work, BLOCKS, cross, entry, given)
                variance = places[entry, 2]
                d2, cost = score(
                    belief, measured_range, measured_bearing, x, y, variance, view, model, given, work, aim
                )
                if cost < best_cost or (cost == best_cost and places[entry, 3] < places[best, 3]):
                    best, best_d2, best_cost = entry, d2, cost
        if best != NOBODY:
            if best_cost <= bound or (gate.enabled and not best_d2 <= gate.d2):
                return best, best_d2
            bound = best_cost
        elif gate.enabled or len(places) == 0 or not bound < math.inf:
            return best, best_d2
        else:
            bound *= 16.0


@compiled_inline
def reach_of(view: Viewpoint, largest_variance: float, given: Considering | None) -> Viewpoint:
    """Bounds by which reflectors are searched.

    Parameters
    ----------
    view, largest_variance, given : as in `widened`; None: no constants are considered.

    Notes
    -----
    No formula: `widened`, where constants are considered.
    """
    if given is None:
        return view
    return widened(view, largest_variance, given)


@compiled_inline
def aim_of(given: Considering | None, aims: FloatArray | None, detection: int) -> UnitVector | None:
    """UnitVector of a detection of the scan on the map; None where no constants are considered.

    Parameters
    ----------
    given, aims : of the scan, or None.
    detection : number of it in the scan.

    Notes
    -----
    angle = theta + (mount + bearing), by definition.
    """
    if given is None:
        return None
    if aims is None:
        return None
    return composed(given.facing, UnitVector(aims[detection, 0], aims[detection, 1]))


@compiled_inline
def associate(  # noqa: PLR0917 - outputs are written into the arrays of the whole run
    belief: PoseGaussian,
    first: int,
    last: int,
    detections: FloatArray,
    model: ObservationModel,
    gate: Gate,
    cells: Cells,
    places: FloatArray,
    cell_offsets: IntArray,
    cross: FloatArray | None,
    given: Considering | None,
    work: FloatArray | None,
    aims: FloatArray | None,
    status: NDArray[np.int8],
    entries: IntArray,
    d2: FloatArray,
) -> None:
    """Associate the detections of one scan, all at the predicted belief.

    Parameters
    ----------
    belief : after *predict*.
    first, last : rows of the scan's detections, the last one excluded.
    detections : (n, 2) measured range and bearing.
    model : of the observation.
    gate : of the association filter.
    cells, places, cell_offsets : the map, see `ReflectorIndex`.
    cross, given, work, aims : of the scan, where constants are considered, else None.
    status : (n,) in: INLIER or OUTLIER_DETECTOR, the latter is left alone; out: a `Status`.
    entries : (n,) out: row of `places`, or NOBODY.
    d2 : (n,) out: squared Mahalanobis distance, NaN for nobody.

    Notes
    -----
    Inlier if d2 <= gate of the most likely reflector: Sobreira et al. 2016, Algorithm 3, line 6.

    A reflector is one cluster in a scan. Where two inliers claim the same one, the paper uses both; here the nearer
    one in the Mahalanobis sense stays and the other becomes an outlier of the association filter, because one of them
    is a false reflector beside the true one. With the filter disabled both stay, as in the paper.
    """
    view = viewpoint(belief, model)
    reach = reach_of(view, cells.largest_variance, given)
    for i in range(first, last):
        entries[i] = NOBODY
        d2[i] = math.nan
        if status[i] != INLIER:
            continue
        measured = detections[i, 0] - model.range_bias
        best, best_d2 = likeliest(
            belief,
            measured,
            detections[i, 1],
            view,
            reach,
            model,
            gate,
            cells,
            places,
            cell_offsets,
            cross,
            given,
            work,
            aim_of(given, aims, i - first),
        )
        entries[i] = best
        d2[i] = best_d2
        if best == NOBODY or (gate.enabled and not best_d2 <= gate.d2):
            status[i] = OUTLIER_ASSOCIATION
            continue
        if not gate.enabled:
            continue
        for other in range(first, i):
            if status[other] == INLIER and entries[other] == best:
                status[i if d2[other] <= best_d2 else other] = OUTLIER_ASSOCIATION
                break
