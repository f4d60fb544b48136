"""A run of six hours on the page: seek to any time of it, and a moved gate until its curves are ready to be drawn.

Run: `python -m tests.benchmarks.bench_run [CYCLES]` from the checkout. Server side: what the owner thread does for a
seek, and what job and owner thread do between an edit and the arrays that the plots send. The drive of `bench_filter`
with a reference pose at each scan. Required: less than 50 ms, and less
than 1 s; of a zoom less than 100 ms.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np

from commission.app.base.carrier import as_text
from commission.app.run.charts import CHARTS
from commission.app.run.drawn_curves import drawn, values_at
from commission.app.run.playback import Playback
from commission.localization.run_columns import RunSegment
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import AssociationParameters, Parameters
from commission.studies.run import RunInput, RunResult, judged_run, warm_up
from commission.studies.start import Start, StartOrigin
from tests.benchmarks.bench_filter import CYCLES, drive, hall

SEEKS = 200


def curves_of(result: RunResult) -> str:
    """What the plots send of another run, or of another zoom: the whole drive is the most."""
    return as_text(drawn(result, CHARTS, (0.0, result.duration)))


def main(cycles: int = CYCLES) -> None:
    """Measure and print."""
    warm_up()
    setup = hall(20)
    log, initial = drive(setup, cycles)
    start = Start(initial, StartOrigin.GIVEN)
    result = judged_run(RunInput(log=log, start=start, segments=(RunSegment(0, setup),)))
    poses = result.columns.means + np.array([0.003, -0.002, 0.001])
    log = replace(log, reference_stamps_ns=log.detection_stamps_ns, reference_poses=poses)
    result = judged_run(RunInput(log=log, start=start, segments=(RunSegment(0, setup),)))
    playback = Playback(result)
    playback.view(covered=False)
    curves_of(result)
    times = []
    for seconds in np.random.default_rng(0).uniform(0.0, result.duration, SEEKS):
        began = time.perf_counter()
        playback.seek(float(seconds))
        view = playback.view(covered=False)
        values_at(result, CHARTS, view.newest)
        times.append(time.perf_counter() - began)
    print(f"seek, {cycles} cycles: median {1e3 * np.median(times):.2f} ms, longest {1e3 * max(times):.2f} ms (< 50 ms)")
    times = []
    for _ in range(20):
        began = time.perf_counter()
        text = curves_of(result)
        times.append(time.perf_counter() - began)
    median, longest, size = 1e3 * float(np.median(times)), 1e3 * max(times), len(text) // 1000
    print(f"all plots over all of it: median {median:.1f} ms, longest {longest:.1f} ms (< 100 ms), {size} kB")
    for gate in (0.9, 0.8, 0.99):
        narrow = Parameters(association=AssociationParameters(gate_probability=gate))
        began = time.perf_counter()
        moved = LocalizerSetup(reflectors=setup.reflectors, scanners=setup.scanners, parameters=narrow)
        again = judged_run(result.inputs.with_setup(moved), earlier=result)
        localized = time.perf_counter() - began
        playback.replace(again)
        playback.view(covered=False)
        curves_of(again)
        took = time.perf_counter() - began
        print(f"moved gate to curves: {took:.2f} s, localized and judged after {localized:.2f} s (< 1 s)")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))
