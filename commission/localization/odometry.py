"""Predict: the belief moves with odometry and spreads with distance, angle and time (Algorithm 1, lines 2 to 4).

Wheels are in `kinematics`; this module also keeps records of different rates together in time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.directions import direction_of, turned_by
from commission.geometry.se2 import compose_scalars, exp_scalars, inverse_scalars, log_scalars
from commission.localization.pose_gaussian import PoseGaussian
from commission.site.parameters import OdometryParameters

FIRST_WAIT_NS = 500_000_000
"""How long a scan waits for the second odometry record: before it, nothing says how often one comes."""
GAP_INTERVALS = 3
"""Odometry is missing where none came for as many of its intervals."""
TREND_NS = 100_000_000
"""Time over which the velocity of a sweep is averaged: the noise of one short interval, carried on over a sweep of
125 ms, is larger than what a vehicle accelerates in this time. On all bundled sites 50 to 200 ms are much alike, an
interval of 20 ms and 400 ms are worse."""
LEAST_GAP_NS = 200_000_000
"""No shorter pause means that odometry is missing: drivers send it in bunches."""


class OdometryNoise(NamedTuple):
    """Variances per metre, radian and second, and of what odometry has not told: from `OdometryParameters`."""

    forward_per_m: float
    lateral_per_m: float
    heading_per_m: float
    heading_per_rad: float
    forward_per_s: float
    heading_per_s: float
    forward_per_s4: float = 0.0
    """Of half the unknown acceleration: 1-sigma^2 / 4."""
    heading_per_s4: float = 0.0
    """Of half the unknown turning acceleration."""
    missing_per_s2: float = 0.0
    """Of an unknown speed that is anything up to the limit: limit^2 / 3, along each axis."""
    turning_per_s2: float = 0.0
    """Of an unknown turn rate up to its limit."""
    curved: float = 0.0
    """1 where an error of the pose is a motion of the plane: errors of the heading then add up along an arc; else 0."""


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
    usual_ns: int
    """Longest interval between odometry records of late: how long a scan waits for the one that follows it."""
    trend_x: float
    """Velocity of late, averaged over `TREND`: one interval of odometry is noisier [m/s, m/s, rad/s], in base."""
    trend_y: float
    trend_theta: float


class NextOdometry(NamedTuple):
    """The odometry record that follows a scan, where it is known already."""

    known: bool
    """Whether it is: otherwise the rest says nothing."""
    stamp_ns: int
    """Its stamp; the displacement is from the record before [m, m, rad]."""
    dx: float
    dy: float
    dtheta: float


AT_REST = Motion(False, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0, 0.0, 0.0)
NOT_YET = NextOdometry(False, 0, 0.0, 0.0, 0.0)


def odometry_noise(parameters: OdometryParameters) -> OdometryNoise:
    """Return the variances per metre, radian and second of the parameters."""
    return OdometryNoise(
        parameters.forward_per_sqrt_m**2,
        parameters.lateral_per_sqrt_m**2,
        parameters.heading_per_sqrt_m**2,
        parameters.heading_per_sqrt_rad**2,
        parameters.forward_per_sqrt_s**2,
        parameters.heading_per_sqrt_s**2,
        0.25 * parameters.acceleration**2,
        0.25 * parameters.turn_acceleration**2,
        parameters.gap_speed**2 / 3.0,
        parameters.gap_turn_rate**2 / 3.0,
    )


@compiled_inline
def waits_until(motion: Motion, stamp_ns: int) -> int:
    """Stamp [ns] up to which a scan waits for the odometry that follows it: one interval of odometry.

    Parameters
    ----------
    motion : before the scan.
    stamp_ns : of the scan [ns].

    Notes
    -----
    end = stamp + interval, by definition, with the usual interval, or `FIRST_WAIT_NS` while none is known. The scan's
    stamp itself where there is nothing to wait for: no odometry yet, or odometry of that very stamp.
    """
    if not motion.started or stamp_ns <= motion.odometry_ns:
        return stamp_ns
    return stamp_ns + (motion.usual_ns if motion.usual_ns > 0 else FIRST_WAIT_NS)


@compiled_inline
def velocity(motion: Motion, following: NextOdometry) -> tuple[float, float, float]:
    """Forward, left and turning speed at a scan [m/s, m/s, rad/s], in base; zero while no odometry says otherwise.

    Parameters
    ----------
    motion : before the scan.
    following : the odometry record after the scan, where it is known: the scan lies in its interval.

    Notes
    -----
    log(displacement) / time: the constant twist of the interval (Solà et al. 2018, equation 157).
    """
    if following.known:
        forward, left, turn = log_scalars(following.dx, following.dy, following.dtheta)
        per_second = 1e9 / (following.stamp_ns - motion.odometry_ns)
    elif motion.period_ns > 0:
        forward, left, turn = log_scalars(motion.dx, motion.dy, motion.dtheta)
        per_second = 1e9 / motion.period_ns
    else:
        return 0.0, 0.0, 0.0
    return per_second * forward, per_second * left, per_second * turn


@compiled_inline
def trend(motion: Motion, stamp_ns: int, dx: float, dy: float, dtheta: float) -> tuple[float, float, float]:
    """Velocity of late after one more record [m/s, m/s, rad/s], in base.

    Parameters
    ----------
    motion : before the record.
    stamp_ns : of the record [ns].
    dx, dy, dtheta : its displacement [m, m, rad].

    Notes
    -----
    v + w (log(displacement) / t - v), w = t / (t + TREND): exponential smoothing, derived; of its
    first value that itself.
    """
    period_ns = stamp_ns - motion.odometry_ns
    if period_ns <= 0:
        return motion.trend_x, motion.trend_y, motion.trend_theta
    forward, left, turn = log_scalars(dx, dy, dtheta)
    rate = 1e9 / period_ns
    weight = period_ns / (period_ns + TREND_NS) if motion.period_ns > 0 else 1.0
    return (
        motion.trend_x + weight * (rate * forward - motion.trend_x),
        motion.trend_y + weight * (rate * left - motion.trend_y),
        motion.trend_theta + weight * (rate * turn - motion.trend_theta),
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
    2016, equation 1 and Algorithm 1, lines 3 and 4; Q derived as said above. Right-invariant, with q the variance of
    the heading error: 1/4 E[[a, b] [a, b]^T] + 1/12 E[[b, [b, a]] a^T] and its transpose on top, where a ~ P and
    b = (0, 0, q): Barfoot and Furgale 2014, equation 56, of what counts after a long way.
    """
    facing = direction_of(belief.theta)
    mx, my = facing.cos * dx - facing.sin * dy, facing.sin * dx + facing.cos * dy
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
        c, s = turned_by(facing, 0.5 * wrap_scalar(dtheta))
        xx += axis * c * c
        xy += axis * c * s
        yy += axis * s * s
    theta = wrap_scalar(belief.theta + dtheta)
    arcs = noise.curved * heading
    xx += arcs * (belief.yy / 4.0 - belief.xx / 6.0)
    xy -= arcs * belief.xy * 5.0 / 12.0
    yy += arcs * (belief.xx / 4.0 - belief.yy / 6.0)
    return PoseGaussian(belief.x + mx, belief.y + my, theta, xx, xy, xt, yy, yt, belief.tt + heading)


