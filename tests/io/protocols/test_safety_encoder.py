from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from commission.io.protocols import safety
from commission.io.protocols.safety_encoder import encode_fragments, encode_instance
from commission.site.records import Scan
from tests.io.protocols.captures import fragments


def decoded(datagrams: list[bytes]) -> safety.SafetyScan:
    reassembly = safety.Reassembly()
    found = [reassembly.add(safety.decode_fragment(datagram)) for datagram in datagrams]
    whole = next(each for each in found if each is not None)
    scan = safety.decode_instance(whole)
    assert scan is not None
    return scan


@given(
    npst.arrays(np.float32, st.integers(1, 2_751), elements=st.one_of(st.just(np.nan), st.floats(0.125, 39, width=32))),
    st.floats(-2.4, 0.0),
    st.floats(0.0015, 0.02),
    st.integers(0, 2**32 - 1),
)
def test_what_is_encoded_is_decoded_to_a_millimetre(
    ranges: np.ndarray, angle_min: float, increment: float, sequence: int
) -> None:
    flags = np.arange(len(ranges)) % 5 == 0
    sent = Scan(stamp_ns=8, ranges=ranges, angle_min=angle_min, angle_increment=increment, reflector=flags)
    found = decoded(encode_fragments(encode_instance(sent, sequence), sequence))
    assert found.sequence == sequence
    scan = safety.scan_of(found, 8)
    np.testing.assert_allclose(scan.ranges, ranges, atol=0.00051)
    # Angles have steps of 2^-22 degree.
    np.testing.assert_allclose(scan.bearings, sent.bearings, atol=4.2e-9 * (len(ranges) + 1))
    assert scan.reflector is not None
    np.testing.assert_array_equal(scan.reflector, flags & np.isfinite(ranges))


def test_fragments_are_cut_as_those_that_were_measured() -> None:
    whole = encode_instance(
        Scan(stamp_ns=0, ranges=np.ones(1_651, np.float32), angle_min=-2.4, angle_increment=0.0029), 3
    )
    assert encode_fragments(whole, 3) == fragments(whole, 3)
