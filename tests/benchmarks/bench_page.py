"""What the page costs its server: 25 scans a second of about 1,081 beams in the laboratory, one browser connected.

The browser is a raw websocket client in a process of its own that takes in everything, so that drawing does not count.
Required: less than 15 % of one core. Run: python -m tests.benchmarks.bench_page [seconds] [light]
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from dataclasses import replace

import msgspec
import viser
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from commission.app.base.relight import COOKIE
from commission.app.base.server import start_server
from commission.app.launch import open_page
from commission.app.run.actions import Repeat, VirtualDrive
from commission.app.run.service import RunService
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from tests.app.raw_client import CAMERA

BEAMS = 1081
REQUIRED = 0.15


def take_in(port: int, seconds: float, received: multiprocessing.Queue[tuple[int, int]], theme: str) -> None:
    """Receive for a while, as a browser that has its own panels; report the numbers of bytes and of pictures."""
    total, pictures = 0, 0
    protocol, cookie = Subprotocol(f"viser-v{viser.__version__}"), {"Cookie": f"{COOKIE}={theme}"}
    address = f"ws://127.0.0.1:{port}"
    with connect(address, subprotocols=[protocol], max_size=None, additional_headers=cookie) as client:
        client.send(msgspec.msgpack.encode({"type": "ViewerCameraMessage", **CAMERA}))
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            bundle = client.recv(timeout=10.0)
            # A picture of the drive has the scan in it: two thirds of the beams at least came back.
            total, pictures = total + len(bundle), pictures + (len(bundle) > BEAMS * 8)
    received.put((total, pictures))


def main(seconds: float = 20.0, theme: str = "dark") -> None:
    """Measure and print."""
    project = load_project(bundled_folder("maps") / "laboratory")
    scanner = replace(
        project.scanners[0], field_of_view_deg=(-135.0, 135.0), resolution_deg=270.0 / (BEAMS - 1), rate=25.0
    )
    project = replace(project, scanners=(scanner,))
    server = start_server("127.0.0.1", 0)
    runtime = open_page(server, project, source=VirtualDrive(project.routes[0].name))
    runtime.post(Repeat(repeat=True))
    while runtime.service(RunService).view() is None:
        time.sleep(0.1)
    received: multiprocessing.Queue[tuple[int, int]] = multiprocessing.get_context("spawn").Queue()
    client = multiprocessing.get_context("spawn").Process(
        target=take_in, args=(server.get_port(), seconds + 4.0, received, theme)
    )
    client.start()
    time.sleep(4.0)
    before, cpu, wall = runtime.service(RunService).view(), time.process_time(), time.monotonic()
    time.sleep(seconds)
    cpu, wall = time.process_time() - cpu, time.monotonic() - wall
    after = runtime.service(RunService).view()
    assert before is not None
    assert after is not None
    # The drive repeats: the cursor may have begun again.
    cycles = (after.lived - before.lived) % after.result.cycles
    size, pictures = received.get()
    took = seconds + 4.0
    print(
        f"{project.scanners[0].beam_count} beams, {cycles / wall:.1f} scans/s, {pictures / took:.1f} pictures/s, "
        f"{size / took / 1e6:.1f} MB/s"
    )
    print(f"page: {100 * cpu / wall:.1f} % of one core (required: less than {100 * REQUIRED:.0f} %)")
    client.join()
    runtime.stop()
    server.stop()


if __name__ == "__main__":
    main(*(float(argument) for argument in sys.argv[1:2]), *sys.argv[2:3])
