"""rosbridge messages: by the words of its specification, in both stamps and both forms, and what is none."""

from __future__ import annotations

import json
import math
import struct
from typing import Any

import cbor2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import DecodeError
from commission.io.protocols.message import LiveMessage, OdometryPose
from commission.io.protocols.rosbridge import (
    MESSAGE_LIMIT,
    decode_publication,
    decode_record,
    encode_publication,
    subscription,
)
from commission.site.records import ReferencePose, Scan

SCANS = {"/scan": 0}
SCAN: dict[str, Any] = {
    "header": {"stamp": {"secs": 1_700_000_000, "nsecs": 5}, "frame_id": "laser"},
    "angle_min": -1.5,
    "angle_max": 1.5,
    "angle_increment": 1.0,
    "range_min": 0.5,
    "range_max": 30.0,
    "ranges": [1.0, None, 0.4, 30.5],
    "intensities": [10.0, 0.0, 20.0, 30.0],
}


def message_of(data: bytes) -> LiveMessage:
    found = decode_publication(data)
    assert found is not None
    message = decode_record(*found, SCANS)
    assert message is not None
    return message


def text(message: object, topic: str = "/scan") -> bytes:
    return json.dumps({"op": "publish", "topic": topic, "msg": message}).encode()


def test_a_laser_scan_of_ros_1_as_text() -> None:
    message = message_of(text(SCAN))
    scan = message.record
    assert isinstance(scan, Scan)
    assert message.device_ns == 1_700_000_000 * 10**9 + 5
    # null is no return; so is what the scanner says that it cannot measure.
    np.testing.assert_array_equal(scan.ranges, np.array([1.0, np.nan, np.nan, np.nan], np.float32))
    np.testing.assert_array_equal(scan.intensities, [10.0, 0.0, 20.0, 30.0])
    assert (scan.angle_min, scan.angle_increment) == (-1.5, 1.0)


def test_a_laser_scan_of_ros_2_as_cbor_with_typed_arrays() -> None:
    typed = SCAN | {
        "header": {"stamp": {"sec": 7, "nanosec": 9}},
        "ranges": cbor2.CBORTag(85, struct.pack("<4f", 1.0, math.inf, 2.5, math.nan)),
        "intensities": cbor2.CBORTag(86, struct.pack("<4d", 1, 2, 3, 4)),
    }
    message = message_of(cbor2.dumps({"op": "publish", "topic": "/scan", "msg": typed}))
    assert isinstance(message.record, Scan)
    assert message.device_ns == 7_000_000_009
    np.testing.assert_array_equal(message.record.ranges, np.array([1.0, np.nan, 2.5, np.nan], np.float32))
    np.testing.assert_array_equal(message.record.intensities, [1, 2, 3, 4])


def test_odometry_is_a_pose_and_a_reference_too() -> None:
    half = math.sqrt(0.5)
    pose = {"position": {"x": 1, "y": -2.0, "z": 0.0}, "orientation": {"x": 0, "y": 0, "z": half, "w": half}}
    odometry = message_of(text({"header": {"stamp": {"sec": 1, "nanosec": 2}}, "pose": {"pose": pose}}, "/odom"))
    assert isinstance(odometry.record, OdometryPose)
    np.testing.assert_allclose(odometry.record.pose, [1.0, -2.0, math.pi / 2])
    reference = message_of(text({"pose": pose}, "/reference"))
    assert isinstance(reference.record, ReferencePose)
    assert reference.device_ns is None


@pytest.mark.parametrize("is_cbor", [False, True])
@pytest.mark.parametrize("ros", [1, 2])
def test_what_is_published_is_read_as_it_was(is_cbor: bool, ros: int) -> None:
    scan = Scan(
        stamp_ns=123_456_789_012,
        ranges=np.array([1.1, np.nan, 3.3], np.float32),
        angle_min=-0.123456789,
        angle_increment=0.1,
        intensities=np.array([0.1, 2.0, 7e5], np.float32),
    )
    message = message_of(encode_publication("/scan", scan, is_cbor=is_cbor, ros=ros))
    assert isinstance(message.record, Scan)
    assert message.device_ns == scan.stamp_ns
    assert message.record.ranges.tobytes() == scan.ranges.tobytes()
    assert scan.intensities is not None
    assert message.record.intensities is not None
    assert message.record.intensities.tobytes() == scan.intensities.tobytes()
    assert (message.record.angle_min, message.record.angle_increment) == (scan.angle_min, scan.angle_increment)
    pose = message_of(encode_publication("/odom", OdometryPose(5, np.array([1.0, 2.0, -3.0])), is_cbor=is_cbor))
    np.testing.assert_allclose(pose.record.pose, [1.0, 2.0, -3.0], atol=1e-12)  # type: ignore[union-attr]


