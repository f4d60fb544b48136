"""Messages of ROS 1 and 2, as they are decoded, turned into what a recording holds. No file, no topic.

Frames and units are REP 103's: metres, radians, seconds, x ahead, y to the left.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray
from commission.io.recordings.channels import Role, Topic
from commission.io.recordings.collector import MotionKind
from commission.io.recordings.motion import Wheels
from commission.site.quantity import STAMP_LIMIT
from commission.site.records import Scan

SCAN_TYPES = ("sensor_msgs/msg/LaserScan", "sensor_msgs/msg/MultiEchoLaserScan")
TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
TWIST = "geometry_msgs/msg/Twist"
ODOM_FRAME = "odom"
"""Frame in which odometry counts (REP 105), whatever stands before it: `robot1/odom`."""
_FAR_AWAY = 4
"""Rank of what is read when it is named only: commands and goals are not what was measured."""
_ODOMETRY_RANKS = {
    "nav_msgs/msg/Odometry": 1,
    "geometry_msgs/msg/TwistWithCovarianceStamped": 2,
    "geometry_msgs/msg/TwistStamped": 2,
    "sensor_msgs/msg/JointState": 3,
    # It has no stamp, and is a command nearly always.
    TWIST: _FAR_AWAY,
    **dict.fromkeys(TF_TYPES, _FAR_AWAY),
}
_REFERENCE_RANKS = {"geometry_msgs/msg/PoseWithCovarianceStamped": 1, "geometry_msgs/msg/PoseStamped": 1}
MOTION_KINDS = {
    "nav_msgs/msg/Odometry": MotionKind.POSES_AND_VELOCITIES,
    "geometry_msgs/msg/TwistWithCovarianceStamped": MotionKind.VELOCITIES,
    "geometry_msgs/msg/TwistStamped": MotionKind.VELOCITIES,
    "sensor_msgs/msg/JointState": MotionKind.WHEEL_ANGLES,
    TWIST: MotionKind.VELOCITIES,
    **dict.fromkeys(TF_TYPES, MotionKind.POSES),
}
_NOT_MEASURED = ("cmd", "command", "goal", "initialpose", "initial_pose", "desired", "target")


def is_measured(topic: str) -> bool:
    """Whether the name of a topic is none of commands and goals."""
    return not any(word in topic.lower() for word in _NOT_MEASURED)


def topic_of(name: str, kind: str, count: int | None) -> tuple[Topic, ...]:
    """What a topic can be to a recording: nothing, one role, or two.

    Parameters
    ----------
    name, kind : of the topic and its type.
    count : messages; None where that is not known.
    """
    far = not is_measured(name)
    if kind in SCAN_TYPES:
        return (Topic(name=name, type=kind, role=Role.SCAN, count=count),)
    found: list[Topic] = []
    if kind in _ODOMETRY_RANKS:
        rank = _FAR_AWAY if far else _ODOMETRY_RANKS[kind]
        found.append(Topic(name=name, type=kind, role=Role.ODOMETRY, rank=rank, count=count))
    if kind in _REFERENCE_RANKS:
        rank = _FAR_AWAY if far else _REFERENCE_RANKS[kind]
        found.append(Topic(name=name, type=kind, role=Role.REFERENCE, rank=rank, count=count))
    elif kind == "nav_msgs/msg/Odometry":
        # A second system often reports its pose so; it is taken for one when it is named.
        found.append(Topic(name=name, type=kind, role=Role.REFERENCE, rank=_FAR_AWAY, count=count))
    return tuple(found)


def is_taken_unasked(topic: Topic) -> bool:
    """Whether a topic is a candidate without being named."""
    return topic.rank < _FAR_AWAY


def has_zero_stamp(message: Any) -> bool:
    """Whether a message has a header whose stamp is 0: none, or the begin of a simulation."""
    header = getattr(message, "header", None)
    return header is not None and not header.stamp.sec and not header.stamp.nanosec


def stamp_of(header: Any, log_time_ns: int) -> tuple[int, bool]:
    """Stamp of a message [ns], and whether it is its own: where it has no header or no stamp, that of the recording."""
    if header is None:
        return log_time_ns, False
    stamp = int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)
    return (stamp, True) if 0 < stamp < STAMP_LIMIT else (log_time_ns, False)


def scan_of(message: Any, kind: str, stamp_ns: int, scanner: int) -> Scan | None:
    """Return the scan of a message; None where it has no beam, or steps from beam to beam that are none.

    Parameters
    ----------
    message, kind : decoded, and the name of its type. Of several echoes of a beam the strongest counts, of equal
        ones the first.
    stamp_ns : of the scan [ns].
    scanner : index into the names.
    """
    angles = float(message.angle_min), float(message.angle_increment)
    if not all(map(math.isfinite, angles)) or angles[1] == 0.0:
        return None
    ranges, strengths = _echoes(message) if kind == SCAN_TYPES[1] else (message.ranges, message.intensities)
    ranges = np.array(ranges, dtype=np.float32)
    if not len(ranges):
        return None
    nearest, farthest = float(message.range_min), float(message.range_max)
    # REP 117: what is not within the limits is no measurement; a driver that states no limits has 0. The farthest range
    # itself, to the last bit, is what simulators and some drivers say where nothing came back.
    with np.errstate(invalid="ignore"):
        outside = ~np.isfinite(ranges) | (ranges <= 0.0) | (ranges < np.float32(nearest))
        if farthest > nearest:
            outside |= ranges >= np.float32(farthest)
    ranges[outside] = np.nan
    intensities = np.array(strengths, dtype=np.float32) if len(strengths) == len(ranges) else None
    if intensities is not None and not np.isfinite(intensities).any():
        # A driver whose scanner sends none fills in NaN: that is no strength of 0.
        intensities = None
    if intensities is not None:
        intensities[~np.isfinite(intensities)] = 0.0
    return Scan(
        stamp_ns=stamp_ns,
        ranges=ranges,
        angle_min=angles[0],
        angle_increment=angles[1],
        intensities=intensities,
        scanner=scanner,
    )


def typical_range(message: Any, kind: str) -> float:
    """Median of the ranges as they are sent, whatever the limits [m]; NaN where there is none.

    Parameters
    ----------
    message, kind : decoded, and the name of its type.
    """
    ranges = np.asarray(_echoes(message)[0] if kind == SCAN_TYPES[1] else message.ranges, dtype=np.float64)
    ranges = ranges[np.isfinite(ranges) & (ranges > 0.0)]
    return float(np.median(ranges)) if len(ranges) else math.nan


def _echoes(message: Any) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(B,) range [m] and strength of the strongest echo of each beam."""
    ranges = np.full(len(message.ranges), np.nan, dtype=np.float32)
    with_strengths = len(message.intensities) == len(message.ranges)
    strengths = np.zeros(len(message.ranges) if with_strengths else 0, dtype=np.float32)
    for beam, echoes in enumerate(message.ranges):
        found = np.asarray(echoes.echoes, dtype=np.float32)
        if not len(found):
            continue
        best = 0
        if with_strengths:
            strong = np.asarray(message.intensities[beam].echoes, dtype=np.float32)
            if len(strong) == len(found):
                best = int(np.argmax(strong))
                strengths[beam] = strong[best]
        ranges[beam] = found[best]
    return ranges, strengths


