"""Predict: the belief moves with odometry and spreads with distance, angle and time (Algorithm 1, lines 2 to 4).

Wheels are in `kinematics`; this module also keeps records of different rates together in time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.se2 import compose_scalars, exp_scalars, inverse_scalars, log_scalars
from commission.localization.pose_gaussian import PoseGaussian
from commission.site.parameters import OdometryParameters


class OdometryNoise(NamedTuple):
    """Variances per metre, radian and second: the squares of `OdometryParameters`."""

    forward_per_m: float
    lateral_per_m: float
    heading_per_m: float
    heading_per_rad: float
    forward_per_s: float
    heading_per_s: float


class Motion(NamedTuple):
    """Where in time the belief is, and how much of the coming odometry it has taken in advance."""

    started: bool
    """Whether an odometry record has come."""
    odometry_ns: int
    """Stamp of the last odometry record."""
    belief_ns: int
    """Stamp that the belief is about; later than `odometry_ns` after an extrapolation."""
    period_ns: int
    """Time that the last odometry displacement took."""
    dx: float
    """Last displacement, to be continued until the next one comes [m, m, rad]."""
    dy: float
    dtheta: float
    ahead_x: float
    """Motion already applied beyond the last odometry record: base of the belief in base at that record."""
    ahead_y: float
    ahead_theta: float


AT_REST = Motion(False, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def odometry_noise(parameters: OdometryParameters) -> OdometryNoise:
    """Return the variances per metre, radian and second of the parameters."""
    return OdometryNoise(
        parameters.forward_per_sqrt_m**2,
        parameters.lateral_per_sqrt_m**2,
        parameters.heading_per_sqrt_m**2,
        parameters.heading_per_sqrt_rad**2,
        parameters.forward_per_sqrt_s**2,
        parameters.heading_per_sqrt_s**2,
    )


@compiled_inline
def arc_length(dx: float, dy: float, dtheta: float) -> float:
    """Length of the arc that leads to a displacement, from its chord and its turn [m].

    Parameters
    ----------
    dx, dy, dtheta : displacement [m, m, rad].

    Notes
    -----
    |d| h / sin(h) with h = dtheta / 2: chord = 2 r sin(h) and arc = 2 r h, by definition of a circle.
    """
    half = 0.5 * wrap_scalar(dtheta)
    chord = math.sqrt(dx * dx + dy * dy)
    if abs(half) < 0.05:
        # Series of half / sin(half); the first term left out is 127 / 604800 half^8 < 1e-14.
        h2 = half * half
        return chord * (1.0 + h2 * (1.0 / 6.0 + h2 * (7.0 / 360.0 + h2 * (31.0 / 15120.0))))
    return chord * half / math.sin(half)


@compiled_inline
def predict(  # noqa: PLR0917 - a displacement, number by number
    belief: PoseGaussian, dx: float, dy: float, dtheta: float, seconds: float, noise: OdometryNoise
) -> PoseGaussian:
    """Move a belief by a displacement that took some time.

    The mean is composed exactly. All variances are linear in distance, angle and time, and act halfway: along the
    motion and across it, along the vehicle's axis at half the turn, and as a heading error whose lever is half the
    way. Heading errors in truth arise all along the way: their lever is spread evenly and has the second moment 1/3,
    not 1/4. With that, a straight motion split anyhow gives the same covariance, and a curved one nearly so.

    Parameters
    ----------
    belief : before the motion.
    dx, dy, dtheta : displacement of base, in base before [m, m, rad].
    seconds : how long it took [s].
    noise : variances per metre, radian and second.

    Notes
    -----
    P = F P F^T + Q with F = [[1, 0, -my], [0, 1, mx], [0, 0, 1]] and (mx, my) the motion in the map: Sobreira et al.
    2016, equation 1 and Algorithm 1, lines 3 and 4; Q derived as said above.
    """
    x, y, theta = compose_scalars(belief.x, belief.y, belief.theta, dx, dy, dtheta)
    mx, my = x - belief.x, y - belief.y
    # F P F^T, F = [[1, 0, -my], [0, 1, mx], [0, 0, 1]].
    xt = belief.xt - my * belief.tt
    yt = belief.yt + mx * belief.tt
    xx = belief.xx - my * (belief.xt + xt)
    yy = belief.yy + mx * (belief.yt + yt)
    xy = belief.xy + mx * xt - my * belief.yt
    distance = arc_length(dx, dy, dtheta)
    turn = abs(wrap_scalar(dtheta))
    heading = noise.heading_per_m * distance + noise.heading_per_rad * turn + noise.heading_per_s * seconds
    xx += heading * my * my / 3.0
    xy -= heading * mx * my / 3.0
    yy += heading * mx * mx / 3.0
    xt -= heading * my / 2.0
    yt += heading * mx / 2.0
    square = mx * mx + my * my
    if square > 0.0:
        along = noise.forward_per_m * distance / square
        across = noise.lateral_per_m * distance / square
        xx += along * mx * mx + across * my * my
        xy += (along - across) * mx * my
        yy += along * my * my + across * mx * mx
    axis = noise.forward_per_s * seconds
    if axis > 0.0:
        halfway = belief.theta + 0.5 * wrap_scalar(dtheta)
        c, s = math.cos(halfway), math.sin(halfway)
        xx += axis * c * c
        xy += axis * c * s
        yy += axis * s * s
    return PoseGaussian(x, y, theta, xx, xy, xt, yy, yt, belief.tt + heading)


@compiled_inline
def advance(  # noqa: PLR0917 - one odometry record, number by number
    belief: PoseGaussian, motion: Motion, stamp_ns: int, dx: float, dy: float, dtheta: float, noise: OdometryNoise
) -> tuple[PoseGaussian, Motion]:
    """Take in an odometry record: the motion from the record before to its stamp.

    The first record only starts the clock. What `reach` has applied in advance, of motion and of time, is taken off.

    Parameters
    ----------
    belief, motion : before the record.
    stamp_ns : of the record [ns].
    dx, dy, dtheta : its displacement [m, m, rad].
    noise : variances per metre, radian and second.

    Notes
    -----
    predict(belief, ahead^-1 displacement): poses compose, so that `reach` and `advance` together are the record's
    motion, by definition.
    """
    if not motion.started:
        return belief, Motion(True, stamp_ns, stamp_ns, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    rest_x, rest_y, rest_theta = dx, dy, dtheta
    if motion.belief_ns != motion.odometry_ns:
        back_x, back_y, back_theta = inverse_scalars(motion.ahead_x, motion.ahead_y, motion.ahead_theta)
        rest_x, rest_y, rest_theta = compose_scalars(back_x, back_y, back_theta, dx, dy, dtheta)
    seconds = (stamp_ns - motion.belief_ns) * 1e-9
    moved = predict(belief, rest_x, rest_y, rest_theta, seconds, noise)
    period_ns = stamp_ns - motion.odometry_ns
    return moved, Motion(True, stamp_ns, stamp_ns, period_ns, dx, dy, dtheta, 0.0, 0.0, 0.0)


@compiled_inline
def reach(belief: PoseGaussian, motion: Motion, stamp_ns: int, noise: OdometryNoise) -> tuple[PoseGaussian, Motion]:
    """Extrapolate the belief to the stamp of a scan.

    The last displacement is continued at its speed, for at most as long as it took; time goes on beyond that. Nothing
    happens before the first odometry record or when the belief is about that stamp already.

    Parameters
    ----------
    belief, motion : before the scan.
    stamp_ns : of the scan [ns].
    noise : variances per metre, radian and second.

    Notes
    -----
    exp(share log(displacement)), share = time ahead / time of the displacement: motion at a constant twist (Solà et al.
    2018, equations 156 to 158).
    """
    if not motion.started or stamp_ns <= motion.belief_ns:
        return belief, motion
    until = min(stamp_ns - motion.odometry_ns, motion.period_ns)
    done = min(motion.belief_ns - motion.odometry_ns, motion.period_ns)
    step_x, step_y, step_theta = 0.0, 0.0, 0.0
    if until > done:
        share = (until - done) / motion.period_ns
        forward, left, turn = log_scalars(motion.dx, motion.dy, motion.dtheta)
        step_x, step_y, step_theta = exp_scalars(share * forward, share * left, share * turn)
    seconds = (stamp_ns - motion.belief_ns) * 1e-9
    moved = predict(belief, step_x, step_y, step_theta, seconds, noise)
    ahead_x, ahead_y, ahead_theta = compose_scalars(
        motion.ahead_x, motion.ahead_y, motion.ahead_theta, step_x, step_y, step_theta
    )
    return moved, Motion(
        True,
        motion.odometry_ns,
        stamp_ns,
        motion.period_ns,
        motion.dx,
        motion.dy,
        motion.dtheta,
        ahead_x,
        ahead_y,
        ahead_theta,
    )
