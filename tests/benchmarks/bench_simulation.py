"""How fast virtual drives are: one scan with walls alone, and a whole drive with fifty people, against real time."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from commission.simulation import scenario
from commission.simulation.scan import VirtualScanner
from commission.site.disturbances import Disturbances
from commission.site.scanner import Scanner
from tests.simulation.halls import hall

SCANNER = Scanner(field_of_view_deg=(-135.0, 135.0), resolution_deg=0.25)
"""1,081 beams."""


def main() -> None:
    scenario.warm_up()
    project = hall(scanner=SCANNER)
    virtual, rng, nobody = VirtualScanner.of(project, project.scanners[0]), np.random.default_rng(0), np.empty((0, 3))
    poses = np.column_stack([rng.uniform(2, 10, 2000), rng.uniform(2, 6, 2000), rng.uniform(-3, 3, 2000)])
    start = time.perf_counter()
    for pose in poses:
        virtual.scan(pose, nobody, rng)
    seconds = time.perf_counter() - start
    print(f"scan of {SCANNER.beam_count} beams: {seconds / len(poses) * 1e6:.0f} us")
    virtual.bright_scan(poses[0], nobody, rng)
    start = time.perf_counter()
    for pose in poses:
        virtual.bright_scan(pose, nobody, rng)
    seconds = time.perf_counter() - start
    print(f"the same with intensities: {seconds / len(poses) * 1e6:.0f} us")
    for people in (0, 50):
        crowded = replace(project, disturbances=Disturbances(people=people))
        start = time.perf_counter()
        log = scenario.virtual_drive(crowded, project.routes[0].name, 0)
        seconds = time.perf_counter() - start
        driven = 1e-9 * (log.last_ns - log.first_ns)
        scans = len(log.reference_stamps_ns)
        print(
            f"drive with {people} people: {seconds / scans * 1e6:.0f} us per scan, {driven / seconds:.0f} x real time"
        )


if __name__ == "__main__":
    main()