@compiled_inline
def advance(  # noqa: PLR0917 - one odometry record, number by number
    belief: PoseGaussian, motion: Motion, stamp_ns: int, dx: float, dy: float, dtheta: float, noise: OdometryNoise
) -> tuple[PoseGaussian, Motion]:
    """Take in an odometry record: the motion from the record before to its stamp.

    The first record only starts the clock. What `reach` has applied in advance, of motion and of time, is taken off.
    After a gap nobody knows whether the record holds the motion since the one before it: the belief spreads by what the
    vehicle may have driven.

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
        return belief, Motion(True, stamp_ns, stamp_ns, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0, 0.0, 0.0)
    rest_x, rest_y, rest_theta = dx, dy, dtheta
    if motion.belief_ns != motion.odometry_ns:
        back_x, back_y, back_theta = inverse_scalars(motion.ahead_x, motion.ahead_y, motion.ahead_theta)
        rest_x, rest_y, rest_theta = compose_scalars(back_x, back_y, back_theta, dx, dy, dtheta)
    seconds = (stamp_ns - motion.belief_ns) * 1e-9
    moved = predict(belief, rest_x, rest_y, rest_theta, seconds, noise)
    period_ns = stamp_ns - motion.odometry_ns
    usual_ns = motion.usual_ns
    if usual_ns > 0 and period_ns > max(GAP_INTERVALS * usual_ns, LEAST_GAP_NS):
        reached_ns = motion.belief_ns - motion.odometry_ns
        moved = _spread(moved, _missed(noise, usual_ns, period_ns), _missed(noise, usual_ns, reached_ns))
    else:
        usual_ns = max(period_ns, usual_ns - usual_ns // 16)
    trend_x, trend_y, trend_theta = trend(motion, stamp_ns, dx, dy, dtheta)
    return moved, Motion(
        True,
        stamp_ns,
        stamp_ns,
        period_ns,
        dx,
        dy,
        dtheta,
        0.0,
        0.0,
        0.0,
        usual_ns,
        trend_x,
        trend_y,
        trend_theta,
    )


class Unmeasured(NamedTuple):
    """Variances of a motion that odometry has not told: along the vehicle's axis, along both axes, of the heading."""

    along: float
    each: float
    heading: float


@compiled_inline
def _missed(noise: OdometryNoise, usual_ns: int, passed_ns: int) -> Unmeasured:
    """Return what a vehicle may have driven since its last odometry, beyond the interval in which one is due.

    Parameters
    ----------
    noise : variances of unknown speeds.
    usual_ns : that interval [ns].
    passed_ns : time since the last odometry [ns].

    Notes
    -----
    (limit t)^2 / 3, the variance of a speed between -limit and limit, driven for t; derived.
    """
    seconds = max(passed_ns - usual_ns, 0) * 1e-9
    return Unmeasured(0.0, noise.missing_per_s2 * seconds * seconds, noise.turning_per_s2 * seconds * seconds)