def yaw_of(q: Any) -> float:
    """Heading of a quaternion [rad]; NaN where it is none (all zeros: the sender knows no heading)."""
    norm = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z
    if not 0.25 < norm < 4.0:
        return math.nan
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), norm - 2.0 * (q.y * q.y + q.z * q.z))


def pose_of(message: Any) -> tuple[float, float, float]:
    """Position x, y [m] and heading [rad] of a PoseStamped, a PoseWithCovarianceStamped or an Odometry."""
    pose = message.pose if hasattr(message.pose, "position") else message.pose.pose
    return float(pose.position.x), float(pose.position.y), yaw_of(pose.orientation)


def motion_of(message: Any, kind: str, wheels: Wheels | None, *, has_angles: bool = True) -> tuple[float, ...] | None:
    """Row of odometry of the kind that `MOTION_KINDS` says; None where the message has none of it.

    Parameters
    ----------
    message, kind : decoded, and the name of its type.
    wheels : names of the joints that turn, where it is a JointState.
    has_angles : whether their angles count, or their speeds: one of both in all messages.
    """
    if kind == "nav_msgs/msg/Odometry":
        twist = message.twist.twist
        x, y, theta = pose_of(message)
        # A driver that fills in velocities only leaves the orientation at zero.
        return x, y, 0.0 if math.isnan(theta) else theta, twist.linear.x, twist.linear.y, twist.angular.z
    if kind == "sensor_msgs/msg/JointState":
        return (
            None
            if wheels is None
            else _of_wheels(message, message.position if has_angles else message.velocity, wheels)
        )
    if kind == TWIST:
        twist = message
    else:
        twist = message.twist if hasattr(message.twist, "linear") else message.twist.twist
    return twist.linear.x, twist.linear.y, twist.angular.z


