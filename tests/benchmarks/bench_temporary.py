"""Processor time of a cycle with 100 temporary landmarks, beside a plain EKF-SLAM in numpy that corrects by as many.

Run from the checkout: `python -m tests.benchmarks.bench_temporary`. Exits 1 above 1 ms a cycle, or when a site with
3,000 reflectors more takes a third longer.
"""

# pyright: basic

from __future__ import annotations

import dataclasses
import sys
import time

import numpy as np

from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.site.disturbances import Reel
from commission.site.parameters import TemporaryParameters
from commission.site.reflectors import Reflector, ReflectorMap
from tests.localization.plain_slam import PlainSlam
from tests.paper_warehouse import yard

LONGEST_US, ROUNDS = 1000.0, 5
KNOWN, MATCHED = 6, 2
"""Columns of what became of a cycle's landmarks."""


def best_us(driven, most: int) -> tuple[float, np.ndarray]:
    """Shortest time of a cycle over whole runs [us], and what became of its landmarks."""
    own = TemporaryParameters(enabled=most > 0, most=most, reach=60.0)
    parameters = dataclasses.replace(driven.project.parameters, temporary=own)
    setup = dataclasses.replace(LocalizerSetup.of(driven.project), parameters=parameters)
    times, columns = [], run(driven.log, setup, driven.start)
    for _ in range(ROUNDS):
        before = time.thread_time()
        columns = run(driven.log, setup, driven.start)
        times.append(1e6 * (time.thread_time() - before) / len(columns))
    return min(times), columns.temporary


def plain_us(known: int, matched: int) -> float:
    """Time that a textbook filter of that size takes for so many sightings [us]."""
    plain, rng, R = PlainSlam(np.zeros(3), 1e-4 * np.eye(3)), np.random.default_rng(1), 1e-4 * np.eye(2)
    for _ in range(known):
        plain.add(rng.normal(0.0, 10.0, 2), R)
    times = []
    for _ in range(ROUNDS):
        before = time.thread_time()
        for k in range(matched):
            plain.sight(k, plain.rotation().T @ (plain.mean[3 + 2 * k : 5 + 2 * k] - plain.mean[:2]), R)
        times.append(1e6 * (time.thread_time() - before))
    return min(times)


def main() -> int:
    """Print the figures; return the exit code."""
    rng = np.random.default_rng(3)
    spots = [(x, y) for x in np.arange(-12.0, 70.0, 4.0) for y in np.arange(-18.0, 19.0, 4.0) if abs(y) > 3.0]
    reels = tuple(Reel(x=float(x + rng.normal(0, 0.3)), y=float(y + rng.normal(0, 0.3))) for x, y in spots)
    driven = yard(1, reels, seconds=40.0)
    far = tuple(Reflector(id=f"F{k}", x=500.0 + 3.0 * (k % 60), y=3.0 * (k // 60), radius=0.05) for k in range(3000))
    mapped = ReflectorMap((*driven.project.reflectors.reflectors, *far))
    large = driven._replace(project=dataclasses.replace(driven.project, reflectors=mapped))
    off, _ = best_us(driven, 0)
    on, figures = best_us(driven, 100)
    there, _ = best_us(large, 100)
    late = figures[len(figures) // 2 :]
    known, matched = int(late[:, KNOWN].max()), int(late[:, MATCHED].mean())
    plain = plain_us(known, matched)
    print(f"without the kind {off:.0f} us a cycle of 541 beams")
    print(f"with up to {known} landmarks, {matched} of them seen in a scan: {on:.0f} us a cycle")
    print(f"plain EKF-SLAM in numpy, its corrections alone: {plain:.0f} us; ratio {plain / on:.1f}")
    print(f"with 3,000 reflectors more elsewhere {there:.0f} us; ratio {there / on:.2f}")
    return int(on > LONGEST_US or there > 1.33 * on)


if __name__ == "__main__":
    sys.exit(main())
