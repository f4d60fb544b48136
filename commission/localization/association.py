"""Associate: which reflector a detection belongs to, and the association filter (Sobreira et al. 2016, Algorithm 3).

The likelihood of line 4 lacks the power -1/2 on det(2 pi S): as printed it would favor uncertain reflectors. The
search looks only at reflectors near the detection and yet returns what a search over all of them would.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.geometry.directions import UnitVector, composed
from commission.geometry.gaussian import chi_square_gate
from commission.localization.consider import BLOCKS, Considering
from commission.localization.consider_columns import take_out
from commission.localization.estimate import Status
from commission.localization.filter_kinds import innovation_by
from commission.localization.joint import CAREFUL, EXCLUSIVE, JOINT, MOST_JOINTLY, decide_together
from commission.localization.kalman import squared_distance
from commission.localization.observation import ObservationModel, expect_at
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reflector_index import ReflectorIndex, cell_range
from commission.localization.scan_rows import ScanRows
from commission.localization.search import Viewpoint, radius2_by, reach_of, viewpoint
from commission.site.parameters import ASSOCIATION_METHODS, AssociationParameters

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
    kind: int | None = None
    """Of the filter, None for `ekf`, whose innovations are judged: see `filter_kinds`."""
    method: int = EXCLUSIVE
    """How detections that have to do with each other are decided on: see `methods`."""
    joint: tuple[float, ...] | None = None
    """Largest joint squared Mahalanobis distance of one detection, of two, and so on. None, which is a type of its own,
    where each is decided on alone: kernels are compiled for it without the rest, which beside it costs a seventh of the
    time of a cycle, and as much to compile as all else. Never None beside a kind: so kernels are of three sorts."""


def gate_of(parameters: AssociationParameters, kind: int | None = None) -> Gate:
    """Return the gate for two degrees of freedom, range and bearing, of the innovations of a kind of filter."""
    probability = parameters.gate_probability
    method, joint = ASSOCIATION_METHODS.index(parameters.method), None
    if method >= CAREFUL or kind is not None:
        joint = tuple(chi_square_gate(probability, 2 * (count + 1)) for count in range(MOST_JOINTLY))
    return Gate(bool(parameters.enabled), chi_square_gate(probability, 2), kind, method, joint)


@compiled_inline
def score(  # noqa: PLR0917 - a measurement and a reflector, number by number
    kind: int | None,
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    ray: UnitVector,
    aim: UnitVector,
    x: float,
    y: float,
    surveyed_variance: float,
    view: Viewpoint,
    model: ObservationModel,
    given: Considering | None,
) -> tuple[float, float]:
    """Squared Mahalanobis distance to one reflector, and how much wider than the noise the innovation spreads.

    Parameters
    ----------
    kind : of the filter.
    belief, facing : the detection is judged at it; the direction of its heading.
    measured_range : range bias already taken off [m].
    ray, aim : the bearing as a direction, of the map and of base.
    x, y : the reflector's center [m], map frame.
    surveyed_variance : of the reflector's place, each axis [m^2].
    view, model : scanner's place, and model of the observation.
    given : of the scan, where constants are considered, else None; the reflector's columns are the first free.

    Notes
    -----
    d2 = v^T S^-1 v, and det S / det R: the parts of the likelihood in Sobreira et al. 2016, Algorithm 3, line 4.
    """
    dx, dy = x - (belief.x + view.offset_x), y - (belief.y + view.offset_y)
    e = expect_at(dx, dy, math.nan, view.offset_x, view.offset_y)
    v = innovation_by(
        kind,
        belief,
        facing,
        measured_range,
        ray,
        aim,
        e,
        x,
        y,
        surveyed_variance,
        view.offset_x,
        view.offset_y,
        model,
        given,
        BLOCKS,
    )
    return squared_distance(v), v.s_rr * v.schur * (1.0 / (model.range_variance * model.bearing_variance))


@compiled_inline
def cost(d2: float, spread: float) -> float:
    """-2 ln(likelihood) of a detection of one reflector, up to a constant.

    Parameters
    ----------
    d2, spread : see `score`.

    Notes
    -----
    d2 + ln(det S / det R): Sobreira et al. 2016, Algorithm 3, line 4, with the power -1/2 that its likelihood lacks.
    """
    return d2 + math.log(spread)


@compiled_inline
def is_likelier(d2: float, spread: float, other_d2: float, other_spread: float, is_earlier: bool) -> bool:
    """Whether a reflector is likelier than another one.

    Parameters
    ----------
    d2, spread, other_d2, other_spread : of both, see `score`.
    is_earlier : whether it comes before the other in the map: then it also wins a tie.

    Notes
    -----
    No formula: the smaller `cost`.
    """
    own, others = cost(d2, spread), cost(other_d2, other_spread)
    return own < others or (own == others and is_earlier)


@compiled_inline
def likeliest(  # noqa: PLR0917 - a measurement, number by number, and the map
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    ray: UnitVector,
    aim: UnitVector,
    view: Viewpoint,
    reach: Viewpoint,
    model: ObservationModel,
    gate: Gate,
    index: ReflectorIndex,
    given: Considering | None,
) -> tuple[int, float]:
    """Most likely reflector of the whole map, found near the detection: its row in `places`, and d2.

    First those that may be inside the gate. A reflector outside the gate may still be more likely than one inside,
    when its det S is smaller; since S >= R, it must then lie within d2 <= cost of the best so far: if that reaches
    farther than the first search, search again. Equal to a search over all reflectors whenever the result is inside
    the gate, or the filter is disabled; of equals it is the first in the map. Otherwise the detection is an outlier,
    and the result is the most likely of those near it, for the engineer to see, or NOBODY and NaN.

    Parameters
    ----------
    belief, facing : the detection is judged at it; the direction of its heading.
    measured_range : range bias already taken off [m].
    ray, aim : the bearing as a direction, of the map and of base.
    view, reach, model : scanner's place, bounds of the search (`reach_of`), and model of the observation.
    gate : of the association filter.
    index : the map.
    given : of the scan, where constants are considered, else None.

    Notes
    -----
    argmin over reflectors of d2 + ln(det S), see `cost`: Sobreira et al. 2016, Algorithm 3, line 4.
    """
    cells, places, cell_offsets = index
    px = belief.x + view.offset_x + measured_range * ray.cos - cells.origin_x
    py = belief.y + view.offset_y + measured_range * ray.sin - cells.origin_y
    best, best_d2, best_spread = NOBODY, math.nan, math.nan
    bound, root, surveyed = gate.d2, math.sqrt(gate.d2), cells.largest_variance if given is None else 0.0
    # Without a way out of the middle of the loop: that would cost two atomic operations for each array.
    searching = True
    while searching:
        radius2 = radius2_by(gate.kind, root, measured_range, reach, model, surveyed)
        # Nearly always the usual cells hold it: they are known before the radius is.
        first_row, last_row = cell_range(py - USUAL_RADIUS, py + USUAL_RADIUS, cells.per_metre, cells.rows)
        first_column, last_column = cell_range(px - USUAL_RADIUS, px + USUAL_RADIUS, cells.per_metre, cells.columns)
        if radius2 > USUAL_RADIUS * USUAL_RADIUS:
            radius = math.sqrt(radius2)
            first_row, last_row = cell_range(py - radius, py + radius, cells.per_metre, cells.rows)
            first_column, last_column = cell_range(px - radius, px + radius, cells.per_metre, cells.columns)
        for row in range(first_row, last_row + 1 if last_column >= first_column else first_row):
            start = cell_offsets[row * cells.columns + first_column]
            for entry in range(start, cell_offsets[row * cells.columns + last_column + 1]):
                x, y = places[entry, 0], places[entry, 1]
                dx, dy = x - cells.origin_x - px, y - cells.origin_y - py
                if dx * dx + dy * dy > radius2:
                    continue
                take_out(given, BLOCKS, entry)
                variance = places[entry, 2]
                d2, spread = score(
                    gate.kind, belief, facing, measured_range, ray, aim, x, y, variance, view, model, given
                )
                # Mostly there is no other one to compare with, and no logarithm to take.
                if d2 + spread < math.inf and (
                    best == NOBODY or is_likelier(d2, spread, best_d2, best_spread, places[entry, 3] < places[best, 3])
                ):
                    best, best_d2, best_spread = entry, d2, spread
        if best != NOBODY:
            # ln(a) <= a - 1: mostly that is enough.
            if best_d2 + best_spread - 1.0 <= bound or (gate.enabled and not best_d2 <= gate.d2):
                searching = False
            else:
                best_cost = cost(best_d2, best_spread)
                searching = not best_cost <= bound
                bound = best_cost
        elif gate.enabled or len(places) == 0 or not bound < math.inf:
            searching = False
        else:
            bound *= 16.0
        root = math.sqrt(bound)
    return best, best_d2


@compiled_inline
def associate(  # noqa: PLR0917 - a scan at a belief
    belief: PoseGaussian,
    facing: UnitVector,
    rows: ScanRows,
    model: ObservationModel,
    gate: Gate,
    index: ReflectorIndex,
    given: Considering | None,
) -> None:
    """Associate the detections of one scan, all at the predicted belief.

    Parameters
    ----------
    belief, facing : after *predict*, and the direction of its heading.
    rows : the scan's detections, in and out; what the detector has rejected is left alone.
    model : of the observation.
    gate : of the association filter.
    index : the map.
    given : of the scan, where constants are considered, else None.

    Notes
    -----
    Inlier if d2 <= gate of the most likely reflector: Sobreira et al. 2016, Algorithm 3, line 6.

    A reflector is one cluster in a scan. Where two inliers claim the same one, the paper uses both; here the nearer
    one in the Mahalanobis sense stays and the other becomes an outlier of the association filter, because one of them
    is a false reflector beside the true one. With the filter disabled both stay, as in the paper. Other methods:
    `decide_together`.
    """
    first, last, measured, aims, status, entries, d2 = rows
    view = viewpoint(belief, facing, model)
    reach = reach_of(view, index.cells.largest_variance, given)
    for i in range(first, last):
        entries[i] = NOBODY
        d2[i] = math.nan
        if status[i] != INLIER:
            continue
        distance, aim = measured[i, 0] - model.range_bias, UnitVector(aims[i - first, 0], aims[i - first, 1])
        ray = composed(facing, aim)
        best, best_d2 = likeliest(belief, facing, distance, ray, aim, view, reach, model, gate, index, given)
        entries[i] = best
        d2[i] = best_d2
        if best == NOBODY or (gate.enabled and not best_d2 <= gate.d2):
            status[i] = OUTLIER_ASSOCIATION
        elif gate.enabled and gate.method == EXCLUSIVE:
            # One at most: of two the farther has become an outlier before.
            for other in range(first, i):
                if status[other] == INLIER and entries[other] == best:
                    status[i if d2[other] <= best_d2 else other] = OUTLIER_ASSOCIATION
    _decide_together(gate.joint, gate, belief, facing, view, reach, rows, model, index, given)


@compiled_inline
def _decide_together(  # noqa: PLR0917 - a scan at a belief
    joint: tuple[float, ...] | None,
    gate: Gate,
    belief: PoseGaussian,
    facing: UnitVector,
    view: Viewpoint,
    reach: Viewpoint,
    rows: ScanRows,
    model: ObservationModel,
    index: ReflectorIndex,
    given: Considering | None,
) -> None:
    """`decide_together`, where the gate has distances for several at once."""
    if joint is None:
        return
    if gate.enabled and CAREFUL <= gate.method <= JOINT:
        decide_together(gate.method, gate.kind, joint, belief, facing, view, reach, rows, model, index, given)
