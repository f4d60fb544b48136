"""What sweeps cost the localizer on the warehouse, corrected and neglected: the table of the README.

Run: `python -m tests.benchmarks.bench_sweeps [MILLISECONDS]` from the checkout: sweeps of one duration, or of all.
Seeds count from 0: one drive at 25 scans/s, three at 8 scans/s, about as many scans.
"""

from __future__ import annotations

import sys
from pathlib import Path

from commission.io.project_file import load_project
from tests.acceptance.swept import RATES, fields_of, swept

DRIVES = {0.04: 1, 0.125: 3}
"""Drives of each duration [s]."""
WAREHOUSE = Path(__file__).parents[2] / "maps" / "warehouse"


def main() -> None:
    """Print one line per case."""
    chosen = {float(each) for each in sys.argv[1:]} or {1e3 * duration for duration in RATES}
    project = load_project(WAREHOUSE)
    for duration, rate in RATES.items():
        for name, fields in fields_of(duration).items() if 1e3 * duration in chosen else ():
            # Without a sweep there is nothing to neglect.
            found = swept(project, fields, range(DRIVES[duration]), neglect="sweep_duration" in fields)
            sweep = f"{rate:g} scans/s, {1e3 * fields.get('sweep_duration', 0.0):g} ms"
            errors = f"{1e3 * found.corrected:.2f} mm | {1e3 * found.neglected:.1f} mm"
            print(f"| {sweep} | {name} | {errors} |", flush=True)


if __name__ == "__main__":
    main()
