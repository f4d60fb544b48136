"""Time from the datagram that completes a scan to its estimate: a virtual vehicle sends the warehouse over loopback.

Run: `python -m tests.benchmarks.bench_live [SECONDS] [PROTOCOL]` from the checkout. At real time; the warehouse has
1,001 beams at 25 scans per second, and the drive goes on from its start until the time is over. On a busy machine the
last percent tells of the machine: its load is printed beside.
"""

from __future__ import annotations

import os
import resource
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from commission.geometry import se2
from commission.io.bundled import bundled_folder
from commission.io.live.live_run import LiveRun
from commission.io.live.registry import SourceAddress
from commission.io.live.session import Session
from commission.io.live.virtual_vehicle import Sending, addresses_of, send_drive
from commission.io.project_file import load_project
from commission.localization import localizer
from commission.simulation.scenario import records
from commission.site.records import Odometry, Record, ReferencePose

SECONDS, PROTOCOL = 60.0, "sick-safety"
BACK_S, STEP_NS = 5, 20_000_000
"""Time in which the vehicle is brought back to the start of its route [s], and interval of its odometry then [ns]."""
ALLOWED_MB = 1.0
"""Growth of the memory in a minute that is called flat: columns of 1,500 cycles with their detections [MB]."""


def laps(lap: Sequence[Record], seconds: float) -> Iterator[Record]:
    """Drive a lap again and again; in between the vehicle is brought back, without scans."""
    poses = [record.pose for record in lap if isinstance(record, ReferencePose)]
    back = se2.relative(poses[-1], poses[0])
    step = se2.exp(se2.log(back) * STEP_NS / (BACK_S * 1e9))
    begin_ns, end_ns = 0, round(seconds * 1e9)
    while True:
        for record in lap:
            if begin_ns + record.stamp_ns >= end_ns:
                return
            yield replace(record, stamp_ns=begin_ns + record.stamp_ns)
        last_ns = begin_ns + lap[-1].stamp_ns
        for number in range(1, BACK_S * 10**9 // STEP_NS + 1):
            yield Odometry(last_ns + number * STEP_NS, step)
        begin_ns = last_ns + BACK_S * 10**9 + STEP_NS


def resident_mb() -> float:
    """Memory of this program now [MB]."""
    statm = Path("/proc/self/statm")
    if statm.exists():
        return int(statm.read_text().split()[1]) * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main(seconds: float, protocol: str) -> None:
    """Measure and print."""
    project = load_project(bundled_folder("maps") / "warehouse")
    names = tuple(scanner.name for scanner in project.scanners)
    lap = list(records(project, project.routes[0].name, 1))
    localizer.warm_up()
    asked = addresses_of(SourceAddress(protocol, "127.0.0.1", 1), names, None)
    session = Session.of([SourceAddress(each.name, each.host, 0, each.scanner) for each in asked], names)
    session.start()
    run, delays, memory, sent = LiveRun(project), list[float](), list[tuple[float, float]](), list[Sending]()
    addresses = [source.address for source in session.sources]
    sender = threading.Thread(target=lambda: sent.append(send_drive(laps(lap, seconds), addresses, names)))
    sender.start()
    begin_ns = session.clock.now_ns()
    taken = estimated = 0
    while sender.is_alive():
        for record, arrived_ns in session.records(0.05):
            taken += 1
            found = run.take(record)
            estimated += len(found)
            if found:
                delays.append((session.clock.now_ns() - arrived_ns) * 1e-6)
        memory.append(((session.clock.now_ns() - begin_ns) * 1e-9, resident_mb()))
    for record in session.rest():
        taken += 1
        estimated += len(run.take(record))
    session.stop()
    estimated += len(run.end())
    report(protocol, session, sent[0], (taken, estimated), (delays, memory))


def report(
    protocol: str,
    session: Session,
    sent: Sending,
    counts: tuple[int, int],
    measured: tuple[list[float], list[tuple[float, float]]],
) -> None:
    """Print what was sent, what came of it, how quickly, and what memory it took."""
    (taken, estimated), (delays, memory) = counts, measured
    lost = sum(source.status().lost + source.status().overrun for source in session.sources)
    median, late = np.quantile(delays[25:], (0.5, 0.99))
    times, sizes = np.array(memory).T
    later = times > 0.25 * times[-1]
    slope = float(np.polyfit(times[later], sizes[later], 1)[0]) * 60.0
    flat = "flat" if slope <= ALLOWED_MB else "growing"
    load = ", ".join(f"{each:.1f}" for each in os.getloadavg())
    print(f"{protocol}: {sent.seconds:.0f} s, {sent.scans} scans sent, {estimated} estimates, {taken} records taken")
    print(f"datagram to estimate: median {median:.2f} ms, 99 % {late:.2f} ms; load {load} on {os.cpu_count()} cores")
    print(f"lost {lost}, told {dict(session.sorter.told)}")
    print(f"memory {sizes[later][0]:.0f} to {sizes[-1]:.0f} MB, {slope:+.2f} MB per minute: {flat}")


if __name__ == "__main__":
    main(
        float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS,
        sys.argv[2] if len(sys.argv) > 2 else PROTOCOL,
    )
