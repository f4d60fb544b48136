"""Resident memory of a run over hours: a drive of 541 beams at 25 scans a second, read, localized, and shown.

The drive of a bundled site is repeated until it is as long as asked for, and written in blocks into a temporary folder;
a process of its own reads, localizes and shows it: `python -m tests.benchmarks.bench_memory [--hours 6]`.
"""

from __future__ import annotations

import argparse
import itertools
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from commission.app.run.playback import Playback
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.io.recordings.base import load_log
from commission.io.recordings.csv_writer import write_recording
from commission.simulation.scenario import virtual_drive
from commission.site.project import Project
from commission.site.records import Record
from commission.studies.run import RunInput, judged_run, warm_up
from commission.studies.start import start_of

LIMIT_MB = 500.0
"""What the run may need."""


def site() -> Project:
    """The laboratory, with a scanner of 541 beams."""
    project = load_project(bundled_folder("maps") / "laboratory")
    scanner = replace(project.scanners[0], field_of_view_deg=(-135.0, 135.0), resolution_deg=0.5, rate=25.0)
    return replace(project, scanners=(scanner,))


def repeated(project: Project, hours: float) -> Iterator[Record]:
    """Records of one drive after the other, from the same start to the same end."""
    drive = list(virtual_drive(project, project.routes[0].name, 1).records())
    period_ns = drive[-1].stamp_ns + 20_000_000
    for turn in itertools.count():
        for record in drive:
            stamp_ns = record.stamp_ns + turn * period_ns
            if stamp_ns > hours * 3600e9:
                return
            yield replace(record, stamp_ns=stamp_ns)


def resident_mb() -> float:
    """Peak of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def run_over(folder: Path) -> None:
    """Read, localize and show a recording, and tell the memory after each step."""
    project, told = site(), []
    warm_up()
    told.append(f"kernels {resident_mb():.0f} MB")
    begin = time.perf_counter()
    log = load_log(folder)
    told.append(f"read {resident_mb():.0f} MB ({type(log.scans[0]).__name__})")
    result = judged_run(RunInput.of(project, log, start_of(project, log)))
    told.append(f"localized {resident_mb():.0f} MB")
    playback = Playback(result)
    for share in (0.1, 0.9, 0.5, 1.0):
        playback.seek(share * result.duration)
        assert len(playback.view(covered=False).scan_map)
    seconds = time.perf_counter() - begin
    peak = resident_mb()
    told.append(f"shown {peak:.0f} MB of {LIMIT_MB:.0f}: {'kept' if peak < LIMIT_MB else 'NOT KEPT'}")
    sys.stdout.write(f"{result.cycles} cycles in {seconds:.0f} s; peak after: {', '.join(told)}\n")


def main() -> None:
    """Write the recording, and measure in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=6.0)
    parser.add_argument("--folder", type=Path, help="an existing recording; for the process that measures")
    given = parser.parse_args()
    if given.folder is not None:
        run_over(given.folder)
        return
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        write_recording(folder, repeated(site(), given.hours))
        size = (folder / "scans.npz").stat().st_size
        sys.stdout.write(f"{given.hours:g} h, scans.npz {size / 1e6:.0f} MB\n")
        sys.stdout.flush()
        command = [sys.executable, "-m", "tests.benchmarks.bench_memory", "--folder", str(folder)]
        subprocess.run(command, check=True, env=os.environ)


if __name__ == "__main__":
    main()
