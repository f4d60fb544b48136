"""Correct with the right-invariant error: the vehicle is wrong by one rigid motion of the map, turned about any point.

After a long way by odometry alone, place and heading are wrong together: the error is an arc, which is a straight line
in the motions of the plane and none in x, y and heading. Predicting needs nothing of its own: F of *predict* is just
what an error of this kind is carried along with. Prepared for a belief about its own mean, as everything else here.
"""

from __future__ import annotations

from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.geometry.directions import UnitVector, composed, turned_by
from commission.geometry.se2 import exp_scalars
from commission.localization.consider import Considering, innovation_with, seen_with
from commission.localization.consider_correction import covariance_with
from commission.localization.kalman import Corrected, Gain, Innovation, corrected_covariance, gain, innovation
from commission.localization.observation import SMALLEST_RANGE, Expected, ObservationModel, offset_facing
from commission.localization.pose_gaussian import PoseGaussian

MOST_ROUNDS = 8
"""Linearizations of one correction at most; nearly all need one."""
SMALL_TURN = 2e-3
"""A correction that turns by less needs no other linearization [rad]: 2e-6 of the way to what it turns about."""


class Landing(NamedTuple):
    """Where a detection lies by a belief, against where it should: residual along the ray and across it."""

    expected: Expected
    """Its Jacobian; the measured range less its range is the residual along the ray [m]."""
    turn: float
    """Residual across the ray over the measured range [rad]."""


@compiled_inline
def landing(  # noqa: PLR0917 - a measurement and a reflector, number by number
    from_x: float,
    from_y: float,
    ray: UnitVector,
    measured_range: float,
    x: float,
    y: float,
    pivot_x: float,
    pivot_y: float,
    between: float,
) -> Landing:
    """Compare where a detection lies with the place of a reflector.

    Parameters
    ----------
    from_x, from_y : place of the scanner [m], map frame.
    ray : bearing of the detection, as a direction of the map.
    measured_range : range bias already taken off [m].
    x, y : the reflector's center [m], map frame.
    pivot_x, pivot_y : what an error of the heading turns about: mean of the belief whose covariance is used [m].
    between : where the lever of the heading ends: 0 at the reflector, 0.5 halfway to the detection.

    Notes
    -----
    v = X z - l = -(xi_xy + xi_theta J (l - pivot)): Barrau and Bonnabel 2017, equations 26 to 28, right-invariant
    observations. Its axes are the ray and its normal over the range, in which R is that of equation 2 of Sobreira et
    al. 2016. The Jacobian depends on no estimate but through its axes: what one reflector leaves unknown, a turn about
    it, stays unknown however often it is seen.
    """
    ax, ay = ray.cos, ray.sin
    off_x, off_y = from_x + measured_range * ax - x, from_y + measured_range * ay - y
    per_range = 1.0 / max(measured_range, SMALLEST_RANGE)
    lever_x, lever_y = x + between * off_x - pivot_x, y + between * off_y - pivot_y
    along = off_x * ax + off_y * ay
    return Landing(
        Expected(
            measured_range - along,
            0.0,
            -ax,
            -ay,
            ax * lever_y - ay * lever_x,
            ay * per_range,
            -ax * per_range,
            -(ax * lever_x + ay * lever_y) * per_range,
        ),
        (off_y * ax - off_x * ay) * per_range,
    )


@compiled_inline
def landing_innovation(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    facing: UnitVector,
    offset_x: float,
    offset_y: float,
    measured_range: float,
    ray: UnitVector,
    x: float,
    y: float,
    surveyed_variance: float,
    model: ObservationModel,
    given: Considering | None,
    at: int,
) -> Innovation:
    """Innovation of a detection against one reflector, for gates: the residual may be large.

    Parameters
    ----------
    belief, facing : before the correction, and the direction of its heading.
    offset_x, offset_y : see `scanner_offset` [m].
    measured_range : range bias already taken off [m].
    ray : bearing of the detection, as a direction of the map.
    x, y, surveyed_variance : the reflector's center [m], map frame, and variance of its place, each axis [m^2].
    model : of the observation.
    given, at : as in `seen_with`, or None.

    Notes
    -----
    v + H xi = O(xi_theta^3), derived: `landing` with the lever halfway, since the chord of a turn is at right angles
    to the line from the center to its middle.
    """
    seen = landing(belief.x + offset_x, belief.y + offset_y, ray, measured_range, x, y, belief.x, belief.y, 0.5)
    e = seen.expected
    if given is None:
        return innovation(belief, e, measured_range, seen.turn, surveyed_variance, model)
    constants = seen_with(facing, e, surveyed_variance, given, at)
    return innovation_with(belief, e, measured_range, seen.turn, model, constants)


class Shift(NamedTuple):
    """A correction as a motion about the mean of a belief: a twist, and where it leads."""

    along_x: float
    along_y: float
    turn: float
    x: float
    """Way of the mean [m], map axes."""
    y: float


@compiled_inline
def shift_of(k: Gain, along: float, across: float) -> Shift:
    """Motion that a residual corrects by.

    Parameters
    ----------
    k : gain.
    along, across : residual [m], [rad].

    Notes
    -----
    exp(K v): Barrau and Bonnabel 2017, equation 14; `exp_scalars`.
    """
    u, v, turn = k.xr * along + k.xb * across, k.yr * along + k.yb * across, k.tr * along + k.tb * across
    x, y, _ = exp_scalars(u, v, turn)
    return Shift(u, v, turn, x, y)


