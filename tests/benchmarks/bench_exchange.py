"""Suggested layouts against plain random exchange with the same checks, from nothing on the bundled sites.

    python -m tests.benchmarks.bench_exchange [SECONDS] [SITE ...] [--exact]

The peer takes out reflectors at random as long as all demands hold, then exchanges one or two for any other ones, or
two for one, and keeps what holds and is no larger. It judges by the whole predictions of `LayoutLimits`, with the same
leeway. With --exact the constants are known exactly, otherwise as the default `uncertainty:` says. Seconds are those of
the processor, not of the clock: a machine that is shared slows both alike.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np

from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.planning.layout_limits import LayoutLimits
from commission.planning.placement import Demands, Placement, PlacementOptions, place
from commission.planning.route_prediction import plan_route
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from tests.planning.driven import EXACT

SITES = ("laboratory", "shop_floor", "warehouse")
LIMITS = (0.005, 0.006, 0.008)
SECONDS = 60.0


class RandomExchange:
    """The peer: what holds, and the smallest layout that it has come to."""

    def __init__(self, project: Project, demands: Demands, centers: np.ndarray) -> None:
        radius = PlacementOptions().candidates.radius
        every = tuple(Reflector(id=f"C{i}", x=x, y=y, radius=radius) for i, (x, y) in enumerate(centers.tolist()))
        site = replace(project, reflectors=ReflectorMap(every))
        models = vehicle_visibility(site).models
        planned = [plan_route(site, route.name, models=models) for route in site.routes]
        self._limits = LayoutLimits(planned, site, demands, lambda: None)
        self._limits.allow_what_little_keeps()
        self._sees = np.unique(np.concatenate([route.sees() for route in planned]), axis=0).astype(np.int64)
        self._needed = np.minimum(demands.visible + demands.survive_failure, self._sees.sum(axis=1))
        delta = centers[:, np.newaxis] - centers
        self._near = (np.hypot(delta[..., 0], delta[..., 1]) <= demands.spacing) & ~np.eye(len(centers), dtype=bool)
        self.judged = 0

    def holds(self, taken: np.ndarray) -> bool:
        """Whether a layout keeps its spacing, sees enough and passes no limit."""
        if np.any(self._near[np.ix_(taken, taken)]) or np.any(self._sees[:, taken].sum(axis=1) < self._needed):
            return False
        self.judged += 1
        return not self._limits.excess(taken)

    def run(self, seconds: float, rng: np.random.Generator) -> np.ndarray:
        """Exchange for some seconds of the processor."""
        end = time.process_time() + seconds
        taken = np.ones(len(self._near), dtype=bool)
        for index in rng.permutation(len(taken)):
            if np.any(self._near[index] & taken):
                taken[index] = False
        # Many at once at first, which random exchange would need long for: half of them, then a quarter, then one.
        share = 0.5
        while time.process_time() < end:
            tried, inside = taken.copy(), np.flatnonzero(taken)
            out = max(1, int(share * len(inside))) if share > 0.0 else int(rng.integers(1, 4))
            tried[rng.choice(inside, min(out, len(inside)), replace=False)] = False
            if share == 0.0:
                new = rng.integers(max(out - 1, 0), out + 1)
                tried[rng.choice(np.flatnonzero(~taken), new, replace=False)] = True
            if self.holds(tried):
                taken = tried
            elif share > 0.0:
                share = 0.5 * share if share * len(inside) > 1.0 else 0.0
        return taken


def compare(project: Project, limit: float, seconds: float) -> tuple[Placement, float, int, int]:
    """Placement and its seconds of the processor; size and judged layouts of the best of two runs of the peer."""
    demands = Demands(position_limit=limit)
    start = time.process_time()
    found = place(project, options=PlacementOptions(demands=demands, extend=False))
    took = time.process_time() - start
    peer = RandomExchange(project, demands, found.candidates)
    sizes = [int(peer.run(0.5 * seconds, np.random.default_rng(seed)).sum()) for seed in (1, 2)]
    return found, took, min(sizes), peer.judged


def main() -> None:
    """Print a row per site and limit."""
    words = sys.argv[1:]
    exact = "--exact" in words
    numbers = [float(word) for word in words if word.replace(".", "").isdigit()]
    seconds = numbers[0] if numbers else SECONDS
    for name in [word for word in words if word in SITES] or SITES:
        project = load_project(bundled_folder("maps") / name)
        project = replace(project, uncertainty=EXACT) if exact else project
        for limit in LIMITS:
            found, took, exchanged, judged = compare(project, limit, seconds)
            over = sum(len(each.metres) for each in found.unmet)
            print(
                f"{name} {1e3 * limit:.0f} mm: {found.added} suggested in {took:.0f} s (at least {found.at_least}, "
                f"{over} m over the limit), {exchanged} by random exchange of {seconds:.0f} s ({judged} judged)",
                flush=True,
            )


if __name__ == "__main__":
    main()