def base_frame(message: Any, kind: str) -> str:
    """Return the frame of the vehicle whose motion a message tells; empty where it does not say.

    Parameters
    ----------
    message, kind : decoded, and the name of its type.
    """
    if kind in ("geometry_msgs/msg/TwistStamped", "geometry_msgs/msg/TwistWithCovarianceStamped"):
        return str(message.header.frame_id)
    return str(getattr(message, "child_frame_id", ""))


def is_odometry(stamped: Any) -> bool:
    """Whether a TransformStamped says where odometry has the vehicle."""
    return str(stamped.header.frame_id).rpartition("/")[2] == ODOM_FRAME


def planar_pose_of(transform: Any) -> tuple[float, float, float]:
    """Position x, y [m] and heading [rad] of the child of a transform in its parent."""
    theta = yaw_of(transform.rotation)
    return float(transform.translation.x), float(transform.translation.y), 0.0 if math.isnan(theta) else theta


def sweep_of(message: Any) -> float:
    """Time from the first to the last beam of a scan as it says it [s]; negative where the scanner turns clockwise."""
    passed = float(message.time_increment) * (len(message.ranges) - 1)
    return math.copysign(1.0, float(message.angle_increment)) * passed if math.isfinite(passed) else 0.0


def has_wheel_angles(message: Any, wheels: Wheels) -> bool | None:
    """Whether a JointState says how far the wheels turned, and not how fast only; None where it says neither."""
    if _of_wheels(message, message.position, wheels) is not None:
        return True
    return None if _of_wheels(message, message.velocity, wheels) is None else False


def _of_wheels(message: Any, values: Any, wheels: Wheels) -> tuple[float, float] | None:
    """Numbers of the left and the right wheel; None where one of them is not there."""
    names = list(message.name)
    if wheels.left not in names or wheels.right not in names:
        return None
    left, right = names.index(wheels.left), names.index(wheels.right)
    if len(values) <= max(left, right):
        return None
    found = float(values[left]), float(values[right])
    return found if all(map(math.isfinite, found)) else None


def transform_of(transform: Any) -> FloatArray:
    """(4, 4) homogeneous matrix of a transform: the pose of the child in its parent [m]."""
    q, t = transform.rotation, transform.translation
    T_parent_child = np.eye(4)
    norm = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z
    s = 2.0 / norm if norm > 0.0 else 0.0
    T_parent_child[:3, :3] = [
        [1.0 - s * (q.y * q.y + q.z * q.z), s * (q.x * q.y - q.z * q.w), s * (q.x * q.z + q.y * q.w)],
        [s * (q.x * q.y + q.z * q.w), 1.0 - s * (q.x * q.x + q.z * q.z), s * (q.y * q.z - q.x * q.w)],
        [s * (q.x * q.z - q.y * q.w), s * (q.y * q.z + q.x * q.w), 1.0 - s * (q.x * q.x + q.y * q.y)],
    ]
    T_parent_child[:3, 3] = t.x, t.y, t.z
    return T_parent_child
