from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import DecodeError
from commission.io.protocols import nav350
from tests.io.protocols.captures import nav_answer


def test_answer_is_what_the_layout_says() -> None:
    found = nav350.decode_nav(nav_answer())

    assert found.pose is not None
    np.testing.assert_allclose(found.pose, [-1.5, 2.5, math.pi / 2])
    assert (found.error, found.pose_stamp_ms, found.scan_stamp_ms) == (0, 4711, 4700)
    np.testing.assert_allclose(found.range_bearing, [[5.0, math.pi], [2.5, 1.5 * math.pi]])
    assert found.global_ids == (40, 41)
    scan = nav350.scan_of(found, 3)
    assert scan is not None
    assert len(scan.ranges) == 1440
    assert np.isnan(scan.ranges[0])
    assert scan.ranges[1000] == pytest.approx(1.0)
    assert scan.angle_min == pytest.approx(-math.pi)
    assert scan.bearings[720] == pytest.approx(0.0, abs=1e-9)
    assert scan.intensities is not None
    assert scan.intensities[7] == 7.0


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"sAN mNEVAChangeState \x00", "is no answer with pose"),
        (nav_answer()[:60], "are left; expected"),
        (nav_answer(3000), "3000 beams"),
    ],
)
def test_what_cannot_be_is_a_decode_error(content: bytes, found: str) -> None:
    with pytest.raises(DecodeError, match=found):
        nav350.decode_nav(content)


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_changed_answer_is_a_decode_error_or_valid(data: st.DataObject) -> None:
    content = bytearray(nav_answer(40))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(17, len(content) - 1))] = data.draw(st.integers(0, 255))
    try:
        scan = nav350.scan_of(nav350.decode_nav(bytes(content)), 0)
    except DecodeError:
        return
    assert scan is None or not (scan.ranges < 0.0).any()
