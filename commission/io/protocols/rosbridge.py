"""rosbridge v2: what a ROS 1 or ROS 2 vehicle publishes, as JSON or CBOR messages. It opens no connection.

Protocol: github.com/RobotWebTools/rosbridge_suite, ROSBRIDGE_PROTOCOL.md; typed arrays in CBOR: RFC 8746.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any, cast

import cbor2
import numpy as np
from numpy.typing import NDArray

from commission.errors import DecodeError
from commission.geometry.arrays import read_only
from commission.io.protocols.message import LiveMessage, OdometryPose, Sent
from commission.site.records import ReferencePose, Scan

MESSAGE_LIMIT = 4_000_000
"""Bytes of a message; one of 20,000 beams with strengths has 800 kB as text."""
BEAM_LIMIT = 20_000
DEPTH_LIMIT = 16
_FAR = 1e6
_LIMITS = "range_min", "range_max"
_TYPED = {64: "u1", 69: "<u2", 70: "<u4", 77: "<i2", 78: "<i4", 85: "<f4", 86: "<f8"}
"""Tags of RFC 8746 and the numpy types that they mean."""


def decode_publication(data: bytes) -> tuple[str, Mapping[str, Any]] | None:
    """Decode one message of a server.

    Parameters
    ----------
    data : text (JSON) or binary (CBOR).

    Returns
    -------
    found : topic and message of a publication; None of any other operation.

    Raises
    ------
    DecodeError
        it is neither, or longer than can be.
    """
    if len(data) > MESSAGE_LIMIT:
        raise DecodeError(f"{len(data)} bytes; expected {MESSAGE_LIMIT} at most", MESSAGE_LIMIT)
    try:
        if data[:1] == b"{":
            whole: object = json.loads(data)
        else:
            whole = cbor2.loads(data, tag_hook=_typed_array, max_depth=DEPTH_LIMIT)
    except (cbor2.CBORError, ValueError, TypeError, OverflowError, RecursionError, MemoryError) as error:
        raise DecodeError(f"it is no message of rosbridge: {str(error)[:80]}", 0) from None
    if not isinstance(whole, dict):
        raise DecodeError("it is no message of rosbridge; expected an object with op", 0)
    found = cast(dict[str, Any], whole)
    if found.get("op") != "publish":
        return None
    topic, message = found.get("topic"), found.get("msg")
    if not isinstance(topic, str) or not isinstance(message, dict):
        raise DecodeError("a publication has no topic or no message", 0)
    return topic, cast(dict[str, Any], message)


def decode_record(topic: str, message: Mapping[str, Any], scanners: Mapping[str, int]) -> LiveMessage | None:
    """Return what a message says.

    Parameters
    ----------
    topic : that it was published on.
    message : LaserScan, Odometry or PoseStamped; stamps of ROS 1 (secs, nsecs) or ROS 2 (sec, nanosec).
    scanners : topics of scans, and which scanner each is.

    Raises
    ------
    DecodeError
        a part is missing, or a number cannot be.
    """
    stamp_ns = _stamp(message)
    if topic in scanners:
        record: Sent = _scan(message, stamp_ns, scanners[topic])
    elif isinstance(message.get("pose"), dict):
        outer = message["pose"]
        is_reference = "pose" not in outer
        pose = np.array(_pose(outer if is_reference else outer["pose"]))
        record = ReferencePose(stamp_ns, pose) if is_reference else OdometryPose(stamp_ns, pose)
    else:
        raise DecodeError(f"a message of {topic[:40]!r} has no pose", 0)
    # Two servers, or one that is subscribed to twice, say the same message with the same stamp.
    return LiveMessage(record, device_ns=stamp_ns or None)


def subscription(topic: str) -> str:
    """Return the request for a topic, whatever its type is; scans come as CBOR where the server knows it."""
    # One message in the queue of the server: what waits there is old. Its buffer is that of the socket.
    request = {"op": "subscribe", "id": f"commission{topic}", "topic": topic, "compression": "cbor", "queue_length": 0}
    return json.dumps(request)


def encode_publication(topic: str, record: Sent, *, is_cbor: bool, ros: int = 2) -> bytes:
    """Return the publication of a record.

    Parameters
    ----------
    topic : that it is published on.
    record : a scan, a pose of odometry or a reference; else ValueError.
    is_cbor : whether binary is asked for; else text.
    ros : 1 or 2: how stamps are written.
    """
    seconds, rest = divmod(record.stamp_ns, 10**9)
    stamp = {"secs": seconds, "nsecs": rest} if ros == 1 else {"sec": seconds, "nanosec": rest}
    message: dict[str, Any] = {"header": {"stamp": stamp, "frame_id": ""}}
    match record:
        case Scan():
            strengths = record.intensities
            if strengths is None and record.reflector is not None:
                # A LaserScan has no flags.
                strengths = record.reflector.astype(np.float32)
            message |= {
                "angle_min": record.angle_min,
                "angle_increment": record.angle_increment,
                "range_min": 0.0,
                "range_max": 0.0,
                "ranges": _array(record.ranges, is_cbor=is_cbor),
                "intensities": [] if strengths is None else _array(strengths, is_cbor=is_cbor),
            }
        case OdometryPose():
            message["pose"] = {"pose": _pose_of(record.pose)}
        case ReferencePose():
            message["pose"] = _pose_of(record.pose)
        case _:
            raise ValueError(f"{type(record).__name__} is not published; expected a scan or a pose")
    whole = {"op": "publish", "topic": topic, "msg": message}
    return cbor2.dumps(whole) if is_cbor else json.dumps(whole, allow_nan=False).encode()


def published(record: Sent) -> bool:
    """Whether a record can be published."""
    return isinstance(record, Scan | OdometryPose) or (
        isinstance(record, ReferencePose) and bool(np.isfinite(record.pose).all())
    )


def _typed_array(tag: cbor2.CBORTag, *_: object) -> object:
    kind, data = _TYPED.get(tag.tag), tag.value
    if kind is None or not isinstance(data, bytes) or len(data) % np.dtype(kind).itemsize:
        raise ValueError(f"the tag {tag.tag} is none of a typed array")
    return np.frombuffer(data, kind)


def _stamp(message: Mapping[str, Any]) -> int:
    """Stamp of a header [ns]; 0 where there is none."""
    header = message.get("header")
    stamp = header.get("stamp") if isinstance(header, dict) else None
    if not isinstance(stamp, dict):
        return 0
    seconds, rest = (stamp.get(a, stamp.get(b, 0)) for a, b in (("sec", "secs"), ("nanosec", "nsecs")))
    if not (isinstance(seconds, int) and isinstance(rest, int) and 0 <= seconds < 2**32 and 0 <= rest < 10**9):
        raise DecodeError("the stamp is out of range; expected seconds below 2^32 and nanoseconds below 10^9", 0)
    return seconds * 10**9 + rest


def _number(values: Mapping[str, Any], name: str) -> float:
    found = values.get(name)
    # Compared only: an integer may have thousands of digits, which neither `float` nor `str` takes.
    if not isinstance(found, int | float) or not -_FAR <= found <= _FAR:
        raise DecodeError(f"{name} is {_told(found)}; expected a number", 0)
    return float(found)


def _told(found: object) -> str:
    """Return what stands there, for a message."""
    return "a number that is too large" if isinstance(found, int) and abs(found) > _FAR else str(found)[:20]


def _limit(values: Mapping[str, Any], name: str) -> float:
    """Nearest or farthest range [m]: some drivers say that it is infinite, or the largest number there is."""
    found = values.get(name)
    if not isinstance(found, int | float) or found != found:  # noqa: PLR0124 - NaN; an integer may be too long for a float
        raise DecodeError(f"{name} is {_told(found)}; expected a number", 0)
    return float(min(max(found, -_FAR), _FAR))


def _pose(found: object) -> tuple[float, float, float]:
    """Place [m, m] and heading [rad] of a Pose."""
    values: Mapping[str, Any] = cast(dict[str, Any], found) if isinstance(found, dict) else {}
    position, turned = values.get("position"), values.get("orientation")
    if not isinstance(position, dict) or not isinstance(turned, dict):
        raise DecodeError("a pose has no position or no orientation", 0)
    x, y, z, w = (_number(turned, name) for name in "xyzw")
    if x * x + y * y + z * z + w * w < 1e-6:
        raise DecodeError("an orientation is no quaternion; expected one of length 1", 0)
    heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return _number(position, "x"), _number(position, "y"), heading


def _pose_of(pose: NDArray[np.float64]) -> dict[str, Any]:
    x, y, theta = pose.tolist()
    turned = {"x": 0.0, "y": 0.0, "z": math.sin(theta / 2.0), "w": math.cos(theta / 2.0)}
    return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turned}


def _scan(message: Mapping[str, Any], stamp_ns: int, scanner: int) -> Scan:
    first, step = _number(message, "angle_min"), _number(message, "angle_increment")
    if step == 0.0:
        raise DecodeError("angle_increment is 0; expected the angle from beam to beam [rad]", 0)
    ranges = _values(message.get("ranges"), "ranges")
    if not 0 < len(ranges):
        raise DecodeError("ranges are empty; expected one of each beam", 0)
    nearest, farthest = (0.0 if message.get(name) is None else _limit(message, name) for name in _LIMITS)
    ranges[~(ranges > max(nearest, 0.0)) | ~(ranges < (farthest if farthest > 0.0 else _FAR))] = np.nan
    strengths = _values(message.get("intensities"), "intensities")
    if len(strengths) not in (0, len(ranges)):
        raise DecodeError(f"{len(strengths)} intensities of {len(ranges)} ranges", 0)
    return Scan(
        stamp_ns=stamp_ns,
        ranges=read_only(ranges),
        angle_min=first,
        angle_increment=step,
        intensities=read_only(np.clip(np.nan_to_num(strengths), -1e9, 1e9)) if len(strengths) else None,
        scanner=scanner,
    )


def _values(found: object, name: str) -> NDArray[np.float32]:
    """(B,) numbers of an array as it is sent; null, which JSON says for what is not finite, is NaN."""
    if found is None:
        return np.empty(0, np.float32)
    if not isinstance(found, list | np.ndarray) or len(found) > BEAM_LIMIT:
        raise DecodeError(f"{name} are no array of {BEAM_LIMIT} numbers at most", 0)
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            values = np.array(found, dtype=np.float64).astype(np.float32)
    except (TypeError, ValueError, OverflowError):
        raise DecodeError(f"{name} hold something that is no number", 0) from None
    if values.ndim != 1:
        raise DecodeError(f"{name} are of {values.ndim} dimensions; expected numbers one after the other", 0)
    return values


def _array(values: NDArray[np.float32], *, is_cbor: bool) -> object:
    if is_cbor:
        return cbor2.CBORTag(85, values.astype("<f4").tobytes())
    return [float(str(value)) if math.isfinite(value) else None for value in values]
