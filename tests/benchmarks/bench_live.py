"""Time from the datagram that completes a scan to its estimate: a virtual vehicle sends the warehouse over loopback.

Run: `python -m tests.benchmarks.bench_live [SECONDS] [PROTOCOL]` from the checkout. At real time; the warehouse has
1,001 beams at 25 scans per second. On a busy machine the last percent tells of the machine.
"""

from __future__ import annotations

import itertools
import resource
import sys
import threading

import numpy as np

from commission.io.bundled import bundled_folder
from commission.io.live.live_run import LiveRun
from commission.io.live.registry import SourceAddress
from commission.io.live.session import Session
from commission.io.live.virtual_vehicle import addresses_of, send_drive
from commission.io.project_file import load_project
from commission.localization import localizer
from commission.simulation.scenario import records

SECONDS, PROTOCOL = 60.0, "sick-safety"


def main(seconds: float, protocol: str) -> None:
    """Measure and print."""
    project = load_project(bundled_folder("maps") / "warehouse")
    names = tuple(scanner.name for scanner in project.scanners)
    whole = records(project, project.routes[0].name, 1)
    drive = list(itertools.takewhile(lambda record: record.stamp_ns < seconds * 1e9, whole))
    localizer.warm_up()
    asked = addresses_of(SourceAddress(protocol, "127.0.0.1", 1), names, None)
    session = Session.of([SourceAddress(each.name, each.host, 0, each.scanner) for each in asked], names)
    session.start()
    run, delays, memory = LiveRun(project), list[float](), list[int]()
    arguments = drive, [source.address for source in session.sources], names
    sender = threading.Thread(target=send_drive, args=arguments)
    sender.start()
    while sender.is_alive():
        for record, arrived_ns in session.records(0.05):
            if run.take(record):
                delays.append((session.clock.now_ns() - arrived_ns) * 1e-6)
        memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    session.stop()
    median, late = np.quantile(delays[25:], (0.5, 0.99))
    lost = sum(source.status().lost + source.status().overrun for source in session.sources)
    grown = (memory[-1] - memory[len(memory) // 4]) / 1024.0
    print(f"{protocol}: {len(delays)} estimates, datagram to estimate median {median:.2f} ms, 99 % {late:.2f} ms")
    print(f"lost {lost}, told {dict(session.sorter.told)}, memory grown by {grown:.1f} MB in the last three quarters")


if __name__ == "__main__":
    main(
        float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS,
        sys.argv[2] if len(sys.argv) > 2 else PROTOCOL,
    )
