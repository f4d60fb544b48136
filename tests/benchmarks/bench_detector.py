"""Time of the reflector detector per scan: serial, on all cores, and with the paper's central beam.

Run: `python -m tests.benchmarks.bench_detector [SCANS]` from the checkout. Each scan holds five posts.
"""

from __future__ import annotations

import math
import sys
import time

import numpy as np

from commission.localization.detection_log import detect_log
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import DetectorParameters, Parameters
from commission.site.record_store import ScanLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

RADIUS = 0.04


def scans(count: int, beams: int) -> ScanLog:
    """Scans over 270 degrees with five posts at 1 to 9 m."""
    rng = np.random.default_rng(0)
    increment = math.radians(270.0) / (beams - 1)
    ranges = np.full((count, beams), 12.0, dtype=np.float32)
    flags = np.zeros((count, beams), dtype=np.bool_)
    for k in range(count):
        for distance, middle in zip(rng.uniform(1.0, 9.0, 5), rng.permutation(9)[:5], strict=True):
            half = max(1, int(math.asin(RADIUS / distance) / increment))
            center = int((middle + 0.5) * beams / 9)
            flags[k, center - half : center + half] = True
            ranges[k, center - half : center + half] = distance + rng.normal(0.0, 0.01, 2 * half)
    stamps = 40_000_000 * np.arange(count, dtype=np.int64)
    return ScanLog.even(stamps, ranges, (-math.radians(135.0), increment), reflector=flags)


def best(log: ScanLog, setup: LocalizerSetup, *, parallel: bool) -> float:
    """Microseconds per scan, best of five: processor time of the serial version, wall time of the parallel one."""
    clock = time.perf_counter if parallel else time.process_time
    detect_log(log, setup, parallel=parallel)
    least = math.inf
    for _ in range(5):
        start = clock()
        detect_log(log, setup, parallel=parallel)
        least = min(least, clock() - start)
    return least / len(log.stamps_ns) * 1e6


def main(count: int = 20_000) -> None:
    """Print one line per number of beams."""
    posts = ReflectorMap((Reflector(id="A", x=0.0, y=0.0, radius=RADIUS),))
    for beams in (541, 2751):
        log = scans(count, beams)
        circle = LocalizerSetup(reflectors=posts, scanners=(Scanner(),), parameters=Parameters())
        central = LocalizerSetup(
            reflectors=posts,
            scanners=(Scanner(),),
            parameters=Parameters(detector=DetectorParameters(center="central_beam")),
        )
        print(
            f"{beams} beams: circle fit {best(log, circle, parallel=False):.2f} us/scan, "
            f"{best(log, circle, parallel=True):.2f} on all cores; "
            f"central beam {best(log, central, parallel=False):.2f} us/scan"
        )


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))
