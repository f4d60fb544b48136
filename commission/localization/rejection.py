"""Second rule of the supervisor, beside Algorithm 4: a vehicle whose detections fit no reflector is not localized.

The covariance knows nothing of a wheel that slipped or of a wrong association: it stays small while the gate rejects
what is really there. So the share of rejected detections is watched, over a window that forgets.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.association import INLIER, OUTLIER_ASSOCIATION
from commission.localization.observation import ObservationModel, scanner_offset
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reflector_index import Cells, cell_range
from commission.site.parameters import SupervisorParameters

CLEARED = 0.5
"""The rule no longer holds once both shares are below this part of their limits: so the mode does not flicker."""


class Evidence(NamedTuple):
    """Detections of late, older ones counting less: how many were accepted, how many rejected."""

    stamp_ns: int
    """Time of the scan that was counted last [ns]."""
    near_accepted: float
    near_rejected: float
    """Rejected although a reflector of the map is near; forgotten at a pace of their own."""
    accepted: float
    rejected: float
    """All of them."""


NO_EVIDENCE = Evidence(0, 0.0, 0.0, 0.0, 0.0)


class RejectionRule(NamedTuple):
    """Window and limits, for kernels."""

    enabled: bool
    window_s: float
    fewest: float
    """Detections that the window holds at least, however long ago they were."""
    reach: float
    near_limit: float
    limit: float


def rejection_rule(parameters: SupervisorParameters) -> RejectionRule:
    """Return window and limits for the kernel; the rule is off where the supervisor is."""
    return RejectionRule(
        bool(parameters.enabled and parameters.rejection_enabled),
        float(parameters.rejection_window),
        float(parameters.rejection_evidence),
        float(parameters.rejection_reach),
        float(parameters.rejection_near_limit),
        float(parameters.rejection_limit),
    )


@compiled_inline
def weigh(  # noqa: PLR0917 - the scan's detections and the map, array by array
    evidence: Evidence,
    stamp_ns: int,
    belief: PoseGaussian,
    first: int,
    last: int,
    detections: FloatArray,
    model: ObservationModel,
    cells: Cells,
    places: FloatArray,
    cell_offsets: IntArray,
    status: NDArray[np.int8],
    rule: RejectionRule,
) -> Evidence:
    """Count what became of a scan's detections.

    Parameters
    ----------
    evidence : before the scan.
    stamp_ns : of the scan [ns].
    belief : that the detections were associated at.
    first, last : rows of the scan's detections, the last one excluded.
    detections : (n, 2) measured range [m] and bearing [rad], scanner frame.
    model : of the observation.
    cells, places, cell_offsets : the map, see `ReflectorIndex`.
    status : (n,) a `Status` each; what the detector filter rejected does not count.
    rule : window and limits.

    Notes
    -----
    n <- n max(exp(-dt / window), min(1, fewest / n)) + count: exponential forgetting that waits where there is little,
    derived from a mean over the window.
    """
    accepted, rejected, near = 0.0, 0.0, 0.0
    for i in range(first, last):
        if status[i] == INLIER:
            accepted += 1.0
        elif status[i] == OUTLIER_ASSOCIATION:
            rejected += 1.0
            direction = belief.theta + model.mount_theta + detections[i, 1]
            measured = detections[i, 0] - model.range_bias
            offset_x, offset_y = scanner_offset(belief.theta, model)
            x = belief.x + offset_x + measured * math.cos(direction)
            y = belief.y + offset_y + measured * math.sin(direction)
            if is_near(x, y, rule.reach, cells, places, cell_offsets):
                near += 1.0
    passed = math.exp(-(stamp_ns - evidence.stamp_ns) * 1e-9 / rule.window_s)
    kept = max(passed, min(1.0, rule.fewest / max(evidence.accepted + evidence.rejected, 1e-9)))
    kept_near = max(passed, min(1.0, rule.fewest / max(evidence.near_accepted + evidence.near_rejected, 1e-9)))
    return Evidence(
        stamp_ns,
        kept_near * evidence.near_accepted + accepted,
        kept_near * evidence.near_rejected + near,
        kept * evidence.accepted + accepted,
        kept * evidence.rejected + rejected,
    )


@compiled_inline
def is_near(  # noqa: PLR0917 - a place and the map, array by array
    x: float, y: float, reach: float, cells: Cells, places: FloatArray, cell_offsets: IntArray
) -> bool:
    """Whether a reflector of the map is within reach of a place.

    Parameters
    ----------
    x, y : the place [m], map frame.
    reach : radius of the search [m].
    cells, places, cell_offsets : the map, see `ReflectorIndex`.

    Notes
    -----
    min |place - reflector| <= reach, by definition.
    """
    px, py = x - cells.origin_x, y - cells.origin_y
    first_row, last_row = cell_range(py - reach, py + reach, cells.size, cells.rows)
    first_column, last_column = cell_range(px - reach, px + reach, cells.size, cells.columns)
    for row in range(first_row, last_row + 1 if last_column >= first_column else first_row):
        start = cell_offsets[row * cells.columns + first_column]
        for entry in range(start, cell_offsets[row * cells.columns + last_column + 1]):
            dx, dy = places[entry, 0] - x, places[entry, 1] - y
            if dx * dx + dy * dy <= reach * reach:
                return True
    return False


@compiled_inline
def rejects_the_world(was_lost: bool, evidence: Evidence, rule: RejectionRule) -> bool:
    """Whether too many detections are rejected for the pose to be right.

    Parameters
    ----------
    was_lost : whether they were before: then both shares must fall well below their limits.
    evidence : after the scan.
    rule : window and limits.

    Notes
    -----
    rejected / max(rejected + accepted, fewest) > limit, of those near reflectors or of all, by definition.
    """
    if not rule.enabled:
        return False
    near = evidence.near_rejected / max(evidence.near_rejected + evidence.near_accepted, rule.fewest)
    whole = evidence.rejected / max(evidence.rejected + evidence.accepted, rule.fewest)
    if was_lost:
        return near >= CLEARED * rule.near_limit or whole >= CLEARED * rule.limit
    return near > rule.near_limit or whole > rule.limit
