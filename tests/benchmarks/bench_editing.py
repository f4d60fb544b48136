"""What an edit costs on a large site: 2,000 reflectors, 50 routes of about 100 m, 200 x 100 m with cells of 0.05 m.

Run from the checkout: `python -m tests.benchmarks.bench_editing`. Exits 1 when placing, dragging, snapping, checking or
journaling takes 100 ms or more. Times are of this process's processor: the machine may be shared.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from commission.geometry.occupancy import OccupancyGrid
from commission.io.journal import Journal
from commission.io.journal_replay import restore
from commission.io.project_file import save_project
from commission.planning.route_check import FloorDistances
from commission.site.editing import reflectors as edits
from commission.site.editing import routes as route_edits
from commission.site.editing import snapping
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies.problems import ProblemsInput, ProblemsResult, problems
from tests.benchmarks.bench_raycast import RESOLUTION, free_poses, plant

REFLECTORS, ROUTES, LIMIT = 2000, 50, 0.1


def site(rng: np.random.Generator) -> Project:
    """Reflectors and routes of 8 clicked points anywhere in a plant."""
    occupied = plant(rng)
    grid = OccupancyGrid(occupied, RESOLUTION)
    places = free_poses(grid, rng, REFLECTORS)[:, :2]
    reflectors = edits.add(ReflectorMap(), places, Reflector(id="R0", x=0.0, y=0.0)).reflectors
    routes = []
    for number in range(ROUTES):
        steps = rng.uniform(-15.0, 15.0, (8, 2)).cumsum(axis=0) + rng.uniform([30, 20], [170, 80])
        routes.append(route_edits.new_route(f"Route {number}", np.clip(steps, 2.0, [198.0, 98.0])))
    return Project(
        name="plant",
        floor_map=FloorMap(np.where(occupied, OCCUPIED, FREE).astype(np.int8), RESOLUTION),
        reflectors=reflectors,
        routes=tuple(routes),
    )


def timed(name: str, job: Callable[[], Any], limit: float | None = LIMIT) -> tuple[bool, Any]:
    """Run a job three times, print the shortest; whether it keeps the limit, and its result."""
    shortest, result = float("inf"), None
    for _ in range(3 if limit is not None else 1):
        start = time.process_time()
        result = job()
        shortest = min(shortest, time.process_time() - start)
    passed = limit is None or shortest < limit
    print(f"{name:>42}: {1000 * shortest:7.1f} ms{'' if passed else '  TOO SLOW'}")
    return passed, result


def checked(project: Project, before: ProblemsResult | None) -> ProblemsResult:
    """Problems of a project, after those of an earlier state of it."""
    return problems(ProblemsInput.of(project), before=before)


def main() -> int:
    """Print one line per edit and return the exit code."""
    project = site(np.random.default_rng(3))
    grid = project.floor_map.occupancy() if project.floor_map is not None else None
    assert project.floor_map is not None
    assert grid is not None
    timed("prepare the floor map, once", lambda: FloorDistances(project.floor_map), None)
    ready = checked(replace(project, routes=()), None)
    some = [r.id for r in project.reflectors.reflectors[:200]]
    checked(project, ready)
    results = [
        timed(
            "place a reflector",
            lambda: edits.add(project.reflectors, [(50, 50)], Reflector(id="R1", x=0, y=0)),
        ),
        timed("drag 200 reflectors", lambda: edits.move(project.reflectors, some, (0.1, 0.0))),
        timed("snap 20 reflectors to walls", lambda: snapping.snap_to_wall(project.reflectors, some[:20], grid)),
        timed("move a control point", lambda: route_edits.move_point(project.routes[0], 0, 3, (50.0, 50.0))),
        timed("check all of it", lambda: checked(project, ready), None),
    ]
    whole = checked(project, ready)
    moved = replace(project, reflectors=edits.move(project.reflectors, some, (0.1, 0.0)))
    bent = (route_edits.move_point(project.routes[0], 0, 3, (50.0, 50.0)), *project.routes[1:])
    results += [
        timed("check after a drag of 200 reflectors", lambda: checked(moved, whole)),
        timed("check after a bent route", lambda: checked(replace(project, routes=bent), whole)),
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        save_project(project, folder)
        journal = Journal(folder, project)
        journal.append(moved, "Move 200 reflectors")
        results += [
            timed(
                "journal a drag of 200 reflectors",
                lambda: (journal.append(project, "Undo"), journal.append(moved, "Redo")),
            )
        ]
        results += [timed("restore", lambda: restore(folder, project), None)]
        journal.close()
    print(f"{len(whole.problems)} problems found")
    passed = all(ok for ok, _ in results)
    print("passed" if passed else f"FAILED: expected less than {1000 * LIMIT:.0f} ms")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
