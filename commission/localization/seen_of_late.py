"""What was seen of late by a vehicle that does not know where it is: things and views, in the frame of odometry.

It takes scans in and chooses what is to be looked up; nothing is compared with the map here.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.geometry.se2 import compose
from commission.localization.association import INLIER, OUTLIER_ASSOCIATION
from commission.localization.beam_ends import beam_ends
from commission.localization.observation import ObservationModel
from commission.localization.odometry import NextOdometry
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.search_state import Search
from commission.localization.sightings import CERTAIN, COLUMNS, MOST_THINGS, join
from commission.localization.start import PAIRS
from commission.localization.trail import lengthened, way_between
from commission.site.records import Scan

VIEWS = 5
"""Places on the way from which reflectors should have been seen."""
VIEW_S = 0.3
"""Time between two of them at least [s]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SeenScan:
    """A scan's detections, for the search."""

    stamp_ns: int
    """Of the scan [ns]."""
    detections: FloatArray
    """(n, 2) range [m] and bearing [rad] at the stamp, scanner frame, upright."""
    status: NDArray[np.int8]
    """(n,) a `Status` each."""
    scanner: int
    """Index of the scanner."""
    observation: ObservationModel
    """Its mounting and noise."""
    ranges: Callable[[], Scan | None]
    """The scan itself, asked for where it is looked at; None where the sensor alone knows it."""
    upside_down: bool
    """Whether the scanner hangs so."""
    following: NextOdometry
    """The odometry record at or after the scan, where it is known."""


def joined_scan(search: Search, track: PoseGaussian, scan: SeenScan) -> Search:
    """Join a scan's detections to the things seen, and remember from where.

    Parameters
    ----------
    search : before the scan.
    track : pose of base at the scan in the frame of odometry, and what odometry has drifted since the last scan.
    scan : what was seen.
    """
    position = search.drift[0] + max(track.xx, track.yy)
    heading = search.drift[1] + track.tt
    seconds = (scan.stamp_ns - search.since_ns) * 1e-9
    things = np.empty((MOST_THINGS, COLUMNS))
    things[: len(search.things)] = search.things
    count = join(
        things,
        len(search.things),
        seconds,
        position,
        heading,
        track.x,
        track.y,
        track.theta,
        read_only(scan.detections),
        scan.status,
        scan.observation,
    )
    views, ends = search.views, search.ends
    of_it = views[:, 3] == scan.scanner
    mine = views[of_it]
    # A scan that saw nothing may be a covered one, of which nobody knows the scanner.
    if len(scan.detections) and (len(mine) == 0 or seconds - mine[-1, 4] >= VIEW_S):
        model = scan.observation
        at = compose((track.x, track.y, track.theta), (model.mount_x, model.mount_y, model.mount_theta))
        mine = np.vstack((mine, (*at, float(scan.scanner), seconds)))[-VIEWS:]
        views = np.concatenate((views[~of_it], mine))
        newest = beam_ends(scan.ranges(), upside_down=scan.upside_down)
        ends = np.concatenate((ends[~of_it], np.concatenate((ends[of_it], newest))[-VIEWS:]))
    of_map = (scan.status == INLIER) | (scan.status == OUTLIER_ASSOCIATION)
    newest = np.array((seconds, track.x, track.y, track.theta, position, heading, float(scan.scanner), 0.0))
    trail = lengthened(search.trail, newest, scan.detections[of_map])
    way = way_between(trail.scans[-2], trail.scans[-1]) if len(trail.scans) > 1 and of_map.any() else 0.0
    still = track._replace(xx=0.0, xy=0.0, xt=0.0, yy=0.0, yt=0.0, tt=0.0)
    return replace(
        search,
        track=still,
        drift=(position, heading),
        things=read_only(things[:count].copy()),
        views=read_only(views),
        ends=read_only(ends),
        trail=trail,
        way=search.way + way,
    )


def certain_things(search: Search) -> FloatArray:
    """(C, 5) x, y [m] and covariance [m^2] of things that came back, as of now; those seen most often first."""
    things = search.things[search.things[:, 5] >= CERTAIN]
    things = things[np.argsort(-things[:, 5], kind="stable")]
    away2 = (things[:, 0] - search.track.x) ** 2 + (things[:, 1] - search.track.y) ** 2
    drifted = search.drift[0] - things[:, 7] + (search.drift[1] - things[:, 8]) * away2
    known = np.minimum(things[:, 5], 4.0)[:, np.newaxis]
    result = np.column_stack((things[:, :2], things[:, 2:5] / known))
    result[:, 2] += drifted + 1e-4
    result[:, 4] += drifted + 1e-4
    return read_only(result[result[:, 2] + result[:, 4] < 0.5])


def pairs_of(things: FloatArray) -> IntArray:
    """(P, 2) pairs of things to be looked up: long ones of things seen often first, no thing in too many of them."""
    count = min(len(things), 16)
    pairs = np.array(list(itertools.combinations(range(count), 2)), dtype=np.int64).reshape(-1, 2)
    deltas = things[pairs[:, 0], :2] - things[pairs[:, 1], :2]
    length = np.hypot(deltas[:, 0], deltas[:, 1])
    sigma = np.sqrt(things[:, 2] + things[:, 4])
    score = length / (sigma[pairs[:, 0]] + sigma[pairs[:, 1]] + 0.05)
    order = np.argsort(-score, kind="stable")
    used = np.zeros(count, dtype=np.int64)
    chosen: list[int] = []
    most = max(3, 2 * PAIRS // max(count, 1) + 1)
    for each in order.tolist():
        i, j = pairs[each]
        if length[each] > 0.3 and used[i] < most and used[j] < most:
            used[i] += 1
            used[j] += 1
            chosen.append(each)
        if len(chosen) == PAIRS:
            break
    return read_only(pairs[chosen])


def clutter(things: FloatArray, search: Search) -> float:
    """Density of things, were none of them a reflector [1 / m^2]."""
    away = np.hypot(things[:, 0] - search.track.x, things[:, 1] - search.track.y)
    return len(things) / (math.pi * max(float(away.max()), 1.0) ** 2)
