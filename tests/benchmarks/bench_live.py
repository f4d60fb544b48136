"""Time from the datagram that completes a scan to its estimate: a virtual vehicle sends the warehouse over loopback.

Run: `python -m tests.benchmarks.bench_live [SECONDS] [PROTOCOL]` from the checkout. At real time; the warehouse has
1,001 beams at 25 scans per second, and the drive goes on from its start until the time is over. It ends with 1 where a
record was lost. On a busy machine the last percent tells of the machine: its load is printed beside, and how slow the
last percent is without the time that threads waited for a core.
"""

from __future__ import annotations

import json
import os
import resource
import socket
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from commission.geometry import se2
from commission.io.bundled import bundled_folder
from commission.io.live.accounts import RecordAccount
from commission.io.live.live_run import LiveRun
from commission.io.live.registry import SourceAddress
from commission.io.live.session import Session
from commission.io.live.virtual_vehicle import Sending, addresses_of, send_drive
from commission.io.project_file import load_project
from commission.localization import localizer
from commission.simulation.scenario import records
from commission.site.records import Odometry, Record, ReferencePose

SECONDS, PROTOCOL, SEND = 60.0, "sick-safety", "--send"
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


@dataclass(slots=True)
class Measured:
    """What was seen while records came."""

    taken: int = 0
    estimated: int = 0
    delays: list[float] = field(default_factory=list)
    """From the datagram that completes a scan to its estimate [ms]."""
    waited: list[float] = field(default_factory=list)
    """Time that threads of this program had waited for a core by then [ms]."""
    memory: list[tuple[float, float]] = field(default_factory=list)
    """Time [s] and size [MB]."""


def waited_for_a_core_ms() -> float:
    """Time for which threads of this program could have run and had no core, by the system's count [ms]; else 0."""
    total = 0
    for task in Path("/proc/self/task").glob("*/schedstat"):
        with suppress(OSError):
            total += int(task.read_text().split()[1])
    return total * 1e-6


def resident_mb() -> float:
    """Memory of this program now [MB]."""
    statm = Path("/proc/self/statm")
    if statm.exists():
        return int(statm.read_text().split()[1]) * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def listening_at(address: SourceAddress) -> SourceAddress:
    """Return an address with a port that is free: a listener finds one itself, who connects has to be told."""
    port = 0
    if address.kind.transport != "udp":
        with socket.create_server((address.host, 0)) as server:
            port = server.getsockname()[1]
    return SourceAddress(address.name, address.host, port, address.scanner)


def main(seconds: float, protocol: str) -> int:
    """Measure and print; return 1 where a record was lost."""
    project = load_project(bundled_folder("maps") / "warehouse")
    names = tuple(scanner.name for scanner in project.scanners)
    localizer.warm_up()
    asked = addresses_of(SourceAddress(protocol, "127.0.0.1", 1), names, None)
    session = Session.of([listening_at(each) for each in asked], names)
    session.start()
    run, measured, clock = LiveRun(project), Measured(), session.clock
    run.prepare()
    # In a process of its own: it would otherwise take this one's time, and be late itself.
    command = [sys.executable, "-m", "tests.benchmarks.bench_live", SEND, f"{seconds:g}"]
    command += [str(source.address) for source in session.sources]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as sender:
        begin_ns, looked_ns = clock.now_ns(), 0
        while sender.poll() is None:
            for record, arrived_ns in session.records(0.05):
                measured.taken += 1
                found = run.take(record)
                if found:
                    measured.estimated += len(found)
                    measured.delays.append((clock.now_ns() - arrived_ns) * 1e-6)
                    measured.waited.append(waited_for_a_core_ms())
            if clock.now_ns() - looked_ns > 10**9:
                looked_ns = clock.now_ns()
                measured.memory.append(((looked_ns - begin_ns) * 1e-9, resident_mb()))
        sent = Sending(*json.loads(sender.stdout.read() if sender.stdout is not None else ""))
    session.stop()
    for record in session.rest():
        measured.taken += 1
        measured.estimated += len(run.take(record))
    measured.estimated += len(run.end())
    return report(protocol, session, sent, measured)


def send(seconds: float, addresses: Sequence[SourceAddress]) -> None:
    """Be the vehicle, and print what was sent."""
    project = load_project(bundled_folder("maps") / "warehouse")
    names = tuple(scanner.name for scanner in project.scanners)
    lap = list(records(project, project.routes[0].name, 1))
    sent = send_drive(laps(lap, seconds), addresses, names)
    sys.stdout.write(json.dumps([sent.records, sent.scans, sent.seconds]))


def report(protocol: str, session: Session, sent: Sending, measured: Measured) -> int:
    """Print what was sent, what came of it, how quickly, and what memory it took; return 1 where a record was lost."""
    statuses = [source.status() for source in session.sources]
    late = Counter[type[Record]]()
    for (_, kind), count in session.sorter.too_late.items():
        late[kind] += count
    account = RecordAccount.of(statuses, measured.taken, late)
    delays, waited = np.array(measured.delays), np.diff(measured.waited, prepend=measured.waited[0])
    # Of an estimate that is slow although no thread of the program waited for a core, the program is at fault.
    own = np.maximum(delays - waited, 0.0)[25:]
    quick = ", ".join(f"{share:.0%} {np.quantile(delays[25:], share):.2f} ms" for share in (0.5, 0.95, 0.99))
    times, sizes = np.array(measured.memory).T
    later = times > 0.25 * times[-1]
    slope = float(np.polyfit(times[later], sizes[later], 1)[0]) * 60.0
    load = ", ".join(f"{each:.1f}" for each in os.getloadavg())
    missing = sent.records - measured.taken
    lines = (
        f"{protocol}: {sent.seconds:.0f} s; load {load} on {os.cpu_count()} cores",
        f"records sent {sent.records}, decoded {account.received}, localized {account.taken}; "
        f"scans sent {sent.scans}, estimates {measured.estimated}",
        f"lost {missing}: {account.text}; told {dict(session.sorter.told)}",
        f"datagram to estimate: {quick}; 99 % without the time that threads waited for a core "
        f"{np.quantile(own, 0.99):.2f} ms",
        f"memory {sizes[later][0]:.0f} to {sizes[-1]:.0f} MB, {slope:+.2f} MB per minute: "
        f"{'flat' if slope <= ALLOWED_MB else 'growing'}",
    )
    sys.stdout.write("\n".join(lines) + "\n")
    return int(missing != 0 or measured.estimated != sent.scans)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    if arguments and arguments[0] == SEND:
        send(float(arguments[1]), [SourceAddress.parse(text) for text in arguments[2:]])
        raise SystemExit(0)
    raise SystemExit(main(float((arguments or [SECONDS])[0]), (arguments[1:] or [PROTOCOL])[0]))
