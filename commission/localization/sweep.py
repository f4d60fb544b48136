"""When and which way up a scanner measures: detections brought to the stamp of their scan, and upright.

A sweep takes time while the vehicle drives, and a scanner's clock need not be the vehicle's. No filter in here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry import se2
from commission.geometry.angles import wrap, wrap_scalar
from commission.geometry.arrays import FloatArray, read_only
from commission.geometry.se2 import exp_scalars
from commission.localization.observation import ObservationModel
from commission.localization.odometry import Motion, NextOdometry, trend
from commission.site.scanner import Scanner


class Sweep(NamedTuple):
    """Times of the beams of a scanner, for kernels: linear in the bearing."""

    upright: float
    """-1 of a scanner that hangs upside down, else 1."""
    middle: float
    """Bearing of the middle of the field of view, as the scanner reports it [rad]."""
    seconds_per_rad: float
    """How much later a beam is measured than one a radian before it; negative where the beam turns clockwise."""
    seconds_at_middle: float
    """When the middle is measured, after the stamp, on the vehicle's clock [s]."""


AT_ONCE = Sweep(1.0, 0.0, 0.0, 0.0)
"""A scan of one instant, upright, on the vehicle's clock: nothing is to be done."""


def sweep_of(scanner: Scanner) -> Sweep:
    """Return the times of the beams of a scanner; `AT_ONCE` where nothing is to be done.

    A clock that is ahead by an offset stamps too late by it: what is measured at the stamp was measured before it.
    """
    span = max((scanner.beam_count - 1) * scanner.angle_increment, scanner.angle_increment)
    first, last = scanner.beam_times[[0, -1]].tolist()
    sweep = Sweep(
        -1.0 if scanner.upside_down else 1.0,
        scanner.angle_min + 0.5 * span,
        (last - first) / span,
        0.5 * (first + last) - scanner.clock_offset,
    )
    return AT_ONCE if sweep[0] == 1.0 and sweep[2] == sweep[3] == 0.0 else sweep


def sweep_rows(sweeps: Sequence[Sweep]) -> FloatArray:
    """(S, 4) the sweeps of several scanners, for kernels; (0, 4) where nothing is to be done for any."""
    acting = sweeps if any(sweep != AT_ONCE for sweep in sweeps) else ()
    return read_only(np.array(acting, dtype=np.float64).reshape(-1, 4))


def points_at_stamp(scanner: Scanner, range_bearing: FloatArray, twist: FloatArray) -> FloatArray:
    """Where the scanner would have measured points at the stamp of their scan: as in `bring_to_stamp`, of any beams.

    Parameters
    ----------
    scanner : whose beams they are.
    range_bearing : (N, 2) range [m] and bearing [rad], as it reports them.
    twist : (3,) velocity of base: forward, to the left [m/s], turning [rad/s].

    Returns
    -------
    points_scanner : (N, 2) array [m], scanner frame, upright.
    """
    sweep, ranges = sweep_of(scanner), range_bearing[:, :1]
    bearings = scanner.upright(range_bearing[:, 1])
    points = ranges * np.stack((np.cos(bearings), np.sin(bearings)), axis=1)
    seconds = sweep.seconds_at_middle + sweep.seconds_per_rad * wrap(range_bearing[:, 1] - sweep.middle)
    if not seconds.any():
        return points
    moved = se2.compose(se2.exp(seconds[:, np.newaxis] * twist), scanner.mounting)
    return se2.transform_points(se2.compose(se2.inverse(scanner.mounting), moved), points)


@compiled_inline
def sweep_at(rows: FloatArray, scanner: int) -> Sweep:
    """Sweep of one scanner out of `sweep_rows`."""
    return Sweep(rows[scanner, 0], rows[scanner, 1], rows[scanner, 2], rows[scanner, 3])


@compiled
def bring_to_stamp(  # noqa: PLR0917 - outputs are written into the arrays of the whole run
    motion: Motion,
    following: NextOdometry,
    first: int,
    last: int,
    measured: FloatArray,
    sweep: Sweep,
    observation: ObservationModel,
    settled: FloatArray,
) -> None:
    """Write where the scanner would have seen each detection of a scan at its stamp.

    Parameters
    ----------
    motion : before the scan.
    following : the odometry record after the scan, where it is known.
    first, last : rows of the scan's detections, the last one excluded.
    measured : (n, 2) range [m] and bearing [rad], as the scanner reports them.
    sweep : when each was measured, and which way up.
    observation : mounting and range bias of the scanner.
    settled : (n, 2) output: range [m] and bearing [rad] at the stamp, scanner frame, upright.

    Notes
    -----
    p = exp(tau Ad(m^-1) v) q with q the measured point, tau its time after the stamp, v the twist of base and m the
    mounting: motion at a constant twist (Solà et al. 2018, equations 156 to 158; adjoint 159). At tau = 0 every bit
    stays.
    """
    forward, left, turn = motion.trend_x, motion.trend_y, motion.trend_theta
    if following.known:
        forward, left, turn = trend(motion, following.stamp_ns, following.dx, following.dy, following.dtheta)
    # Velocity of the scanner in its own frame, upright: it is as fast as base, and by what it turns about base.
    at_x, at_y = forward - turn * observation.mount_y, left + turn * observation.mount_x
    c, s = math.cos(observation.mount_theta), math.sin(observation.mount_theta)
    scanner_x, scanner_y = c * at_x + s * at_y, c * at_y - s * at_x
    for i in range(first, last):
        distance, bearing = measured[i, 0], measured[i, 1]
        tau = sweep.seconds_at_middle + sweep.seconds_per_rad * wrap_scalar(bearing - sweep.middle)
        bearing *= sweep.upright
        if tau != 0.0:
            x, y, theta = exp_scalars(tau * scanner_x, tau * scanner_y, tau * turn)
            true_range = distance - observation.range_bias
            px, py = x + true_range * math.cos(theta + bearing), y + true_range * math.sin(theta + bearing)
            distance, bearing = math.sqrt(px * px + py * py) + observation.range_bias, math.atan2(py, px)
        settled[i, 0], settled[i, 1] = distance, bearing
