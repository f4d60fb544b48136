"""The filter's whole state as one value: with it and the records to come, the rest of a run is decided.

What the filter is given and does not change is `setup`.
"""

from __future__ import annotations

from typing import NamedTuple

from commission.localization.cross_covariance import CrossCovariance
from commission.localization.estimate import Belief, Mode
from commission.localization.lasting import LastingInnovations
from commission.localization.odometry import AT_REST, Motion
from commission.localization.pose_gaussian import PoseGaussian, from_belief, to_belief
from commission.localization.protection_state import ProtectionState
from commission.localization.rejection import NO_EVIDENCE, Evidence
from commission.localization.rival_poses import KeptPoses
from commission.localization.search_state import Search, new_search
from commission.localization.temporary_memory import TemporaryLandmarks
from commission.localization.wall_depth import AS_DRAWN, WallDepth

NO_RECORD_NS = -(2**63)
"""Stamp of the newest record before there is one: no stamp is older [ns]."""


class Tracking(NamedTuple):
    """What kernels hand from one record to the next: scalars alone."""

    belief: PoseGaussian
    """The filter's own belief; it goes on in fail mode."""
    belief_ns: int
    """Stamp that it is about [ns]."""
    motion: Motion
    """Last odometry, and how far the belief has gone ahead of it."""
    mode: int
    """State of the supervisor after the newest scan, a `Mode`."""
    evidence: Evidence
    """How many detections of late were accepted and rejected."""
    output: PoseGaussian
    """What the vehicle is given: the belief of the last operational cycle, before the first one the start."""
    output_ns: int
    """Stamp that the output is about [ns]."""
    newest_ns: int
    """Stamp of the newest record of any kind [ns]."""
    pivot: tuple[float, float]
    """Where the belief was after the newest scan [m]: the covariance with the constants is about that place."""
    walls: WallDepth = AS_DRAWN
    """How far behind the faces that the floor map draws beams end."""


class FilterState(NamedTuple):
    """All that the localizer remembers from one record to the next.

    What has a length of its own is handed to kernels as arrays, beside `tracking`, and written by them in place.
    """

    tracking: Tracking
    sensor_detects: bool = False
    """Whether the sensor has ever sent detections of its own: from then on its scans are not detected from."""
    cross: CrossCovariance | None = None
    """Covariance with the considered constants; None: all are zero."""
    search: Search | None = None
    """What is known of a vehicle that is lost or not located yet; None while it knows where it is."""
    protection: ProtectionState | None = None
    """Filters that leave one reflector out each; None: not begun, or not asked for."""
    temporary: TemporaryLandmarks | None = None
    """Landmarks that come and go; None: none are remembered."""
    rivals: KeptPoses | None = None
    """Where the vehicle may stand as well; None: not begun, or scans are decided on one by one."""
    lasting: LastingInnovations | None = None
    """Mean innovations of bearings; None: there are none."""


def state_at_start(initial: Belief) -> FilterState:
    """Return the state before the first record; raises ValueError when the belief is no pose and covariance."""
    belief = from_belief(initial)
    stamp_ns = int(initial.stamp_ns)
    return FilterState(
        Tracking(
            belief=belief,
            belief_ns=stamp_ns,
            motion=AT_REST,
            mode=int(Mode.OPERATIONAL),
            evidence=NO_EVIDENCE._replace(stamp_ns=stamp_ns),
            output=belief,
            output_ns=stamp_ns,
            newest_ns=NO_RECORD_NS,
            pivot=(belief.x, belief.y),
        )
    )


def state_unlocated(stamp_ns: int, anywhere: PoseGaussian) -> FilterState:
    """Return the state before the first record of a vehicle that is not told where it is.

    Parameters
    ----------
    stamp_ns : of the first record [ns].
    anywhere : a belief as wide as the floor, see `SearchMap`.
    """
    unknown = state_at_start(to_belief(anywhere, stamp_ns))
    tracking = unknown.tracking._replace(mode=int(Mode.INITIALIZING))
    return unknown._replace(tracking=tracking, search=new_search(stamp_ns))


def belief_of(state: FilterState) -> Belief:
    """Return the filter's own belief as arrays."""
    return to_belief(state.tracking.belief, state.tracking.belief_ns)


def output_of(state: FilterState) -> Belief:
    """Return what the vehicle is given as arrays."""
    return to_belief(state.tracking.output, state.tracking.output_ns)
