"""Wheels to motion of the base and back, for the three kinds of vehicle. No noise and no belief in here.

A twist is the motion of base per second in the base frame: [forward m/s, left m/s, turn rad/s]. The wheels of a
differential vehicle are [left, right] speeds over ground [m/s]; of a tricycle [speed of the drive wheel m/s, steering
angle rad]; of an omnidirectional vehicle the angular speed of each wheel [rad/s].
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import ArrayLike

from commission.geometry import se2
from commission.geometry.arrays import FloatArray, frozen
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle, Vehicle


def wheel_speeds(vehicle: Vehicle, twist: ArrayLike) -> FloatArray:
    """Wheels that move the base by a twist (inverse kinematics).

    Parameters
    ----------
    vehicle : any kind.
    twist : (3,) array [m/s, m/s, rad/s], base frame. What the wheels cannot do (motion to the left, on a differential
        vehicle or a tricycle) is left out.

    Returns
    -------
    wheels : (n,) array as described at the top of the module. A tricycle steers within a quarter turn and reverses
        its drive wheel rather than steer further; at rest it steers straight. Its steering limit is not applied.
    """
    forward, left, turn = frozen(twist, (3,), "twist")
    match vehicle:
        case DifferentialVehicle():
            half = 0.5 * vehicle.wheel_separation
            return np.array((forward - half * turn, forward + half * turn))
        case TricycleVehicle():
            side = vehicle.wheelbase * turn
            speed = math.hypot(forward, side)
            if forward < 0.0:
                return np.array((-speed, math.atan2(-side, -forward)))
            return np.array((speed, math.atan2(side, forward)))
        case OmnidirectionalVehicle():
            return _omnidirectional_matrix(vehicle) @ np.array((forward, left, turn))


def body_twist(vehicle: Vehicle, wheels: ArrayLike) -> FloatArray:
    """Twist of the base that the wheels cause (forward kinematics; least squares for more than three wheels).

    Parameters
    ----------
    vehicle : any kind.
    wheels : (n,) array as described at the top of the module.

    Returns
    -------
    twist : (3,) array [m/s, m/s, rad/s], base frame.

    Raises
    ------
    ValueError
        when the number of wheels is not that of the vehicle.
    """
    match vehicle:
        case DifferentialVehicle():
            left, right = frozen(wheels, (2,), "wheels")
            return np.array((0.5 * (left + right), 0.0, (right - left) / vehicle.wheel_separation))
        case TricycleVehicle():
            speed, steering = frozen(wheels, (2,), "wheels")
            return np.array((speed * math.cos(steering), 0.0, speed * math.sin(steering) / vehicle.wheelbase))
        case OmnidirectionalVehicle():
            given = frozen(wheels, (len(vehicle.wheel_angles_deg),), "wheels")
            # Dixon et al. 2010, equation 5: the pseudoinverse, by least squares rather than by inverting A^T A.
            return np.asarray(np.linalg.lstsq(_omnidirectional_matrix(vehicle), given, rcond=None)[0], dtype=np.float64)


def displacement(vehicle: Vehicle, wheels: ArrayLike, seconds: float) -> FloatArray:
    """Motion of the base while the wheels keep their speeds: pose of base afterwards in base before.

    Parameters
    ----------
    vehicle, wheels : as in `body_twist`.
    seconds : how long they keep them [s].

    Returns
    -------
    displacement : (3,) array [m, m, rad].

    Notes
    -----
    exp(twist seconds), the exact arc. The centered difference of Sobreira et al. 2016 (section 4.1: half the turn, the
    whole way, half the turn) is its approximation of second order in the turn.
    """
    return se2.exp(body_twist(vehicle, wheels) * seconds)


@functools.lru_cache(maxsize=32)
def _omnidirectional_matrix(vehicle: OmnidirectionalVehicle) -> FloatArray:
    """(n, 3) matrix from twist to wheel speeds (Dixon et al. 2010, equation 3 with theta = 0, any wheel angles).

    A wheel on the spoke alpha rolls along (-sin alpha, cos alpha). The printed equation 3 has a slip: the second
    element of its third row is cos(theta) where its own pseudoinverse (equation 5) needs -cos(theta). Its theta also
    turns against that of figure 4, which does not matter here: base frame in, base frame out.
    """
    alpha = np.radians(vehicle.wheel_angles_deg)
    rows = np.stack((-np.sin(alpha), np.cos(alpha), np.full_like(alpha, vehicle.center_distance)), axis=1)
    return frozen(rows / vehicle.wheel_radius, (None, 3), "omnidirectional matrix")