@compiled_inline
def relinearized(e: Expected, seen: Landing, measured_range: float, shift: Shift) -> tuple[float, float]:
    """Residual of the belief itself by a linearization where the last round has led.

    Parameters
    ----------
    e : Jacobian there.
    seen : residual there.
    measured_range : range bias already taken off [m].
    shift : from the belief to there.

    Notes
    -----
    r = v + H xi: the Gauss-Newton step of an iterated filter: Goffin, Bonnabel, Brüls and Sacré 2024; Jazwinski 1970,
    section 8.3.
    """
    along = e.range_x * shift.along_x + e.range_y * shift.along_y + e.range_theta * shift.turn
    across = e.bearing_x * shift.along_x + e.bearing_y * shift.along_y + e.bearing_theta * shift.turn
    return measured_range - e.range + along, seen.turn + across


@compiled_inline
def correct_invariant(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    aim: UnitVector,
    reflector_x: float,
    reflector_y: float,
    surveyed_variance: float,
    model: ObservationModel,
    given: Considering | None,
    width: int,
    at: int,
) -> Corrected:
    """Correct a belief, and its covariance with constants where they are considered, by one detection.

    Parameters
    ----------
    belief, facing : before the correction, and the direction of its heading.
    measured_range : range bias already taken off [m].
    aim : measured bearing as a direction, in base.
    reflector_x, reflector_y, surveyed_variance : the reflector's center [m], and variance of its place [m^2].
    model : of the observation.
    given, width, at : as in `correct_aimed_with`, or None.

    Notes
    -----
    X = exp(K v) X, P as in `corrected_covariance`, then F P F^T with F of the way of the mean, since P is about it:
    Barrau and Bonnabel 2017, section III; linearized anew while that turns the belief, as in `relinearized`.
    """
    turned, shift, rounds = facing, Shift(0.0, 0.0, 0.0, 0.0, 0.0), 0
    while True:
        offset_x, offset_y = offset_facing(turned, model)
        from_x, from_y = belief.x + shift.x + offset_x, belief.y + shift.y + offset_y
        ray = composed(turned, aim)
        seen = landing(from_x, from_y, ray, measured_range, reflector_x, reflector_y, belief.x, belief.y, 0.0)
        e = seen.expected
        if given is None:
            v = innovation(belief, e, measured_range, seen.turn, surveyed_variance, model)
        else:
            d = seen_with(turned, e, surveyed_variance, given, at)
            v = innovation_with(belief, e, measured_range, seen.turn, model, d)
        k = gain(v)
        along, across = relinearized(e, seen, measured_range, shift)
        before, shift = shift.turn, shift_of(k, along, across)
        rounds += 1
        if abs(shift.turn - before) < SMALL_TURN or rounds == MOST_ROUNDS:
            break
        turned = turned_by(facing, shift.turn)
    if given is None:
        xx, xy, xt, yy, yt, tt = corrected_covariance(belief, e, k, v.range_noise, v.bearing_noise)
    else:
        d = seen_with(turned, e, surveyed_variance, given, at)
        xx, xy, xt, yy, yt, tt = covariance_with(belief, e, k, v, d, 0.0, surveyed_variance, given, width, at)
        carry_along(given.room.work, width, shift.x, shift.y)
    about = about_elsewhere(PoseGaussian(belief.x, belief.y, belief.theta, xx, xy, xt, yy, yt, tt), shift.x, shift.y)
    x, y, theta = about.x + shift.x, about.y + shift.y, wrap_scalar(belief.theta + shift.turn)
    after = PoseGaussian(x, y, theta, about.xx, about.xy, about.xt, about.yy, about.yt, about.tt)
    return Corrected(after, turned_by(facing, shift.turn))


@compiled_inline
def about_elsewhere(p: PoseGaussian, x: float, y: float) -> PoseGaussian:
    """Covariance of the same error seen from a place that lies elsewhere; the mean stays.

    Parameters
    ----------
    p : its covariance is about its mean.
    x, y : from there to the other place [m], map axes.

    Notes
    -----
    F P F^T with F = [[1, 0, -y], [0, 1, x], [0, 0, 1]]: the adjoint of a translation (Solà et al. 2018, equation 159).
    """
    xt, yt = p.xt - y * p.tt, p.yt + x * p.tt
    return PoseGaussian(
        p.x,
        p.y,
        p.theta,
        p.xx - y * (p.xt + xt),
        p.xy + x * xt - y * p.yt,
        xt,
        p.yy + x * (p.yt + yt),
        yt,
        p.tt,
    )


@compiled_inline
def carry_along(work: FloatArray, width: int, x: float, y: float) -> None:
    """Do what `about_elsewhere` does to a covariance with constants.

    Parameters
    ----------
    work : (3, width) or wider, written in place.
    width : columns that are in use.
    x, y : as there [m].

    Notes
    -----
    C = F C: Schmidt 1966.
    """
    for j in range(width):
        work[0, j] -= y * work[2, j]
        work[1, j] += x * work[2, j]
