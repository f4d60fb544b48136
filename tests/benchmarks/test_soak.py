"""The soak, for seconds: it has to be able to run when somebody takes half an hour for it."""

from __future__ import annotations

import socket
import time

import pytest

from tests.benchmarks.soak import LOST_AFTER_S, read, soak


@pytest.mark.with_all_seeds
def test_drive_is_edited_and_read_and_a_job_is_stopped() -> None:
    found = soak(0.1)
    assert len(found.latencies) == len(found.memory) >= 2
    assert max(found.latencies) < LOST_AFTER_S
    assert found.jobs == 1


def test_readers_go_when_the_server_is_gone() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    started = time.monotonic()
    read(port, 60.0)
    assert time.monotonic() - started < 30.0