@compiled_inline
def _unmeasured(noise: OdometryNoise, usual_ns: int, passed_ns: int) -> Unmeasured:
    """Return what may have happened since the last odometry to a vehicle that is taken to go on as it did.

    Parameters
    ----------
    noise : variances of unknown accelerations and speeds.
    usual_ns : interval in which odometry is due [ns].
    passed_ns : time since the last odometry [ns].

    Notes
    -----
    (a t^2 / 2)^2 up to the interval, then `_missed`; derived.
    """
    seconds = min(passed_ns, usual_ns) * 1e-9
    t4 = seconds * seconds * seconds * seconds
    missed = _missed(noise, usual_ns, passed_ns)
    return Unmeasured(noise.forward_per_s4 * t4, missed.each, noise.heading_per_s4 * t4 + missed.heading)


@compiled_inline
def _spread(belief: PoseGaussian, now: Unmeasured, before: Unmeasured) -> PoseGaussian:
    """Add to a belief what has been added to an unmeasured motion.

    Parameters
    ----------
    belief : of the pose.
    now, before : of the unmeasured motion; `before` is in the belief already.

    Notes
    -----
    P + R(theta) diag(along + each, each) R(theta)^T and the heading's, by definition.
    """
    c, s = math.cos(belief.theta), math.sin(belief.theta)
    along, each = max(now.along - before.along, 0.0), max(now.each - before.each, 0.0)
    return PoseGaussian(
        belief.x,
        belief.y,
        belief.theta,
        belief.xx + along * c * c + each,
        belief.xy + along * c * s,
        belief.xt,
        belief.yy + along * s * s + each,
        belief.yt,
        belief.tt + max(now.heading - before.heading, 0.0),
    )


@compiled_inline
def reach(
    belief: PoseGaussian, motion: Motion, stamp_ns: int, following: NextOdometry, noise: OdometryNoise
) -> tuple[PoseGaussian, Motion]:
    """Move the belief to the stamp of a scan, between two odometry records or beyond the last one.

    Where the record that follows is known, its motion is interpolated. Otherwise the last displacement is continued at
    its speed, for at most as long as it took, and the belief spreads by the acceleration that the vehicle may have had,
    then by the speed; time goes on. Nothing happens before the first odometry record or when the belief is about that
    stamp already.

    Parameters
    ----------
    belief, motion : before the scan.
    stamp_ns : of the scan [ns].
    following : the odometry record at or after the scan.
    noise : variances per metre, radian and second.

    Notes
    -----
    exp(share log(displacement)), share = time ahead / time of the displacement: motion at a constant twist (Solà et al.
    2018, equations 156 to 158).
    """
    if not motion.started or stamp_ns <= motion.belief_ns:
        return belief, motion
    seconds = (stamp_ns - motion.belief_ns) * 1e-9
    passed_ns, reached_ns = stamp_ns - motion.odometry_ns, motion.belief_ns - motion.odometry_ns
    ahead_x, ahead_y, ahead_theta = motion.ahead_x, motion.ahead_y, motion.ahead_theta
    if following.known:
        share = passed_ns / (following.stamp_ns - motion.odometry_ns)
        forward, left, turn = log_scalars(following.dx, following.dy, following.dtheta)
        x, y, theta = exp_scalars(share * forward, share * left, share * turn)
        back_x, back_y, back_theta = inverse_scalars(ahead_x, ahead_y, ahead_theta)
        step_x, step_y, step_theta = compose_scalars(back_x, back_y, back_theta, x, y, theta)
        moved = predict(belief, step_x, step_y, step_theta, seconds, noise)
        ahead_x, ahead_y, ahead_theta = x, y, theta
    else:
        until, done = min(passed_ns, motion.period_ns), min(reached_ns, motion.period_ns)
        step_x, step_y, step_theta = 0.0, 0.0, 0.0
        if until > done:
            share = (until - done) / motion.period_ns
            forward, left, turn = log_scalars(motion.dx, motion.dy, motion.dtheta)
            step_x, step_y, step_theta = exp_scalars(share * forward, share * left, share * turn)
        moved = predict(belief, step_x, step_y, step_theta, seconds, noise)
        usual_ns = motion.usual_ns if motion.usual_ns > 0 else FIRST_WAIT_NS
        now, before = _unmeasured(noise, usual_ns, passed_ns), _unmeasured(noise, usual_ns, reached_ns)
        moved = _spread(moved, now, before)
        ahead_x, ahead_y, ahead_theta = compose_scalars(ahead_x, ahead_y, ahead_theta, step_x, step_y, step_theta)
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
        motion.usual_ns,
        motion.trend_x,
        motion.trend_y,
        motion.trend_theta,
    )
