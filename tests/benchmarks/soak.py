"""Hours on the shop floor in minutes: a drive at 50 times real time, readers coming and going, edits, undos, jobs.

Run as `python -m tests.benchmarks.soak --minutes 30`. The server runs here; the readers, which draw nothing, in a
process of their own. Memory has to stay flat within 5 %, and threads constant, after the first fifth of the time. How
long an edit takes, from a browser's message until the state holds it, is stated.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from websockets.exceptions import WebSocketException

from commission.app.base.actions import Envelope, Redo, Sender, StopJob, Undo
from commission.app.base.server import start_server
from commission.app.launch import open_page
from commission.app.run.actions import ChooseSource, Play, SetSpeed, VirtualDrive
from commission.app.run.service import RunService
from commission.app.runtime import Runtime
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from tests.app.raw_client import RawClient

READERS = 20
SPEED = 50.0
FIELD = "Gate [%]"
VALUES = 95.0, 97.0, 99.0
"""What is entered there."""
LOST_AFTER_S = 20.0
"""Time after which an edit counts as lost [s]."""
FLAT_WITHIN = 0.05
WARM_UP = 0.2
"""Share of the time after which memory counts: until then kernels compile and buffers find their size."""


@dataclass(frozen=True, slots=True)
class Address:
    """What a raw client wants of a server."""

    port: int

    def get_port(self) -> int:
        return self.port


@dataclass(slots=True)
class Measured:
    """What was seen, in the order of time."""

    times: list[float] = field(default_factory=list)
    memory: list[float] = field(default_factory=list)
    """Of this process [MB]."""
    threads: list[int] = field(default_factory=list)
    latencies: list[float] = field(default_factory=list)
    """From a browser's message until the state holds it [s]."""
    readers: set[int] = field(default_factory=set)
    """Numbers of all browsers that were seen."""
    jobs: int = 0
    """Jobs that were started and stopped."""

    def sample(self, at: float) -> None:
        """Look at this process."""
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        self.times.append(at)
        self.memory.append(pages * 4096 / 1e6)
        self.threads.append(threading.active_count())


