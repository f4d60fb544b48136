"""What a recording holds, as messages of ROS 2 that Foxglove, rviz and `ros2 bag` know; the way back is `ros_messages`.

Messages of ROS round: a LaserScan has its angles in 32 bits and no flag of a reflector, an Odometry has poses. Beside
each stands one of our own types, which holds what was recorded to the last bit; programs that do not know it pass over.
"""

from __future__ import annotations

import json
import math

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.io.recordings.cdr import CdrWriter
from commission.localization.estimate import Estimate
from commission.site.records import Detections, Odometry, ReferencePose, Reflex, Scan, TagSightings

MAP, ODOM, BASE_LINK = "map", "odom", "base_link"
"""Names of frames (REP 105)."""
LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
POSE = "geometry_msgs/msg/PoseStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
POINTS = "sensor_msgs/msg/PointCloud2"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
TEXT = "std_msgs/msg/String"
BEAMS = "commission_msgs/msg/Beams"
DISPLACEMENT = "commission_msgs/msg/Displacement"
DETECTED = "commission_msgs/msg/Detections"
REFERENCE = "commission_msgs/msg/ReferencePose"
TAGS = "commission_msgs/msg/Tags"
REFLEX = "commission_msgs/msg/Reflex"
OWN_FIELDS = {
    BEAMS: "float64 angle_min\nfloat64 angle_increment\nbool[] reflector\n",
    DISPLACEMENT: "float64 dx\nfloat64 dy\nfloat64 dtheta\n",
    DETECTED: "float64[] range\nfloat64[] bearing\n",
    TAGS: "float64[] values\nstring ids\n",
    REFLEX: "float64[] bearing\nstring reflector\n",
    REFERENCE: "float64 x\nfloat64 y\nfloat64 theta\n",
}
"""Our own types behind their header, in the language of ROS 2 messages [m, rad]."""
_FARTHEST = 200.0
"""Range that a scan states when nothing in it is farther [m]: viewers leave out what lies beyond."""
_POINT_FIELDS = (("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("d2", 12, 7), ("status", 16, 2))
"""Fields of a point, where they begin, and the number of their type: 7 is float32, 2 is uint8."""
_POINT = np.dtype([(name, "<f4" if kind == 7 else "u1") for name, _, kind in _POINT_FIELDS])
_NO_COVARIANCE = np.zeros(36)


def definition_of(kind: str) -> str:
    """Return what a type is, with all types in it, in the language of ROS 2 messages."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    if kind in OWN_FIELDS:
        store.register(get_types_from_msg(f"std_msgs/Header header\n{OWN_FIELDS[kind]}", kind))
    return store.generate_msgdef(kind, ros_version=2)[0]


def laser_scan(scan: Scan, frame: str) -> bytes:
    """Return a scan as a LaserScan in the frame of its scanner."""
    known = scan.ranges[np.isfinite(scan.ranges)]
    # More than the farthest one, which readers take for no return.
    farthest = 1.001 * float(known.max()) if len(known) else 0.0
    last = scan.angle_min + scan.angle_increment * (len(scan.ranges) - 1)
    angles = scan.angle_min, last, scan.angle_increment
    strengths = np.empty(0, np.float32) if scan.intensities is None else scan.intensities
    return (
        CdrWriter()
        .header(scan.stamp_ns, frame)
        .numbers("fffffff", *angles, 0.0, 0.0, 0.0, max(_FARTHEST, farthest))
        .array(np.asarray(scan.ranges, dtype=np.float32))
        .array(np.asarray(strengths, dtype=np.float32))
        .message()
    )


def beams(scan: Scan, frame: str) -> bytes:
    """Return what a LaserScan cannot hold of a scan: angles with all their digits, and flags of reflectors."""
    flags = np.empty(0, np.bool_) if scan.reflector is None else np.asarray(scan.reflector, dtype=np.bool_)
    writer = CdrWriter().header(scan.stamp_ns, frame)
    return writer.numbers("dd", scan.angle_min, scan.angle_increment).array(flags.view(np.uint8)).message()


def odometry(stamp_ns: int, pose: FloatArray, velocity: FloatArray) -> bytes:
    """Return an Odometry.

    Parameters
    ----------
    stamp_ns : time [ns].
    pose : (3,) of base in a frame that begins where it began [m, m, rad].
    velocity : (3,) ahead, to the left [m/s] and turning [rad/s], base frame.
    """
    writer = CdrWriter().header(stamp_ns, ODOM).text(BASE_LINK)
    _pose(writer, pose).doubles(_NO_COVARIANCE)
    return (
        writer.numbers("dddddd", velocity[0], velocity[1], 0.0, 0.0, 0.0, velocity[2]).doubles(_NO_COVARIANCE).message()
    )


def displacement(record: Odometry) -> bytes:
    """Return the motion since the row before, to the last bit."""
    return CdrWriter().header(record.stamp_ns, BASE_LINK).doubles(record.displacement).message()


def pose_stamped(record: ReferencePose) -> bytes:
    """Return a reference as a PoseStamped; an unknown heading is a quaternion of zeros."""
    return _pose(CdrWriter().header(record.stamp_ns, MAP), record.pose).message()


def reference(record: ReferencePose) -> bytes:
    """Return a reference to the last bit."""
    return CdrWriter().header(record.stamp_ns, MAP).doubles(record.pose).message()


def detections(record: Detections, frame: str) -> bytes:
    """Return what a sensor detected itself, in the frame of the scanner."""
    ranges, bearings = record.range_bearing.T
    return CdrWriter().header(record.stamp_ns, frame).array(ranges).array(bearings).message()


def tags(record: TagSightings) -> bytes:
    """Return what a camera saw of tags: six numbers of each, and their ids as a list of JSON."""
    writer = CdrWriter().header(record.stamp_ns, "camera").array(record.sightings.ravel())
    return writer.text(json.dumps(record.ids)).message()


def reflex(record: Reflex) -> bytes:
    """Return what a goniometer met: its bearing, none where a turn met nothing, and the reflector where it is known."""
    bearings = np.array([] if math.isnan(record.bearing) else [record.bearing])
    return CdrWriter().header(record.stamp_ns, "goniometer").array(bearings).text(record.reflector).message()


def estimated_pose(estimate: Estimate) -> bytes:
    """Return the filter's pose and covariance as a PoseWithCovarianceStamped."""
    belief = estimate.posterior
    covariance = np.zeros((6, 6))
    # Rows are x, y, z and the turns about them: ours are the first two and the last.
    covariance[np.ix_((0, 1, 5), (0, 1, 5))] = belief.covariance
    return _pose(CdrWriter().header(estimate.stamp_ns, MAP), belief.mean).doubles(covariance.ravel()).message()


def transform(stamp_ns: int, frames: tuple[str, str], pose: FloatArray, *, upside_down: bool = False) -> bytes:
    """Return a TFMessage of one transform.

    Parameters
    ----------
    stamp_ns : time [ns].
    frames : parent and child.
    pose : (3,) of the child in its parent [m, m, rad].
    upside_down : whether the child is turned by half a turn about its x axis.
    """
    writer = CdrWriter().numbers("I", 1).header(stamp_ns, frames[0]).text(frames[1])
    writer.numbers("ddd", pose[0], pose[1], 0.0)
    half = 0.5 * float(pose[2])
    turned = (math.cos(half), math.sin(half), 0.0, 0.0) if upside_down else (0.0, 0.0, math.sin(half), math.cos(half))
    return writer.numbers("dddd", *turned).message()


def detected_points(estimate: Estimate) -> bytes:
    """Return the detections of a scan as a PointCloud2 in the map: status 0 inlier, 1 and 2 outlier, and NIS."""
    points = np.zeros(len(estimate.status), _POINT)
    points["x"], points["y"] = estimate.points_map.reshape(-1, 2).T
    points["status"], points["d2"] = estimate.status, estimate.d2
    writer = CdrWriter().header(estimate.stamp_ns, MAP).numbers("II", 1, len(points))
    writer.numbers("I", len(_POINT_FIELDS))
    for name, offset, kind in _POINT_FIELDS:
        writer.text(name).numbers("I", offset).numbers("B", kind).numbers("I", 1)
    writer.numbers("B", 0).numbers("II", _POINT.itemsize, _POINT.itemsize * len(points))
    return writer.array(np.frombuffer(points.tobytes(), np.uint8)).numbers("B", 1).message()


def text(words: str) -> bytes:
    """Return a String."""
    return CdrWriter().text(words).message()


def _pose(writer: CdrWriter, pose: FloatArray) -> CdrWriter:
    """Append a pose in the plane [m, m, rad]."""
    x, y, theta = map(float, pose)
    turned = (0.0, 0.0, 0.0, 0.0) if math.isnan(theta) else (0.0, 0.0, math.sin(0.5 * theta), math.cos(0.5 * theta))
    return writer.numbers("ddd", x, y, 0.0).numbers("dddd", *turned)
