"""An MCAP recording of hours, 541 beams at 25 scans a second: time to open, seek in and localize it, and its memory.

The drive of a bundled site is repeated until it is as long as asked for, and recorded into a temporary folder; a
process of its own reads and localizes it: `python -m tests.benchmarks.bench_mcap [--hours 6]`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from commission.io.recordings.base import open_recording
from commission.io.recordings.recorder import write_mcap
from commission.studies.run import RunInput, judged_run, warm_up
from commission.studies.start import start_of
from tests.benchmarks.bench_memory import repeated, resident_mb, site

MEMORY_LIMIT_MB, OPEN_LIMIT_S, SEEK_LIMIT_S = 500.0, 2.0, 0.5
SEEKS = 40


def run_over(path: Path) -> None:
    """Open, seek in and localize a recording, and tell time and memory of each."""
    project = site()
    warm_up()
    told = [f"kernels {resident_mb():.0f} MB"]
    begin = time.perf_counter()
    log = open_recording(path).load()
    opened = time.perf_counter() - begin
    told.append(f"opened {resident_mb():.0f} MB ({type(log.scans[0]).__name__})")
    seeks: list[float] = []
    for index in np.random.default_rng(1).integers(0, len(log.scans[0]), SEEKS).tolist():
        begin = time.perf_counter()
        assert log.scans[0].scan(index).stamp_ns == int(log.scans[0].stamps_ns[index])
        seeks.append(time.perf_counter() - begin)
    sys.stdout.write(
        f"open {opened:.2f} s of {OPEN_LIMIT_S:g}, seek {max(seeks) * 1e3:.0f} ms at most of {SEEK_LIMIT_S * 1e3:g}\n"
    )
    sys.stdout.flush()
    begin = time.perf_counter()
    result = judged_run(RunInput.of(project, log, start_of(project, log)))
    told.append(f"localized {resident_mb():.0f} MB of {MEMORY_LIMIT_MB:g}")
    seconds = time.perf_counter() - begin
    sys.stdout.write(f"{result.cycles} cycles as one run in {seconds:.0f} s; peak after: {', '.join(told)}\n")


def main() -> None:
    """Record the file, and measure in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=6.0)
    parser.add_argument("--file", type=Path, help="an existing recording; for the process that measures")
    given = parser.parse_args()
    if given.file is not None:
        run_over(given.file)
        return
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "drive.mcap"
        begin = time.perf_counter()
        write_mcap(path, repeated(site(), given.hours))
        seconds = time.perf_counter() - begin
        sys.stdout.write(f"{given.hours:g} h, {path.stat().st_size / 1e6:.0f} MB, recorded in {seconds:.0f} s\n")
        sys.stdout.flush()
        command = [sys.executable, "-m", "tests.benchmarks.bench_mcap", "--file", str(path)]
        subprocess.run(command, check=True, env=os.environ)


if __name__ == "__main__":
    main()
