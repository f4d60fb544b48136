"""Bags for tests, written by `rosbags`: a drive whose every number is known by hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROS1 = get_typestore(Stores.ROS1_NOETIC)
ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
ROS2 = get_typestore(Stores.ROS2_HUMBLE)
START = 1_700_000_000_000_000_000
"""Stamp of the first message [ns]."""
KINDS = (".mcap", ".db3", ".bag")
"""How the bags of each kind end; those of ROS 2 are folders that hold such a file."""

Message = tuple[str, str, int, Callable[[Any], Any]]
"""Topic, type, stamp of the recording [ns], and what makes the message from a typestore."""


def write_bag(path: Path, messages: Iterable[Message], *, packed: str = "") -> Path:
    """Write a bag of the kind that the path's ending says, packed by FILE or MESSAGE (ROS 1: BZ2 or LZ4)."""
    path.parent.mkdir(exist_ok=True)
    is_ros1 = path.suffix == ".bag"
    store = ROS1 if is_ros1 else ROS2
    if is_ros1:
        writer: Any = Writer1(path)
        if packed:
            writer.set_compression(Writer1.CompressionFormat[packed])
    else:
        path = path.with_suffix("")
        kind = StoragePlugin.MCAP if path.name.endswith("mcap") else StoragePlugin.SQLITE3
        writer = Writer2(path, version=9, storage_plugin=kind)
        if packed:
            writer.set_compression(CompressionMode[packed], CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for topic, kind, stamp, make in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            message = make(store)
            data = store.serialize_ros1(message, kind) if is_ros1 else store.serialize_cdr(message, kind)
            writer.write(connections[topic], stamp, data)
    return path


def header(store: Any, stamp: int, frame: str) -> Any:
    time = store.types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    more = {"seq": 0} if store is ROS1 else {}
    return store.types["std_msgs/msg/Header"](stamp=time, frame_id=frame, **more)


def scan(
    stamp: int,
    ranges: list[float],
    topic: str = "/scan",
    *,
    intensities: list[float] | None = None,
    frame: str = "laser",
    angles: tuple[float, float] = (-0.5, 0.25),
    time_increment: float = 0.0,
) -> Message:
    def make(store: Any) -> Any:
        return store.types["sensor_msgs/msg/LaserScan"](
            header=header(store, stamp, frame),
            angle_min=angles[0],
            angle_max=angles[0] + angles[1] * (len(ranges) - 1),
            angle_increment=angles[1],
            time_increment=time_increment,
            scan_time=0.1,
            range_min=0.1,
            range_max=30.0,
            ranges=np.array(ranges, dtype=np.float32),
            intensities=np.array(intensities or [], dtype=np.float32),
        )

    return topic, "sensor_msgs/msg/LaserScan", stamp, make


def multi_echo(stamp: int, echoes: list[list[float]], strengths: list[list[float]]) -> Message:
    def make(store: Any) -> Any:
        echo = store.types["sensor_msgs/msg/LaserEcho"]
        return store.types["sensor_msgs/msg/MultiEchoLaserScan"](
            header=header(store, stamp, "laser"),
            angle_min=0.0,
            angle_max=1.0,
            angle_increment=0.5,
            time_increment=0.0,
            scan_time=0.1,
            range_min=0.1,
            range_max=30.0,
            ranges=[echo(echoes=np.array(e, dtype=np.float32)) for e in echoes],
            intensities=[echo(echoes=np.array(e, dtype=np.float32)) for e in strengths],
        )

    return "/scan", "sensor_msgs/msg/MultiEchoLaserScan", stamp, make


def quaternion(store: Any, yaw: float, *, upside_down: bool = False) -> Any:
    """Turned by a yaw, after half a turn about x where upside down."""
    half = 0.5 * yaw
    if upside_down:
        return store.types["geometry_msgs/msg/Quaternion"](x=math.cos(half), y=math.sin(half), z=0.0, w=0.0)
    return store.types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=math.sin(half), w=math.cos(half))


def _pose(store: Any, x: float, y: float, theta: float) -> Any:
    point = store.types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
    return store.types["geometry_msgs/msg/Pose"](position=point, orientation=quaternion(store, theta))


