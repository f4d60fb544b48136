"""A sender that opens a new socket, and so has a new port, for each message is one sender, and two are still two."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from contextlib import ExitStack

import numpy as np
import pytest

from commission.io.live.connection import Arrival
from commission.io.live.senders import NEW_PORTS, Ports
from commission.io.live.sorter import Sorter
from commission.io.protocols.json_records import encode_message
from commission.io.protocols.message import LiveMessage, OdometryPose
from commission.site.records import Odometry, Scan
from tests.io.live.virtual import PERIOD_NS, Listening, scan, until

STEP = 0.1
"""Way between two poses [m]."""
HERE = "127.0.0.1"


def pose(number: int, y: float = 0.0) -> OdometryPose:
    return OdometryPose(10**9 + number * PERIOD_NS, np.array([STEP * number, y, 0.0]))


def message(record: OdometryPose | Scan, sequence: int | None = None) -> bytes:
    return encode_message(LiveMessage(record, device_ns=record.stamp_ns, sequence=sequence), ("scanner",))


def send_from_a_new_socket(listening: Listening, messages: Sequence[bytes]) -> None:
    before = len(listening.arrivals)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for each in messages:
            out.sendto(each, (HERE, listening.connection.address.port))
    assert until(lambda: len(listening.arrivals) >= before + len(messages))


def way(arrivals: Sequence[Arrival]) -> float:
    """What the sorter makes of poses: how far the vehicle drove, and 0 where a sender begins anew [m]."""
    sorter = Sorter()
    for each in arrivals:
        sorter.push(0, each.record, each.arrived_ns, each.conversation)
    moved = [record for record in sorter.due(arrivals[-1].arrived_ns + 10**10) if isinstance(record, Odometry)]
    return float(sum(record.displacement[0] for record in moved))


@pytest.mark.parametrize("has_numbers", [True, False])
@pytest.mark.parametrize("has_scan", [True, False])
def test_sender_with_a_new_socket_for_each_message_is_one_sender(*, has_numbers: bool, has_scan: bool) -> None:
    with Listening("json") as listening:
        for number in range(40):
            records = [pose(number), scan(number)] if has_scan else [pose(number)]
            first = number * len(records)
            numbers = range(first, first + len(records)) if has_numbers else [None] * len(records)
            send_from_a_new_socket(listening, [message(*each) for each in zip(records, numbers, strict=True)])
        status = listening.connection.status()
        arrivals = list(listening.arrivals)
    assert len(arrivals) == 40 * (1 + has_scan)
    assert (status.lost, status.duplicates, status.told) == (0, 0, {})
    # Three ports are left before it is seen that there will be others; then nothing begins anew.
    assert len({each.conversation for each in arrivals}) == 4
    assert way(arrivals) == pytest.approx((40 - 4) * STEP)


def test_two_programs_with_new_sockets_are_both_taken_whatever_numbers_they_give() -> None:
    with Listening("json") as listening:
        for number in range(30):
            send_from_a_new_socket(listening, [message(pose(number), number)])
            send_from_a_new_socket(listening, [message(scan(number), number)])
        status = listening.connection.status()
        arrivals = list(listening.arrivals)
    assert (len(arrivals), status.duplicates, status.lost, status.told) == (60, 0, 0, {})
    assert way(arrivals) > 26 * STEP


@pytest.mark.parametrize("has_stamps", [True, False])
def test_program_with_new_sockets_that_begins_again_is_heard_again(*, has_stamps: bool) -> None:
    with Listening("json") as listening:
        for first in (0, 1_000):
            for number in range(20):
                record = pose(first + number)
                stamp_ns = record.stamp_ns - first * PERIOD_NS if has_stamps else None
                again = encode_message(LiveMessage(record, device_ns=stamp_ns, sequence=number), ("scanner",))
                before = listening.connection.status()
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
                    out.sendto(again, (HERE, listening.connection.address.port))
                expected = before.records + before.duplicates + 1
                assert until(
                    lambda expected=expected: (
                        (status := listening.connection.status()).records + status.duplicates == expected
                    )
                )
        status, arrivals = listening.connection.status(), list(listening.arrivals)
    assert (len(arrivals), status.duplicates) == (40, 0)
    # That it counts again is known with its third number; the way from where it ended to where it is was not driven.
    assert way(arrivals) == pytest.approx((20 - 4 + 1 + 20 - 3) * STEP)
    assert len({each.conversation for each in arrivals}) == 5


def test_another_vehicle_that_sends_the_same_beside_one_with_new_sockets_is_told() -> None:
    with Listening("json") as listening, ExitStack() as stack:
        for number in range(20):
            send_from_a_new_socket(listening, [message(pose(number))])
        other = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        to = HERE, listening.connection.address.port
        for number in range(20, 50):
            other.sendto(message(pose(number, y=7.0)), to)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
                out.sendto(message(pose(number)), to)
        assert until(lambda: sum((listening.connection.status().told or {}).values()) >= 27)
        told = listening.connection.status().told or {}
        port = other.getsockname()[1]
        lanes = [each.record.pose[1] for each in listening.arrivals if isinstance(each.record, OdometryPose)]
    words = f"messages of {HERE} (ever new ports) are left out, since {HERE}:{port} sends the same to this port"
    assert told[words] >= 25, told
    # A port that comes twice may do so by chance; from the third time on it is one vehicle, not two in turns.
    assert np.flatnonzero(np.diff(lanes)).size <= 5
    assert lanes[-10:] == [7.0] * 10


def programs(*ports: int) -> list[int]:
    known = Ports()
    found = [known.program(("10.0.0.1", port)) for port in ports]
    return [0 if each is None else each[1] for each in found]


def test_ports_of_programs_that_go_on_are_each_their_own() -> None:
    assert programs(*[5_001, 5_002] * 50) == [5_001, 5_002] * 50
    assert programs(*[5_001] * 100) == [5_001] * 100
    # One that begins again now and then, after many messages.
    assert programs(*(5_000 + turn // 20 for turn in range(200))) == [5_000 + turn // 20 for turn in range(200)]
    # Six of them at once: but for the first messages of some.
    six = [5_001, 5_002, 5_003, 5_004, 5_005, 5_006] * 20
    assert programs(*six)[12:] == six[12:]


def test_port_that_comes_again_by_chance_is_none_that_goes_on() -> None:
    ports = [6_000 + number for number in range(60)]
    ports[40] = ports[30]
    assert programs(*ports) == [6_000, 6_001, 6_002, *[NEW_PORTS] * 57]


def test_program_that_goes_on_beside_one_with_new_ports_is_its_own() -> None:
    ports = [port for number in range(60) for port in (6_000 + number, 9_999)]
    found = programs(*ports)
    assert found[1::2] == [9_999] * 60
    assert found[0::2][:3] == [6_000, 6_001, 6_002]
    assert found[0::2][5:] == [NEW_PORTS] * 55


def test_computers_are_told_apart() -> None:
    known = Ports()
    for number in range(10):
        first, second = (known.program((f"10.0.0.{host}", 6_000 + number)) for host in (1, 2))
        assert first is not None
        assert second is not None
        assert (first[0], second[0]) == ("10.0.0.1", "10.0.0.2")
    assert known.program(None) is None
    assert known.program(("10.0.0.3", 7_000)) == ("10.0.0.3", 7_000)
