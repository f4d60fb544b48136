"""Prediction against reality: predicted 1-sigma and stops against seeded virtual drives, metre by metre.

    python -m tests.benchmarks.bench_prediction [DRIVES]

Prints for every route of the bundled sites without people, 200 drives each: the ratio of predicted sigma to RMS error
of position and heading (median over the metres, share of metres between 0.8 and 1.25), and the share of metres of all
drives in which the supervisor stops the vehicle, or lets it drive, as predicted. The bundled layouts never stop it;
so the same again with a part of their reflectors. Last, how much faster a prediction is than a drive.

Exits 1 when a median lies outside 0.95 to 1.05, less than 90 % of the metres inside, or an agreement is below 95 %. In
the thinned layouts only the agreement is required: where one reflector is in sight or none, the error of a drive
depends on the way it went astray, and 200 drives say little.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np

from commission.planning.error_budget import predict_errors
from commission.planning.route_prediction import predict_route
from tests.planning.driven import (
    SITES,
    Comparison,
    PerMetre,
    compare,
    driven_along,
    planned_route,
    thinned,
    undisturbed,
)

THINNED = (("shop_floor", 16), ("warehouse", 6))
"""Sites and which of their reflectors are left: every so many."""


AT_ONCE = 10
"""Drives that a process makes before it reports."""


def drive(site: str, keep: int, route: str, length: float, first: int) -> list[PerMetre]:
    """Some drives, in a process of their own."""
    project = thinned(undisturbed(site), keep)
    return [driven_along(project, route, length, seed) for seed in range(first, first + AT_ONCE)]


def measure(pool: ProcessPoolExecutor, site: str, keep: int, route: str, drives: int) -> Comparison:
    """Drive a route often and compare."""
    planned = planned_route(thinned(undisturbed(site), keep), route)
    parts = pool.map(partial(drive, site, keep, route, planned.drive.length), range(0, drives, AT_ONCE))
    return compare(planned, [each for part in parts for each in part][:drives])


def row(name: str, route: str, given: Comparison) -> str:
    """One line of the table."""
    cells = [f"{np.median(given.ratio(of)):.3f} | {100.0 * given.inside(of):.0f} %" for of in ("position", "heading")]
    stopped = 100.0 * given.predicted.stops.mean(), 100.0 * given.driven.stops.mean()
    return (
        f"| {name} | {route} | {len(given)} | {given.drives} | {' | '.join(cells)} | "
        f"{stopped[0]:.0f} / {stopped[1]:.0f} % | {100.0 * given.agreement:.1f} % |"
    )


def is_good(given: Comparison) -> bool:
    """Whether the requirement is met."""
    medians = [float(np.median(given.ratio(of))) for of in ("position", "heading")]
    shares = [given.inside(of) for of in ("position", "heading")]
    return all(0.95 <= m <= 1.05 for m in medians) and min(shares) >= 0.9 and given.agreement >= 0.95


def speed() -> str:
    """How much faster a prediction is than a drive with its localization."""
    project = undisturbed("warehouse")
    route = project.routes[0].name
    planned = planned_route(project, route)
    times: list[float] = []
    for work in (
        lambda: predict_route(planned),
        lambda: predict_errors(planned, predict_route(planned)),
        lambda: driven_along(project, route, planned.drive.length, 0),
    ):
        work()
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return (
        f"warehouse, {route}: a drive {times[2]:.2f} s; what the filter will say {times[2] / times[0]:.0f} times "
        f"faster, its error {times[2] / times[1]:.0f} times"
    )


def main(arguments: Sequence[str]) -> int:
    """Print the table; return the exit code."""
    drives = int(arguments[0]) if arguments else 200
    good = True
    print("| site | route | metres | drives | position | inside | heading | inside | stopped | agreement |")
    print("|---|---|---|---|---|---|---|---|---|---|", flush=True)
    with ProcessPoolExecutor(2) as pool:
        for site in SITES:
            for route in undisturbed(site).routes:
                given = measure(pool, site, 1, route.name, drives)
                good &= is_good(given)
                print(row(site, route.name, given), flush=True)
        for site, keep in THINNED:
            for route in undisturbed(site).routes:
                given = measure(pool, site, keep, route.name, drives)
                good &= given.agreement >= 0.95
                print(row(f"{site}, every {keep}th reflector", route.name, given), flush=True)
    print(speed())
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