def _twist(store: Any, vx: float, vy: float, omega: float) -> Any:
    vector = store.types["geometry_msgs/msg/Vector3"]
    return store.types["geometry_msgs/msg/Twist"](
        linear=vector(x=vx, y=vy, z=0.0), angular=vector(x=0.0, y=0.0, z=omega)
    )


def odometry(
    stamp: int,
    pose: tuple[float, float, float],
    twist: tuple[float, float, float] = (0.0, 0.0, 0.0),
    topic: str = "/odom",
) -> Message:
    def make(store: Any) -> Any:
        types = store.types
        return types["nav_msgs/msg/Odometry"](
            header=header(store, stamp, "odom"),
            child_frame_id="base_link",
            pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=_pose(store, *pose), covariance=np.zeros(36)),
            twist=types["geometry_msgs/msg/TwistWithCovariance"](twist=_twist(store, *twist), covariance=np.zeros(36)),
        )

    return topic, "nav_msgs/msg/Odometry", stamp, make


def twist_stamped(stamp: int, twist: tuple[float, float, float], topic: str = "/velocity") -> Message:
    def make(store: Any) -> Any:
        return store.types["geometry_msgs/msg/TwistStamped"](
            header=header(store, stamp, "base_link"), twist=_twist(store, *twist)
        )

    return topic, "geometry_msgs/msg/TwistStamped", stamp, make


def twist(stamp: int, velocity: tuple[float, float, float], topic: str = "/cmd_vel") -> Message:
    """It has no stamp but that of its recording."""
    return topic, "geometry_msgs/msg/Twist", stamp, lambda store: _twist(store, *velocity)


def joint_state(stamp: int, names: list[str], positions: list[float], speeds: list[float]) -> Message:
    def make(store: Any) -> Any:
        return store.types["sensor_msgs/msg/JointState"](
            header=header(store, stamp, ""),
            name=names,
            position=np.array(positions, dtype=np.float64),
            velocity=np.array(speeds, dtype=np.float64),
            effort=np.zeros(0),
        )

    return "/joint_states", "sensor_msgs/msg/JointState", stamp, make


def pose_stamped(stamp: int, pose: tuple[float, float, float], topic: str = "/truth") -> Message:
    def make(store: Any) -> Any:
        return store.types["geometry_msgs/msg/PoseStamped"](
            header=header(store, stamp, "map"), pose=_pose(store, *pose)
        )

    return topic, "geometry_msgs/msg/PoseStamped", stamp, make


def pose_with_covariance(stamp: int, pose: tuple[float, float, float], topic: str = "/truth") -> Message:
    def make(store: Any) -> Any:
        types = store.types
        return types["geometry_msgs/msg/PoseWithCovarianceStamped"](
            header=header(store, stamp, "map"),
            pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=_pose(store, *pose), covariance=np.zeros(36)),
        )

    return topic, "geometry_msgs/msg/PoseWithCovarianceStamped", stamp, make


def transform(
    stamp: int,
    parent: str,
    child: str,
    pose: tuple[float, float, float],
    *,
    upside_down: bool = False,
    pitch: float | None = None,
    topic: str = "/tf_static",
) -> Message:
    def make(store: Any) -> Any:
        types = store.types
        turned = quaternion(store, pose[2], upside_down=upside_down)
        if pitch is not None:
            half = 0.5 * pitch
            turned = types["geometry_msgs/msg/Quaternion"](x=0.0, y=math.sin(half), z=0.0, w=math.cos(half))
        moved = types["geometry_msgs/msg/Transform"](
            translation=types["geometry_msgs/msg/Vector3"](x=pose[0], y=pose[1], z=0.2),
            rotation=turned,
        )
        stamped = types["geometry_msgs/msg/TransformStamped"](
            header=header(store, stamp, parent), child_frame_id=child, transform=moved
        )
        return types["tf2_msgs/msg/TFMessage"](transforms=[stamped])

    return topic, "tf2_msgs/msg/TFMessage", stamp, make