def test_other_operations_say_no_record() -> None:
    assert decode_publication(b'{"op": "status", "level": "error", "msg": "no such topic"}') is None
    assert json.loads(subscription("/scan"))["topic"] == "/scan"


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"{",
        b"\xff",
        b"[1]",
        cbor2.dumps([1]),
        b"[" * 100_000,
        b"\x81" * 100_000,
        b"\x9b\xff\xff\xff\xff\xff\xff\xff\xff",
        b"\x5b\x7f\xff\xff\xff\xff\xff\xff\xff",
        b"{" + b" " * MESSAGE_LIMIT,
        b'{"op": "publish", "topic": 1, "msg": {}}',
        b'{"op": "publish", "topic": "/scan", "msg": 3}',
        cbor2.dumps({"op": "publish", "topic": "/scan", "msg": cbor2.CBORTag(85, b"abc")}),
    ],
)
def test_what_is_no_message_is_refused(data: bytes) -> None:
    with pytest.raises(DecodeError):
        decode_publication(data)


def test_a_farthest_range_of_thousands_of_digits_is_as_good_as_none() -> None:
    found = decode_publication(cbor2.dumps({"op": "publish", "topic": "/scan", "msg": SCAN | {"range_max": 10**5000}}))
    assert found is not None
    message = decode_record(*found, SCANS)
    assert message is not None


@pytest.mark.parametrize(
    "change",
    [
        {"ranges": None},
        {"ranges": []},
        {"ranges": "abcd"},
        {"ranges": [[1.0], [2.0], [3.0], [4.0]]},
        {"ranges": ["a", 1, 2, 3]},
        {"ranges": [1.0] * 20_001},
        {"intensities": [1.0]},
        {"angle_increment": 0.0},
        {"angle_min": None},
        {"angle_min": 1e300},
        {"range_max": "far"},
        {"range_max": {}},
        {"angle_min": 10**400},
        {"angle_increment": -(10**5000)},
        {"header": {"stamp": {"sec": 10**4000, "nanosec": 0}}},
        {"header": {"stamp": {"sec": -1, "nanosec": 0}}},
        {"header": {"stamp": {"sec": 1, "nanosec": 10**9}}},
        {"header": {"stamp": {"sec": 2**32, "nanosec": 0}}},
    ],
)
def test_a_scan_that_cannot_be_is_refused(change: dict[str, Any]) -> None:
    # As CBOR: Python's own JSON neither writes nor reads integers of more than 4,300 digits.
    found = decode_publication(cbor2.dumps({"op": "publish", "topic": "/scan", "msg": SCAN | change}))
    assert found is not None
    with pytest.raises(DecodeError):
        decode_record(*found, SCANS)


@pytest.mark.parametrize(
    "orientation", [None, {}, {"x": 0, "y": 0, "z": 0, "w": 0}, {"x": "a", "y": 0, "z": 0, "w": 1}]
)
def test_a_pose_that_cannot_be_is_refused(orientation: object) -> None:
    message = {"pose": {"pose": {"position": {"x": 0, "y": 0}, "orientation": orientation}}}
    found = decode_publication(text(message, "/odom"))
    assert found is not None
    with pytest.raises(DecodeError):
        decode_record(*found, SCANS)


@pytest.mark.parametrize("pose", [{"pose": 97}, {"pose": None}, {"pose": []}, {"position": 3}])
def test_a_pose_that_is_a_number_is_refused(pose: object) -> None:
    found = decode_publication(text({"pose": pose}, "/odom"))
    assert found is not None
    with pytest.raises(DecodeError, match="no position"):
        decode_record(*found, SCANS)


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=200), st.booleans())
def test_any_bytes_are_refused_or_a_message(data: bytes, is_text: bool) -> None:
    try:
        found = decode_publication(b"{" + data if is_text else data)
        if found is not None:
            decode_record(*found, SCANS)
    except DecodeError:
        pass
