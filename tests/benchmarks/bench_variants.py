"""A sweep of 400 gates over 15,000 cycles, on all cores: seconds, beside what each variant costs by itself.

Run: `python -m tests.benchmarks.bench_variants [VARIANTS]` from the checkout. The drive of `bench_filter` with a
reference pose at each scan; the figure is the RMS error. Peers in the same run: each variant localized and judged
whole, and a loop over filterpy's EKF, of which the first cycles are done. Required: 5 s on two cores.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np

from commission.localization.run_columns import RunSegment
from commission.studies.run import RunInput, judged_run, warm_up
from commission.studies.start import Start, StartOrigin
from commission.studies.sweep import SweepAxis, SweepInput, sweep
from commission.studies.workers import Threads
from tests.benchmarks.bench_filter import PEER_CYCLES, drive, hall, peer_seconds

VARIANTS, CYCLES = 400, 15_000
WHOLE = 20
"""Variants that are localized and judged whole, evenly among all."""


def main(variants: int = VARIANTS) -> None:
    """Measure and print."""
    warm_up()
    setup = hall(20)
    log, initial = drive(setup, CYCLES)
    inputs = RunInput(log=log, start=Start(initial, StartOrigin.GIVEN), segments=(RunSegment(0, setup),))
    poses = judged_run(inputs).columns.means + np.array([0.003, -0.002, 0.001])
    log = replace(log, reference_stamps_ns=log.detection_stamps_ns, reference_poses=poses)
    inputs = replace(inputs, log=log)
    axis = SweepAxis("association.gate_probability", np.linspace(0.5, 0.999, variants))
    workers = Threads()
    began, worked = time.perf_counter(), time.process_time()
    found = sweep(SweepInput(run=inputs, axes=(axis,), figure="position_rmse_m"), workers=workers)
    took, worked = time.perf_counter() - began, time.process_time() - worked
    rows = np.linspace(0, variants - 1, min(WHOLE, variants)).astype(int)
    whole = time.process_time()
    for row in rows:
        gate = replace(setup.parameters.association, gate_probability=float(axis.values[row]))
        moved = replace(setup, parameters=replace(setup.parameters, association=gate))
        statistics = judged_run(inputs.with_setup(moved)).statistics
        assert statistics is not None
        assert statistics.position_rmse == found.values[row], row
    whole = (time.process_time() - whole) / len(rows) * variants
    print(
        f"{variants} gates over {CYCLES} cycles of 5 detections: {took:.1f} s on {workers.count} cores (<= 5 s), "
        f"{worked:.1f} s of processor time, {1e6 * worked / variants / CYCLES:.2f} us per cycle"
    )
    print(f"each localized and judged whole, same errors: {whole:.1f} s of processor time, ratio {whole / worked:.2f}")
    peer, _ = peer_seconds(log, setup, initial, PEER_CYCLES)
    peer *= CYCLES / PEER_CYCLES * variants
    print(f"filterpy and numpy, {PEER_CYCLES} cycles scaled: {peer:.0f} s, ratio {peer / worked:.0f}")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))
