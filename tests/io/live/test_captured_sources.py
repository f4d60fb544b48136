"""Sources without a virtual device, fed with what real scanners sent."""

from __future__ import annotations

import re
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

from commission.io.live.registry import SourceAddress, driver_of
from commission.site.records import Scan
from tests.conftest import REPOSITORY
from tests.io.live.virtual import NAMES, Listening, until
from tests.io.protocols.captures import tcp_stream, udp_parts


@pytest.fixture(scope="module")
def captures(shared_data: Path) -> Path:
    return shared_data / "sick_captures"


def test_a_device_that_closes_the_connection_is_connected_to_again_and_asked_for_scans(captures: Path) -> None:
    stream = tcp_stream(captures / "mrs1xxx_test01_tcp_data.json")
    heard: list[bytes] = []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            for _ in range(3):
                connection, _address = server.accept()
                with connection:
                    heard.append(connection.recv(100))
                    connection.sendall(stream)

        device = threading.Thread(target=serve, daemon=True)
        device.start()
        with Listening("cola", server.getsockname()[1]) as listening:
            assert until(lambda: len(listening.arrivals) == 3 * 11), len(listening.arrivals)
            status = listening.connection.status()
        device.join()
    assert heard == [b"\x02\x02\x02\x02\x00\x00\x00\x11sEN LMDscandata \x01\x33"] * 3
    assert (status.connects, status.undecodable) == (3, 0)
    # Of four layers the level one; the same scans each time, none of them twice.
    stamps = [arrival.record.stamp_ns for arrival in listening.arrivals]
    assert all(len(set(stamps[first : first + 11])) == 11 for first in (0, 11, 22))


def test_telegrams_of_a_multiscan_make_its_turns(captures: Path) -> None:
    found: list[Scan] = []
    for file in sorted(captures.glob("*picoscan*udp*.json")) or sorted(captures.glob("*pico*.json")):
        driver = driver_of(SourceAddress.parse("compact"), NAMES)()
        for part in udp_parts(file):
            found += [message.record for message in driver.take(part, 10**18) if isinstance(message.record, Scan)]
    assert len(found) > 3
    assert all(scan.intensities is not None for scan in found)


def test_the_readmes_sender_is_understood_and_has_twenty_lines() -> None:
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    code = next(found for found in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "SOCK_DGRAM" in found)
    assert len([line for line in code.splitlines() if line.strip()]) <= 20
    with Listening("json") as listening:
        names: dict[str, Any] = {}
        exec(code.replace("6061", str(listening.connection.address.port)).replace("range(100)", "range(8)"), names)
        names["out"].close()
        assert until(lambda: len(listening.arrivals) == 10)
        assert listening.connection.status().undecodable == 0
