from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from commission.errors import DecodeError
from commission.geometry.arrays import equal_fields
from commission.io.protocols.json_records import MESSAGE_LIMIT, decode_message, encode_message
from commission.io.protocols.message import LiveMessage, OdometryPose
from commission.site.records import Detections, Odometry, ReferencePose, Scan

NAMES = ("front", "rear")
NUMBER = st.floats(-1e5, 1e5)
STAMP = st.integers(0, 2**62)
TRIPLE = st.tuples(NUMBER, NUMBER, NUMBER).map(np.array)
RANGES = npst.arrays(
    np.float32, st.integers(1, 40), elements=st.one_of(st.just(np.nan), st.floats(2**-10, 400, width=32))
)


@st.composite
def scans(draw: st.DrawFn) -> Scan:
    ranges = draw(RANGES)
    flags = npst.arrays(np.bool_, len(ranges))
    strengths = npst.arrays(np.float32, len(ranges), elements=st.floats(0, 1e5, width=32))
    return Scan(
        stamp_ns=draw(STAMP),
        ranges=ranges,
        angle_min=draw(NUMBER),
        angle_increment=draw(st.floats(1e-4, 1.0)),
        intensities=draw(st.one_of(st.none(), strengths)),
        reflector=draw(st.one_of(st.none(), flags)),
        scanner=draw(st.integers(0, 1)),
    )


RECORDS = st.one_of(
    st.builds(Odometry, STAMP, TRIPLE),
    st.builds(OdometryPose, STAMP, TRIPLE),
    st.builds(ReferencePose, STAMP, TRIPLE),
    st.builds(
        Detections,
        STAMP,
        st.lists(st.tuples(st.floats(0.01, 400), st.floats(-4, 4)), max_size=9).map(
            lambda rows: np.array(rows).reshape(-1, 2)
        ),
        st.integers(0, 1),
    ),
    scans(),
)


@given(RECORDS, st.integers(0, 2**53))
def test_what_is_encoded_is_decoded_as_the_same(record: Odometry, sequence: int) -> None:
    found = decode_message(encode_message(LiveMessage(record, record.stamp_ns, sequence), NAMES), NAMES)
    assert (found.device_ns, found.sequence) == (record.stamp_ns, sequence)
    assert type(found.record) is type(record)
    for name in record.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(found.record, name), getattr(record, name))


def test_what_the_readme_sends_is_understood() -> None:
    found = decode_message(b'{"type":"odometry","stamp_ns":5,"pose":[1,2,0.5]}', NAMES)
    assert equal_fields(found.record, OdometryPose(5, np.array([1.0, 2.0, 0.5])))
    text = b'{"type":"scan","angle_min":-1,"angle_increment":0.5,"ranges":[1,null,2.5,0],"reflector":[0,1,true,0]}'
    scan = decode_message(text, NAMES).record
    assert isinstance(scan, Scan)
    np.testing.assert_array_equal(scan.ranges, np.array([1.0, np.nan, 2.5, np.nan], np.float32))
    assert scan.reflector is not None
    assert scan.reflector.tolist() == [False, True, True, False]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"type": "odometry"}, "neither or both"),
        ({"type": "odometry", "pose": [1, 2, 3], "displacement": [1, 2, 3]}, "neither or both"),
        ({"type": "odometry", "pose": [1, 2]}, "pose"),
        ({"type": "odometry", "pose": [1e300, 2, 3]}, "pose"),
        ({"type": "hello"}, "hello"),
        ({"stamp_ns": 1}, "type"),
        ({"type": "scan", "angle_min": 0, "angle_increment": 0, "ranges": [1]}, "angle_increment is 0"),
        ({"type": "scan", "angle_min": 0, "angle_increment": 1, "ranges": []}, "ranges"),
        ({"type": "scan", "angle_min": 0, "angle_increment": 1, "ranges": [1], "reflector": [1, 0]}, "reflector has 2"),
        ({"type": "detections", "range_bearing": [[0, 1]]}, "a range is 0"),
        ({"type": "detections", "range_bearing": [[1, 1]], "scanner": "left"}, "expected one of 'front', 'rear'"),
        ({"type": "detections", "range_bearing": [[1, 1]], "stamp_ns": -1}, "stamp_ns"),
        ({"type": "detections", "range_bearing": [[1, 1]], "stamp_ns": 1.5}, "stamp_ns"),
    ],
)
def test_what_cannot_be_is_refused_with_what_was_found(content: dict[str, object], said: str) -> None:
    with pytest.raises(DecodeError, match=said):
        decode_message(json.dumps(content).encode(), NAMES)


@pytest.mark.parametrize(
    "data", [b"", b"[" * 60_000, b'{"a":' * 9_000, b"\xff\xfe", b" " * (MESSAGE_LIMIT + 1), b"1e999"]
)
def test_what_is_no_message_is_a_decode_error(data: bytes) -> None:
    with pytest.raises(DecodeError):
        decode_message(data, NAMES)
