"""Time from a gesture to the drawn and journaled edit: 2,000 reflectors, 50 routes, 200 x 100 m; no browser.

Run as `python -m tests.benchmarks.bench_workspace`.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from commission.app.base import actions
from commission.app.base.actions import ClickFloor, DragFloor
from commission.app.editing import actions as editing
from commission.app.editing.site_tools import PlaceTool
from commission.site.editing import reflectors as edits
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from tests.benchmarks.edited_page import EditedPage

REACH, ROUNDS = 0.5, 10


def large_site() -> Project:
    """Return a hall of 200 x 100 m with 2,000 reflectors and 50 routes."""
    rng = np.random.default_rng(1)
    cells = np.full((2000, 4000), FREE, np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = (OCCUPIED,) * 4
    places = rng.uniform((1.0, 1.0), (199.0, 99.0), (2000, 2))
    reflectors = edits.add(ReflectorMap(), places, Reflector(id="R0", x=0.0, y=0.0)).reflectors
    routes = tuple(Route(f"Route {i}", (Segment(control_points=rng.uniform(5.0, 95.0, (12, 2))),)) for i in range(50))
    return Project(name="Large", floor_map=FloorMap(cells, 0.05), reflectors=reflectors, routes=routes)


def main() -> None:
    """Print the median and the longest time of each gesture."""
    project = large_site()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        page = EditedPage(project, folder, time.perf_counter)
        done = page.do

        def drag() -> float:
            r = page.state.project.reflectors.reflectors[7]
            start, end = (r.x, r.y), (r.x + 1.0, r.y + 1.0)
            return done(
                DragFloor(phase="start", start=start, now=start, reach=REACH),
                DragFloor(phase="end", start=start, now=end, reach=REACH),
            )

        def place() -> float:
            done(editing.ChooseTool(PlaceTool()))
            spent = done(ClickFloor((50.0, 0.5), REACH))
            done(editing.ChooseTool(None))
            return spent

        gestures: dict[str, Callable[[], float]] = {
            "place": place,
            "drag": drag,
            "undo": lambda: done(actions.Undo()),
        }
        for gesture, run in gestures.items():
            spent = [run() * 1e3 for _ in range(ROUNDS)]
            sys.stdout.write(f"{gesture:>6}: median {np.median(spent):.1f} ms, longest {max(spent):.1f} ms\n")
        page.close()


if __name__ == "__main__":
    main()
