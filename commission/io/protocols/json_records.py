"""Records as JSON, one message each: what any vehicle can send in twenty lines, without a library.

A message is an object with a `type` (`odometry`, `scan`, `detections`, `tags`, `reflex`, `reference`), numbers in SI
units and radians, and optionally `stamp_ns` by the sender's clock and `seq`, which counts its messages. `null` is a
range of no return.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta, Struct

from commission.errors import DecodeError
from commission.geometry.arrays import FloatArray, read_only
from commission.io.protocols.message import LiveMessage, OdometryPose
from commission.site.records import Detections, Odometry, Record, ReferencePose, Reflex, Scan, TagSightings

MESSAGE_LIMIT = 65_507
"""Bytes of a message: a datagram holds no more."""
BEAM_LIMIT = 20_000
_FAR = 1e6
"""No length of a hall is longer [m], no angle and no speed larger [rad, m/s]."""

_Stamp = Annotated[int, Meta(ge=0, le=2**62)]
_Sequence = Annotated[int, Meta(ge=0, le=2**53)]
_Number = Annotated[float, Meta(ge=-_FAR, le=_FAR)]
_Pose = tuple[_Number, _Number, _Number]


class _Sent(Struct, kw_only=True, tag_field="type"):
    """What every message may say."""

    stamp_ns: _Stamp | None = None
    seq: _Sequence | None = None


class _Odometry(_Sent, tag="odometry"):
    """Where the wheels say that the vehicle is, or how far it moved since the message before."""

    pose: _Pose | None = None
    displacement: _Pose | None = None


class _Scan(_Sent, tag="scan"):
    """One turn of a scanner."""

    angle_min: _Number
    angle_increment: _Number
    ranges: Annotated[list[_Number | None], Meta(min_length=1, max_length=BEAM_LIMIT)]
    intensities: Annotated[list[float | None], Meta(max_length=BEAM_LIMIT)] | None = None
    reflector: Annotated[list[int | bool], Meta(max_length=BEAM_LIMIT)] | None = None
    scanner: str | None = None


class _Detections(_Sent, tag="detections"):
    """Reflectors that the sensor itself found in one scan."""

    range_bearing: Annotated[list[tuple[_Number, _Number]], Meta(max_length=1_000)]
    scanner: str | None = None


class _Tags(_Sent, tag="tags"):
    """Tags that a camera has measured in one frame: id, then x, y, theta and where it is known 1-sigma of each."""

    ids: Annotated[list[str], Meta(max_length=1_000)]
    poses: Annotated[list[_Pose], Meta(max_length=1_000)]
    sigmas: Annotated[list[tuple[_Number | None, _Number | None, _Number | None]], Meta(max_length=1_000)] | None = None


class _Reflex(_Sent, tag="reflex"):
    """The bearing at which a goniometer met a reflector, or null where a whole turn met none."""

    bearing: _Number | None = None
    reflector: str = ""


class _Reference(_Sent, tag="reference"):
    """Where a second system says that the vehicle is."""

    pose: tuple[_Number, _Number, _Number | None]


_Any: TypeAlias = _Odometry | _Scan | _Detections | _Tags | _Reflex | _Reference
_DECODER: msgspec.json.Decoder[_Any] = msgspec.json.Decoder(_Any)


class _Head(Struct):
    """What tells of whom a message is."""

    type: str
    scanner: str | None = None


_HEADS: msgspec.json.Decoder[_Head] = msgspec.json.Decoder(_Head)
_TYPES = frozenset(("odometry", "scan", "detections", "tags", "reflex", "reference"))


def named_scanner(data: bytes) -> str | None:
    """Return the name of the scanner in a message, empty where it names none; None where it is no message of these."""
    try:
        head = _HEADS.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None
    return (head.scanner or "") if head.type in _TYPES else None


def decode_message(data: bytes, scanners: Sequence[str]) -> LiveMessage:
    """Decode one message.

    Parameters
    ----------
    data : UTF-8 text.
    scanners : names of the vehicle's scanners; a message that names none is of the first.

    Raises
    ------
    DecodeError
        it is no message of these, a number cannot be, or it names a scanner that the vehicle does not have.
    """
    if len(data) > MESSAGE_LIMIT:
        raise DecodeError(f"{len(data)} bytes; expected {MESSAGE_LIMIT} at most", MESSAGE_LIMIT)
    try:
        sent = _DECODER.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DecodeError(f"it is no message: {error}", 0) from None
    try:
        return LiveMessage(_record(sent, scanners), device_ns=sent.stamp_ns, sequence=sent.seq)
    except ValueError as error:
        raise DecodeError(str(error), 0) from None


def _record(sent: _Any, scanners: Sequence[str]) -> Record | OdometryPose:  # noqa: PLR0911 - one for each type
    """Return the record of a message; raises ValueError where it cannot be one."""
    stamp = sent.stamp_ns or 0
    match sent:
        case _Odometry(pose=None, displacement=displacement) if displacement is not None:
            return Odometry(stamp, np.array(displacement))
        case _Odometry(pose=pose, displacement=None) if pose is not None:
            return OdometryPose(stamp, np.array(pose))
        case _Odometry():
            raise ValueError("odometry has neither or both of pose and displacement; expected one of them")
        case _Scan():
            return _scan(sent, stamp, _index(sent.scanner, scanners))
        case _Detections():
            rows = np.array(sent.range_bearing, dtype=np.float64).reshape(-1, 2)
            return Detections(stamp, rows, _index(sent.scanner, scanners))
        case _Tags():
            count = len(sent.poses)
            sigmas = [(None, None, None)] * count if sent.sigmas is None else sent.sigmas
            if len(sigmas) != count:
                raise ValueError(f"sigmas has {len(sigmas)} values; expected one for each of {count} poses")
            both = [np.array(each, dtype=np.float64).reshape(-1, 3) for each in (sent.poses, sigmas)]
            return TagSightings(stamp, np.concatenate(both, axis=1), tuple(sent.ids))
        case _Reflex():
            return Reflex(stamp, math.nan if sent.bearing is None else sent.bearing, sent.reflector)
        case _Reference():
            x, y, theta = sent.pose
            return ReferencePose(stamp, np.array([x, y, math.nan if theta is None else theta]))


def _index(name: str | None, scanners: Sequence[str]) -> int:
    if name is None:
        return 0
    if name not in scanners:
        raise ValueError(f"there is no scanner {name[:40]!r}; expected one of {', '.join(map(repr, scanners))}")
    return list(scanners).index(name)


def _scan(sent: _Scan, stamp_ns: int, scanner: int) -> Scan:
    if sent.angle_increment == 0.0:
        raise ValueError("angle_increment is 0; expected the angle from beam to beam [rad]")
    beams = len(sent.ranges)
    for name, values in (("intensities", sent.intensities), ("reflector", sent.reflector)):
        if values is not None and len(values) != beams:
            raise ValueError(f"{name} has {len(values)} values; expected one for each of {beams} ranges")
    ranges = np.array(sent.ranges, dtype=np.float32)
    ranges[~(ranges > 0.0)] = np.nan
    intensities = None
    if sent.intensities is not None:
        strengths = np.nan_to_num(np.array(sent.intensities, dtype=np.float64), nan=0.0, posinf=0.0, neginf=0.0)
        intensities = read_only(np.clip(strengths, -1e9, 1e9).astype(np.float32))
    return Scan(
        stamp_ns=stamp_ns,
        ranges=read_only(ranges),
        angle_min=sent.angle_min,
        angle_increment=sent.angle_increment,
        intensities=intensities,
        reflector=None if sent.reflector is None else read_only(np.array(sent.reflector, dtype=np.bool_)),
        scanner=scanner,
    )


def encode_message(message: LiveMessage, scanners: Sequence[str]) -> bytes:
    """Encode a record as a message; what is decoded again is the same.

    Parameters
    ----------
    message : record, the sender's stamp, and the number of the message.
    scanners : names that the record has an index into.

    Raises
    ------
    ValueError
        the message is longer than a datagram.
    """
    content = {"type": "", "stamp_ns": message.device_ns, "seq": message.sequence} | _content(message.record, scanners)
    data = msgspec.json.encode({key: value for key, value in content.items() if value is not None})
    if len(data) > MESSAGE_LIMIT:
        raise ValueError(f"a message has {len(data)} bytes; expected {MESSAGE_LIMIT} at most: a datagram")
    return data


def _content(record: Record | OdometryPose, scanners: Sequence[str]) -> dict[str, Any]:  # noqa: PLR0911 - as above
    match record:
        case Odometry():
            return {"type": "odometry", "displacement": record.displacement.tolist()}
        case OdometryPose():
            return {"type": "odometry", "pose": record.pose.tolist()}
        case ReferencePose():
            return {"type": "reference", "pose": _nullable(record.pose)}
        case Detections():
            rows = record.range_bearing.tolist()
            return {"type": "detections", "range_bearing": rows, "scanner": scanners[record.scanner]}
        case Reflex():
            bearing = None if math.isnan(record.bearing) else record.bearing
            return {"type": "reflex", "bearing": bearing, "reflector": record.reflector}
        case TagSightings():
            return {
                "type": "tags",
                "ids": list(record.ids),
                "poses": record.sightings[:, :3].tolist(),
                "sigmas": [_nullable(row) for row in record.sightings[:, 3:]],
            }
        case Scan():
            return {
                "type": "scan",
                "angle_min": record.angle_min,
                "angle_increment": record.angle_increment,
                # A shorter text of a float32 reads back as the same.
                "ranges": [None if math.isnan(value) else float(str(value)) for value in record.ranges],
                "intensities": None if record.intensities is None else record.intensities.tolist(),
                "reflector": None if record.reflector is None else record.reflector.astype(int).tolist(),
                "scanner": scanners[record.scanner],
            }


def _nullable(values: FloatArray) -> list[float | None]:
    return [None if math.isnan(value) else float(value) for value in values]
