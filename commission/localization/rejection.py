"""Second rule of the supervisor, beside Algorithm 4: a vehicle whose detections fit no reflector is not localized.

The covariance knows nothing of a wheel that slipped or of a wrong association: it stays small while the gate rejects
what is really there. So the share of rejected detections is watched, over windows that forget; and scans in a row that
reject nearly all they see, as after a vehicle was carried away, tell it sooner than any window. And where the gate was
so wide that any reflector would have been accepted, one that was is no proof: more of them must confirm the pose.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.localization.association import INLIER, NOBODY, OUTLIER_ASSOCIATION
from commission.localization.displacement import NO_PAIRS, tell_of_a_displacement, with_pair
from commission.localization.observation import ObservationModel, scanner_offset
from commission.localization.pose_gaussian import PoseGaussian, position_variance
from commission.localization.reflector_index import ReflectorIndex, nearest_entry
from commission.localization.scan_rows import ScanRows
from commission.site.parameters import SupervisorParameters

CLEARED = 0.5
"""The rule no longer holds once both shares are below this part of their limits: so the mode does not flicker."""
FEWEST_AGAINST = 3.0
"""Rejected detections that a scan holds at least to speak against the pose: of one shiny thing there is one."""
MOST_FOR = 0.25
"""Accepted ones for each rejected one that such a scan holds at most: chance lets one or two of eight pass."""
NOISE = 3.0
"""Sigma of a range that say nothing of the pose: what is rejected is beyond two of them as it is."""
PER_MATCH = 3.0
"""Accepted detections that a match of contours which tells the whole pose counts for."""


class Evidence(NamedTuple):
    """Detections of late, older ones counting less: how many were accepted, how many rejected."""

    stamp_ns: int
    """Time of the scan that was counted last [ns]."""
    near_accepted: float
    near_rejected: float
    """Rejected although a reflector of the map is near: over the short window."""
    accepted: float
    rejected: float
    """All of them: over the long window."""
    confirmed: float
    """Accepted detections and matches of contours, since the belief was too wide to tell reflectors apart; infinite
    where it never was."""
    against: float
    """Scans in a row that rejected nearly all they saw; those that saw too little to say are passed over, and each that
    a part of the pose fits takes one back."""
    lasting: bool = False
    """Whether innovations of bearings do not average out, see `lasting`."""


NO_EVIDENCE = Evidence(0, 0.0, 0.0, 0.0, 0.0, math.inf, 0.0, False)


class RejectionRule(NamedTuple):
    """Windows and limits, for kernels."""

    enabled: bool
    window_s: float
    long_window_s: float
    fewest: float
    """Detections that the short window holds at least, however long ago they were."""
    fewest_of_all: float
    """The same of the long window."""
    reach: float
    turn: float
    """A detection at range r is near a reflector up to reach + turn r."""
    harmless: float
    harmless_turn: float
    """It says nothing where such an error of the position and of the heading explains it, see `is_harmless`."""
    near_limit: float
    limit: float
    doubtful_position: float
    doubtful_heading: float
    """2-sigma before a scan beyond which what is accepted proves nothing."""
    confirmations: float
    """Detections that then have to be accepted."""
    scans_against: float
    """Scans in a row that reject nearly all they see, from which on the vehicle is lost."""


def rejection_rule(parameters: SupervisorParameters) -> RejectionRule:
    """Return windows and limits for the kernel; the rule is off where the supervisor is."""
    longer = parameters.rejection_long_window / parameters.rejection_window
    return RejectionRule(
        enabled=bool(parameters.enabled and parameters.rejection_enabled),
        window_s=float(parameters.rejection_window),
        long_window_s=float(parameters.rejection_long_window),
        fewest=float(parameters.rejection_evidence),
        fewest_of_all=float(parameters.rejection_evidence * longer),
        reach=float(parameters.rejection_reach),
        turn=float(parameters.rejection_turn),
        harmless=float(parameters.rejection_harmless * parameters.position_limit),
        harmless_turn=float(parameters.rejection_harmless * parameters.heading_limit),
        near_limit=float(parameters.rejection_near_limit),
        limit=float(parameters.rejection_limit),
        doubtful_position=float(parameters.doubt_ratio * parameters.position_limit),
        doubtful_heading=float(parameters.doubt_ratio * parameters.heading_limit),
        confirmations=float(parameters.confirmations if parameters.enabled else 0.0),
        scans_against=float(parameters.rejection_scans),
    )


class Counted(NamedTuple):
    """Detections of one scan."""

    accepted: float
    rejected: float
    """What an error explains that the supervisor allows is not among them, see `count_detections`."""
    near: float
    """Rejected although a reflector of the map is near."""


NOTHING_COUNTED = Counted(0.0, 0.0, 0.0)


@compiled_inline
def count_detections(
    belief: PoseGaussian, rows: ScanRows, model: ObservationModel, index: ReflectorIndex, rule: RejectionRule
) -> Counted:
    """Count what became of a scan's detections.

    Parameters
    ----------
    belief : that the detections were associated at.
    rows : the scan's detections; what the detector filter rejected does not count.
    model : of the observation.
    index : the map.
    rule : windows and limits.

    Notes
    -----
    No formula: it counts. What an error explains that the supervisor allows does not (`is_harmless`), unless all that
    is rejected near reflectors tells together of one that it does not allow: `tell_of_a_displacement`.
    """
    first, last, measured, _, status, _, _ = rows
    accepted, rejected, near, excused, pairs, before = 0.0, 0.0, 0.0, 0.0, NO_PAIRS, NOBODY
    for i in range(first, last):
        if status[i] == INLIER:
            accepted += 1.0
        elif status[i] == OUTLIER_ASSOCIATION:
            direction = belief.theta + model.mount_theta + measured[i, 1]
            distance = measured[i, 0] - model.range_bias
            offset_x, offset_y = scanner_offset(belief.theta, model)
            qx = offset_x + distance * math.cos(direction)
            qy = offset_y + distance * math.sin(direction)
            x, y, reach = belief.x + qx, belief.y + qy, rule.reach + rule.turn * distance
            entry, _ = nearest(x, y, reach, index)
            if entry == NOBODY:
                rejected += 1.0
                continue
            place = index.places[entry]
            ex, ey, survey = place[0] - x, place[1] - y, place[2]
            if is_harmless(qx, qy, ex, ey, model.range_variance + survey, rule):
                excused += 1.0
            else:
                rejected, near = rejected + 1.0, near + 1.0
            # Neighbors in a scan: of one reflector there is one detection, the others are of something else.
            if entry != before:
                variance = model.range_variance + distance * distance * model.bearing_variance + survey
                pairs, before = with_pair(pairs, qx, qy, ex, ey, variance), entry
    told = excused if excused > 0.0 and tell_of_a_displacement(pairs, rule.harmless, rule.harmless_turn) else 0.0
    return Counted(accepted, rejected + told, near + told)


@compiled_inline
def weigh(  # noqa: PLR0917 - what a cycle has found, value by value
    evidence: Evidence, stamp_ns: int, belief: PoseGaussian, counted: Counted, contours: float, rule: RejectionRule
) -> Evidence:
    """Evidence after a scan, by what became of its detections and by what its contours, or tags, say.

    Parameters
    ----------
    evidence : before the scan.
    stamp_ns : of the scan [ns].
    belief : that the detections were associated at.
    counted : detections of the scan.
    contours : 1 where they match and tell the whole pose, 0.5 where they tell a part of it, -1 where what they tell is
        rejected, else 0.
    rule : windows and limits.

    Notes
    -----
    Counts as in `decayed`. A scan speaks for the pose where accepted > rejected / 4, and against it where
    not and rejected >= 3, by definition. Where reflectors speak for it, rejected contours say nothing: the walls have
    changed. Where they do not, rejected contours speak against it; and contours that match, from a belief that was not
    doubtful, speak for it: then what is near no reflector is a thing that the map lacks and does not count, but what is
    rejected near reflectors does, so that many of those still make the vehicle lost. A match counts as three accepted
    detections, and as one where the pose has to prove right. One that tells a part of the pose proves nothing; it
    takes back one scan that spoke against the pose.
    """
    accepted, rejected, near = counted
    confirmed, against = evidence.confirmed, evidence.against
    doubtful = is_doubtful(belief, rule)
    matches = contours == 1.0 and not doubtful
    if accepted > MOST_FOR * rejected or matches:
        against = 0.0
    elif rejected >= FEWEST_AGAINST or contours < 0.0:
        against += 1.0
    elif contours > 0.0 and not doubtful:
        against = max(against - 1.0, 0.0)
    if doubtful:
        accepted, confirmed = 0.0, 0.0
    confirmed += accepted
    if matches:
        accepted, rejected, confirmed = accepted + PER_MATCH, near, confirmed + 1.0
    return decayed(evidence, stamp_ns, accepted, rejected, near, confirmed, against, rule)


@compiled_inline
def is_harmless(  # noqa: PLR0917 - a detection and its reflector, number by number
    qx: float, qy: float, ex: float, ey: float, variance: float, rule: RejectionRule
) -> bool:
    """Whether an error of the pose that the supervisor allows explains where a detection is.

    Parameters
    ----------
    qx, qy : from base to the detection [m], map axes.
    ex, ey : from the detection to the reflector [m], map axes.
    variance : of its range and of the reflector's place, along the line of sight [m^2].
    rule : windows and limits.

    Notes
    -----
    e = d + t R q, |d| <= harmless, |t| <= harmless_turn, R the turn by 90 degrees: e lies within `harmless` of the
    stretch from -harmless_turn R q to harmless_turn R q, by definition. A turn explains nothing along the line of
    sight: there, up to 3 sigma are noise. Across it they are less than what the turn explains, and left out.
    """
    distance = math.sqrt(qx * qx + qy * qy)
    to_x, to_y = (qx / distance, qy / distance) if distance > 0.0 else (1.0, 0.0)
    along = max(abs(ex * to_x + ey * to_y) - NOISE * math.sqrt(variance), 0.0)
    across = max(abs(to_x * ey - to_y * ex) - rule.harmless_turn * distance, 0.0)
    return along * along + across * across <= rule.harmless * rule.harmless


@compiled_inline
def decayed(  # noqa: PLR0917 - the counts, one by one
    evidence: Evidence,
    stamp_ns: int,
    accepted: float,
    rejected: float,
    near: float,
    confirmed: float,
    against: float,
    rule: RejectionRule,
) -> Evidence:
    """Evidence after a cycle: what is old is forgotten, what is new is added.

    Parameters
    ----------
    evidence : before the cycle.
    stamp_ns : of the cycle [ns].
    accepted, rejected, near : detections of the cycle that were accepted, rejected, and rejected near reflectors.
    confirmed, against : as they stand after it.
    rule : windows.

    Notes
    -----
    n <- n max(exp(-dt / window), min(1, fewest / n)) + count: exponential forgetting that waits where there is little,
    derived from a mean over the window.
    """
    seconds = (stamp_ns - evidence.stamp_ns) * 1e-9
    of_near, of_all = evidence.near_accepted + evidence.near_rejected, evidence.accepted + evidence.rejected
    kept_near = max(math.exp(-seconds / rule.window_s), min(1.0, rule.fewest / max(of_near, 1e-9)))
    kept = max(math.exp(-seconds / rule.long_window_s), min(1.0, rule.fewest_of_all / max(of_all, 1e-9)))
    return Evidence(
        stamp_ns,
        kept_near * evidence.near_accepted + accepted,
        kept_near * evidence.near_rejected + near,
        kept * evidence.accepted + accepted,
        kept * evidence.rejected + rejected,
        confirmed,
        against,
        evidence.lasting,
    )


@compiled_inline
def is_doubtful(prior: PoseGaussian, rule: RejectionRule) -> bool:
    """Whether a belief is so wide that a detection which is accepted there proves nothing.

    Parameters
    ----------
    prior : before the detections of a scan.
    rule : windows and limits.

    Notes
    -----
    No formula: the largest 2-sigma of the position, or that of the heading, beyond a multiple of the supervisor's
    limit. A covariance that is not a number is doubtful.
    """
    position, heading = 2.0 * math.sqrt(position_variance(prior)), 2.0 * math.sqrt(prior.tt)
    return not (position <= rule.doubtful_position and heading <= rule.doubtful_heading)


@compiled_inline
def nearest(x: float, y: float, reach: float, index: ReflectorIndex) -> tuple[int, float]:
    """Row of the reflector that is nearest to a place, and its distance [m]; NOBODY and inf where none is in reach.

    Parameters
    ----------
    x, y : the place [m], map frame.
    reach : radius of the search [m].
    index : the map.

    Notes
    -----
    d = min |place - reflector|, by definition.
    """
    # A little farther, so that what is exactly at `reach` is decided by its distance and not by its rounded square.
    entry, square = nearest_entry(x, y, reach * (1.0 + 1e-9), index)
    distance = math.sqrt(square)
    return (entry, distance) if entry >= 0 and distance <= reach else (NOBODY, math.inf)


@compiled_inline
def rejects_the_world(was_lost: bool, evidence: Evidence, rule: RejectionRule) -> bool:
    """Whether too many detections are rejected for the pose to be right.

    Parameters
    ----------
    was_lost : whether they were before: then both shares must fall well below their limits.
    evidence : after the scan.
    rule : windows and limits.

    Notes
    -----
    rejected / max(rejected + accepted, fewest) > limit, of those near reflectors or of all; or so many scans in a row
    against the pose: by definition.
    """
    if not rule.enabled:
        return False
    near = evidence.near_rejected / max(evidence.near_rejected + evidence.near_accepted, rule.fewest)
    whole = evidence.rejected / max(evidence.rejected + evidence.accepted, rule.fewest_of_all)
    if was_lost:
        return near >= CLEARED * rule.near_limit or whole >= CLEARED * rule.limit or evidence.against > 0.0
    return near > rule.near_limit or whole > rule.limit or evidence.against >= rule.scans_against
