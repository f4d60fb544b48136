"""Where a run starts: the belief that the localizer is given before the first record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from commission.errors import UsageError
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, frozen
from commission.localization.estimate import Belief
from commission.localization.pose_gaussian import from_belief, to_belief
from commission.localization.search_map import anywhere
from commission.localization.state import FilterState, state_at_start, state_unlocated
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.routes import Direction, Route
from commission.studies.reference_headings import in_radians

DEFAULT_SIGMAS = (0.02, 0.02, 0.01)
"""1-sigma of a start pose that comes without one: x [m], y [m], theta [rad]: well inside the alarm limits."""
NEAR_THE_START_NS = 1_000_000_000
"""A reference pose this long after the first record is still taken for the start pose [ns]."""


class StartOrigin(StrEnum):
    """Who says where the run starts."""

    GIVEN = "as given"
    RECORDED = "as said when it was recorded"
    REFERENCE = "first reference pose"
    ROUTE = "start of the first route"
    DRIVE = "start of the virtual drive"
    CONTINUED = "as it drove on from what is forgotten"
    SEARCH = "not told: searched by what is seen"


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """The belief before the first record, and where it comes from."""

    belief: Belief
    """Stamped with the first record."""
    origin: StartOrigin
    """Who says so."""
    known: FilterState | None = None
    """The whole state there, where a run goes on; None: what the belief says."""

    def state(self) -> FilterState:
        """Return the state of the localizer before the first record."""
        if self.known is not None:
            return self.known
        if self.origin is StartOrigin.SEARCH:
            return state_unlocated(int(self.belief.stamp_ns), from_belief(self.belief))
        return state_at_start(self.belief)


def unknown_start(project: Project, log: RecordLog) -> Start:
    """Return the start of a run of which nobody says where it starts: the vehicle looks where it is.

    Parameters
    ----------
    project : it says how large the floor is.
    log : the recording; not empty, else UsageError.
    """
    floor = project.parameters.contour.seen_of(project.floor_map)
    return unknown_start_at(_first_stamp(log), project.reflectors.centers, floor)


def unknown_start_at(stamp_ns: int, centers: FloatArray, floor: FloorMap | None = None) -> Start:
    """Return the start of a vehicle that looks where it is.

    Parameters
    ----------
    stamp_ns : of the first record [ns].
    centers : (N, 2) places of the reflectors [m], map frame: they say how large the floor is.
    floor : the floor map where its contours are looked at: it says so as well.
    """
    return Start(to_belief(anywhere(centers, floor), stamp_ns), StartOrigin.SEARCH)


def _first_stamp(log: RecordLog) -> int:
    """Stamp of the first record [ns]."""
    if len(log) == 0:
        raise UsageError("the recording holds no record; expected odometry and scans or detections")
    return log.first_ns


def start_of(
    project: Project,
    log: RecordLog,
    pose: ArrayLike | None = None,
    sigmas: Sequence[float] | None = None,
) -> Start:
    """Return the belief to start a run with.

    It is, in this order: the pose given; what the recording says; the first reference pose, if it has a heading and
    comes within a second of the first record; the start of the project's first route; else the vehicle looks where it
    is.

    Parameters
    ----------
    project : the site.
    log : the recording; not empty.
    pose : (3,) array [m, m, rad], map frame, or None.
    sigmas : (3,) 1-sigma of x [m], y [m] and theta [rad]; `DEFAULT_SIGMAS` when None.

    Raises
    ------
    UsageError
        the recording is empty.
    """
    first_ns = _first_stamp(log)
    if pose is not None:
        return Start(belief_at(first_ns, pose, sigmas), StartOrigin.GIVEN)
    if log.start is not None:
        origin = StartOrigin.SEARCH if log.start.sought else StartOrigin.RECORDED
        return Start(Belief(first_ns, log.start.pose, log.start.covariance), origin)
    known = np.flatnonzero(
        np.isfinite(log.reference_poses).all(axis=1) & (log.reference_times_ns - first_ns <= NEAR_THE_START_NS)
    )
    if len(known) > 0:
        return Start(
            belief_at(first_ns, log.reference_mount.at_base(in_radians(log.reference_poses)[known[:1]])[0], sigmas),
            StartOrigin.REFERENCE,
        )
    if project.routes:
        return Start(belief_at(first_ns, route_start(project.routes[0]), sigmas), StartOrigin.ROUTE)
    return unknown_start(project, log)


def belief_at(stamp_ns: int, pose: ArrayLike, sigmas: Sequence[float] | None = None) -> Belief:
    """Return a belief whose x, y and theta are independent.

    Parameters
    ----------
    stamp_ns : time [ns].
    pose : (3,) array [m, m, rad], map frame.
    sigmas : (3,) 1-sigma [m, m, rad]; `DEFAULT_SIGMAS` when None.
    """
    mean = np.array(pose, dtype=np.float64)
    mean[2] = wrap(mean[2])
    variances = np.square(DEFAULT_SIGMAS if sigmas is None else sigmas)
    return Belief(
        stamp_ns, frozen(mean, (3,), "initial pose"), frozen(np.diag(variances), (3, 3), "initial covariance")
    )


def route_start(route: Route) -> tuple[float, float, float]:
    """Pose of base at the start of a route, x [m], y [m], theta [rad]; a reverse segment starts facing backward.

    A clamped curve starts at its first control point, towards the next one that is somewhere else.
    """
    segment = route.segments[0]
    x, y = segment.control_points[0]
    ahead = segment.control_points - segment.control_points[0]
    distinct = np.flatnonzero(np.hypot(ahead[:, 0], ahead[:, 1]) > 0.0)
    heading = math.atan2(ahead[distinct[0], 1], ahead[distinct[0], 0]) if len(distinct) else 0.0
    return float(x), float(y), heading + (math.pi if segment.direction is Direction.REVERSE else 0.0)
