"""Things seen of late while nobody knows where the vehicle is: detections of many scans, joined by odometry.

A thing is what scans detect again and again at one place of a frame that odometry carries along. It has no name, and
nothing is compared with the map here: `start` does that.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray
from commission.localization.association import INLIER, OUTLIER_ASSOCIATION
from commission.localization.observation import ObservationModel

MOST_THINGS = 64
"""Things that are remembered; beyond, the one that was seen least gives way."""
COLUMNS = 9
"""Of a thing: x, y [m]; covariance xx, xy, yy of one detection [m^2]; times seen; last seen [s]; and the drift of
odometry at that time: variance of the position, each axis [m^2], and of the heading [rad^2]."""
JOINED = 9.21
"""Squared distance up to which a detection is of a thing: 99 % of chi-square with 2 degrees of freedom."""
FARTHEST_JOINED = 0.5
"""No detection is joined to a thing farther away [m], whatever the noise is said to be."""
AVERAGED = 8.0
"""Detections over which the place of a thing is averaged: older ones fade, as odometry drifts."""
INDEPENDENT = 4.0
"""Detections of one thing whose errors count as independent: those of a vehicle at rest are all alike."""
FLEETING_S = 1.0
"""A thing that was seen less than `CERTAIN` times is forgotten after that time [s]."""
CERTAIN = 3.0
"""Times that a thing is seen before it is compared with the map: a false detection seldom comes back."""
FORGOTTEN_S = 20.0
"""Things not seen for longer are forgotten [s]: odometry has drifted too far by then."""
INFLATION = 2.25
"""Factor of the variance of a detection: errors of map, mounting and shape add to the sensor's, and stay."""


@compiled_inline
def noise_on_floor(range_variance: float, across: float, direction: float) -> tuple[float, float, float]:
    """Covariance of a detection on the floor: xx, xy, yy [m^2].

    Parameters
    ----------
    range_variance : along the ray [m^2].
    across : across it [m^2].
    direction : of the ray [rad].

    Notes
    -----
    R diag(along, across) R^T, by definition.
    """
    c, s = math.cos(direction), math.sin(direction)
    return (
        range_variance * c * c + across * s * s,
        (range_variance - across) * c * s,
        range_variance * s * s + across * c * c,
    )


@compiled_inline
def _not_forgotten(things: FloatArray, count: int, seconds: float) -> int:
    """Move the things that are not forgotten yet to the front; return their number.

    Notes
    -----
    No formula: it moves rows.
    """
    kept = 0
    for i in range(count):
        age = seconds - things[i, 6]
        if age <= FORGOTTEN_S and (age <= FLEETING_S or things[i, 5] >= CERTAIN):
            things[kept] = things[i]
            kept += 1
    return kept


@compiled
def join(  # noqa: PLR0917 - the scan's detections, array by array
    things: FloatArray,
    count: int,
    seconds: float,
    drift_position: float,
    drift_heading: float,
    x: float,
    y: float,
    theta: float,
    detections: FloatArray,
    status: NDArray[np.int8],
    model: ObservationModel,
) -> int:
    """Join the detections of a scan to the things seen so far; return how many things there are.

    Parameters
    ----------
    things : (MOST_THINGS, COLUMNS) in and out.
    count : things that there are.
    seconds : time of the scan since the search began [s].
    drift_position, drift_heading : variance of odometry since then [m^2, rad^2].
    x, y, theta : pose of base in the frame of odometry [m, m, rad].
    detections : (n, 2) range [m] and bearing [rad], scanner frame.
    status : (n,) a `Status` each; what the detector filter rejected is left out.
    model : mounting and noise of the scanner.

    Notes
    -----
    m <- m + (p - m) / min(n, 8): a mean that forgets; its covariance is that of one detection / min(n, 4), derived.
    """
    before = count = _not_forgotten(things, count, seconds)
    c, s = math.cos(theta), math.sin(theta)
    scanner_x = x + c * model.mount_x - s * model.mount_y
    scanner_y = y + s * model.mount_x + c * model.mount_y
    for row in range(len(detections)):
        if status[row] != INLIER and status[row] != OUTLIER_ASSOCIATION:
            continue
        distance = detections[row, 0] - model.range_bias
        direction = theta + model.mount_theta + detections[row, 1]
        px, py = scanner_x + distance * math.cos(direction), scanner_y + distance * math.sin(direction)
        across = model.bearing_variance * distance * distance
        xx, xy, yy = noise_on_floor(INFLATION * model.range_variance, INFLATION * across, direction)
        least, best = JOINED, -1
        for i in range(before):
            dx, dy = px - things[i, 0], py - things[i, 1]
            square = dx * dx + dy * dy
            if square > FARTHEST_JOINED * FARTHEST_JOINED:
                continue
            drifted = drift_position - things[i, 7] + (drift_heading - things[i, 8]) * distance * distance
            sxx, sxy, syy = xx + things[i, 2] + drifted, xy + things[i, 3], yy + things[i, 4] + drifted
            d2 = (syy * dx * dx - 2.0 * sxy * dx * dy + sxx * dy * dy) / (sxx * syy - sxy * sxy)
            if d2 < least:
                least, best = d2, i
        if best >= 0:
            things[best, 5] += 1.0
            share = 1.0 / min(things[best, 5], AVERAGED)
            things[best, 0] += share * (px - things[best, 0])
            things[best, 1] += share * (py - things[best, 1])
        else:
            best = count if count < MOST_THINGS else int(np.argmin(things[:, 5]))
            count = min(count + 1, MOST_THINGS)
            things[best, 0], things[best, 1], things[best, 5] = px, py, 1.0
        things[best, 2], things[best, 3], things[best, 4] = xx, xy, yy
        things[best, 6], things[best, 7], things[best, 8] = seconds, drift_position, drift_heading
    return count
