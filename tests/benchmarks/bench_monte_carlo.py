"""Virtual drives of the warehouse with and without beams, in one run: seconds of processor time for ten minutes driven.

Run: `python -m tests.benchmarks.bench_monte_carlo [DRIVES]` from the checkout. Each drive is simulated, localized and
judged; its peer is the same drive beam by beam, of which only the beams that can meet a reflector are cast. Required: a
thousand drives of ten minutes in 30 s on two cores, which is 0.06 s of processor time each.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from commission.io.project_file import load_project
from commission.simulation.random_faults import FaultRates
from commission.studies.monte_carlo import monte_carlo, warm_up
from commission.studies.monte_carlo_figures import Detecting, MonteCarloInput
from commission.studies.workers import Threads

WAREHOUSE = Path(__file__).parents[2] / "maps" / "warehouse"


def main(drives: int = 40) -> None:
    """Measure and print."""
    project = load_project(WAREHOUSE)
    rates = FaultRates(people=0, glints=0.0)
    warm_up()
    took: dict[Detecting, float] = {}
    for detecting, runs in ((Detecting.SHADOWS, drives), (Detecting.BEAMS, max(4, drives // 10))):
        seconds = []
        for count in (4, 4 + runs):  # of both the preparation is the same, and goes out of the difference
            inputs = MonteCarloInput(
                project=project,
                routes=tuple(each.name for each in project.routes),
                runs=count,
                rates=rates,
                detecting=detecting,
            )
            began = time.process_time()
            found = monte_carlo(inputs, workers=Threads(1))
            seconds.append((time.process_time() - began, float(found.column("duration").sum())))
        (short, few), (long, many) = seconds
        took[detecting] = 600.0 * (long - short) / (many - few)
        print(
            f"{detecting}: {took[detecting]:.3f} s of processor time for ten minutes driven at 25 scans/s", flush=True
        )
    print(f"ratio {took[Detecting.BEAMS] / took[Detecting.SHADOWS]:.1f}")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))