def read(port: int, seconds: float) -> None:
    """Be 20 browsers that come, read for some seconds, and go, until the server is gone; in a process of its own."""
    end = time.monotonic() + seconds

    def come_and_go(seed: int) -> None:
        chance = random.Random(seed)
        while time.monotonic() < end:
            try:
                reader = RawClient(Address(port))  # type: ignore[arg-type]
            except ConnectionRefusedError:
                return
            except (OSError, WebSocketException, TimeoutError):
                continue
            with suppress(OSError, WebSocketException, TimeoutError):
                leaves_at = min(end, time.monotonic() + chance.uniform(2.0, 20.0))
                try:
                    while time.monotonic() < leaves_at:
                        reader.hear(max(leaves_at - time.monotonic(), 0.1))
                        reader.heard.clear()
                finally:
                    reader.close()

    threads = [threading.Thread(target=come_and_go, args=(seed,)) for seed in range(READERS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


class Editor:
    """A browser that changes one parameter to and fro, undoes and makes again, and starts and stops jobs."""

    def __init__(self, runtime: Runtime, server: Any, route: str) -> None:
        self._runtime, self._route = runtime, route
        self._client = RawClient(server)
        threading.Thread(target=self._listen, daemon=True).start()
        inputs = server.gui._gui_input_handle_from_uuid.values()
        (self._field,) = (widget for widget in inputs if getattr(widget, "label", "") == FIELD)

    def _listen(self) -> None:
        with suppress(WebSocketException, EOFError):
            while True:
                self._client.hear()
                self._client.heard.clear()

    def edit(self) -> float:
        """Change the parameter; return how long it took until the state held it [s]."""
        # While a picture is late, the field shows what held before: neither what it shows nor what holds is an edit.
        now = self._field.value, 100.0 * self._gate()
        value = next(value for value in VALUES if not np.isclose(value, now).any())
        begun = time.perf_counter()
        self._client.update(self._field, value)
        while not np.isclose(100.0 * self._gate(), value) and time.perf_counter() - begun < LOST_AFTER_S:
            time.sleep(0.0005)
        return time.perf_counter() - begun

    def _gate(self) -> float:
        return self._runtime.state.project.parameters.association.gate_probability

    def undo(self) -> None:
        """Take a change back, make it again, and take it back."""
        browser = max(self._runtime.state.browsers, default=None)
        for action in (Undo(), Redo(), Undo()):
            self._runtime.post(Envelope(action, Sender(browser, time.monotonic())))

    def start_and_stop_a_job(self) -> None:
        """Let another drive be prepared, and stop it when it has begun."""
        self._runtime.post(ChooseSource(VirtualDrive(self._route, seed=random.randrange(1000))))
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            running = self._runtime.view().jobs
            if running:
                self._runtime.post(StopJob(running[0].number))
                return
            time.sleep(0.005)

    def close(self) -> None:
        self._client.close()


def soak(minutes: float) -> Measured:
    """Run it all and return what was measured."""
    project = load_project(bundled_folder("maps") / "warehouse")
    server = start_server("127.0.0.1", 0)
    runtime = open_page(server, project, source=VirtualDrive(project.routes[0].name))
    end = time.monotonic() + 120.0
    while runtime.service(RunService).view() is None and time.monotonic() < end:
        time.sleep(0.1)
    runtime.post(SetSpeed(SPEED))
    seconds = 60.0 * minutes
    command = [sys.executable, "-m", "tests.benchmarks.soak", "--readers-of", str(server.get_port())]
    readers = subprocess.Popen([*command, "--minutes", str(minutes)])
    measured, editor = Measured(), Editor(runtime, server, project.routes[0].name)
    started = time.monotonic()
    turn = 0
    while (now := time.monotonic() - started) < seconds:
        turn += 1
        measured.sample(now)
        measured.readers |= set(server.get_clients())
        measured.latencies.append(editor.edit())
        if turn % 3 == 0:
            editor.undo()
        if turn % 20 == 2:
            editor.start_and_stop_a_job()
            measured.jobs += 1
            runtime.post(Play(playing=True))
        time.sleep(0.5)
    readers.wait(timeout=60.0)
    editor.close()
    faults = runtime.state.faults
    runtime.stop()
    server.stop()
    assert faults == (), faults
    return measured


def main() -> int:
    """Print what was measured; return 1 where an edit was lost, or memory or threads have grown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0, help="how long")
    parser.add_argument("--readers-of", type=int, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.readers_of is not None:
        read(asked.readers_of, 60.0 * asked.minutes)
        return 0
    found = soak(asked.minutes)
    settled = np.array(found.times) > WARM_UP * 60.0 * asked.minutes
    memory, threads = np.array(found.memory)[settled], np.array(found.threads)[settled]
    third = max(len(memory) // 3, 1)
    before, after = float(np.median(memory[:third])), float(np.median(memory[-third:]))
    middle, slow, slowest = np.percentile(found.latencies, (50, 95, 100)) * 1e3
    print(
        f"{asked.minutes:g} min, {len(found.readers)} browsers, {len(found.latencies)} edits, {found.jobs} jobs stopped"
    )
    print(f"memory {before:.0f} MB in the first third, {after:.0f} MB in the last ({after / before - 1:+.1%})")
    print(f"threads {threads.min()} to {threads.max()}")
    print(f"an edit takes {middle:.0f} ms, 95 % within {slow:.0f} ms, the slowest {slowest:.0f} ms")
    lost = sum(latency > LOST_AFTER_S for latency in found.latencies)
    if lost:
        print(f"{lost} edits were lost")
    has_grown = after > before * (1.0 + FLAT_WITHIN) or threads[-third:].max() > threads[:third].max()
    return int(has_grown or lost > 0)


if __name__ == "__main__":
    raise SystemExit(main())
