"""Time to edit a large floor map, and to load a large drawing and a large model, and to stop that; no browser.

Run as `python -m tests.benchmarks.bench_floor_map`. Exits 1 when an edit takes 100 ms or more, or when a job that is
told to stop goes on for longer than a second. Edits are timed on this process's processor: the machine may be shared.
"""

from __future__ import annotations

import queue
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from commission.app.base import actions
from commission.app.base.actions import PROGRAM, ClickFloor, DragFloor
from commission.app.base.effects import Effect
from commission.app.base.jobs import JobReport, Jobs, JobState
from commission.app.base.service import Context
from commission.app.base.state import AppState
from commission.app.editing import actions as editing
from commission.app.floor_map.actions import MapOpened
from commission.app.floor_map.draft import MapDraft, MapFile
from commission.app.floor_map.effects import DrawMap, ReadMapFile, StopMapWork
from commission.app.floor_map.tools import EraseTool, WallTool
from commission.app.floor_map.work import MapService
from commission.geometry import rasterize
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from tests.benchmarks.edited_page import EditedPage
from tests.io.large_files import write_drawing, write_obj, write_stl

REACH, ROUNDS, LIMIT_MS, STOP_S = 0.5, 12, 100.0, 1.0
STATE = AppState(project=Project(), saved=Project())
ENTITIES, MODEL_BYTES = 200_000, 100_000_000


def hall() -> Project:
    """Return a hall of 200 x 100 m, cells of 0.05 m, with a thousand pillars."""
    rng = np.random.default_rng(1)
    cells = np.full((2000, 4000), FREE, np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = (OCCUPIED,) * 4
    for row, column in rng.integers((10, 10), (1980, 3980), (1000, 2)):
        cells[row : row + 8, column : column + 8] = OCCUPIED
    return Project(name="Large", floor_map=FloorMap(cells, 0.05))


def edit() -> bool:
    """Print what edits of the map cost from the gesture to the drawn and journaled map; whether all are quick."""
    rasterize.warm_up()
    project = hall()
    rng = np.random.default_rng(2)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        page = EditedPage(project, folder, time.process_time)
        done = page.do

        def wall(reach: float) -> Callable[[], float]:
            def draw() -> float:
                done(editing.ChooseTool(WallTool()))
                start = rng.uniform((20, 20), (180, 80))
                points = start + np.array([(0.0, 0.0), (reach, 0.2 * reach), (reach, 0.4 * reach)])
                points = np.clip(points, 1.0, (199.0, 99.0))
                clicks = [ClickFloor((float(x), float(y)), REACH) for x, y in points]
                return done(*clicks, editing.Finish())

            return draw

        def erase() -> float:
            done(editing.ChooseTool(EraseTool()))
            x, y = (float(value) for value in rng.uniform((5, 5), (170, 70)))
            area = ((x, y), (x + 25.0, y + 20.0))
            return done(
                *(DragFloor(phase=phase, start=area[0], now=area[1], reach=REACH) for phase in ("start", "end"))
            )

        def undone() -> float:
            return done(actions.Undo())

        print("hall of 4000 x 2000 cells")
        gestures = {
            "draw a wall of 5 m": wall(5.0),
            "draw a wall of 100 m": wall(100.0),
            "erase 25 x 20 m": erase,
            "undo": undone,
        }
        passed = True
        for gesture, run in gestures.items():
            spent = sorted(1e3 * run() for _ in range(ROUNDS))
            passed &= spent[ROUNDS // 2] < LIMIT_MS
            print(f"  {gesture:>22}: median {spent[ROUNDS // 2]:6.1f} ms, longest {spent[-1]:6.1f} ms")
        print(f"  journal {(folder / '.commission.journal').stat().st_size / 1e6:.2f} MB")
        page.close()
    return passed


class Reading:
    """Jobs that read, as the page has them."""

    def __init__(self) -> None:
        self._reports: queue.SimpleQueue[JobReport] = queue.SimpleQueue()
        self._jobs = Jobs(self._reports.put)
        self._service = MapService(Context(STATE, lambda _message: None, time.monotonic, self._jobs))

    def run(self, effect: Effect, stop_after_s: float | None = None) -> tuple[JobReport, float, float, int]:
        """Do something; returns its last report, the time it took, that from the stop to the end, and reports."""
        begun = time.perf_counter()
        self._service.carry_out(effect, STATE, PROGRAM)
        stopped, count = None, 0
        while True:
            try:
                left = 0.01 if stop_after_s is not None else None
                report = self._reports.get(timeout=left)
                count += report.job.state is JobState.RUNNING
                if report.job.state not in (JobState.WAITING, JobState.RUNNING):
                    now = time.perf_counter()
                    return report, now - begun, now - (stopped or now), count
            except queue.Empty:
                pass
            now = time.perf_counter()
            if stop_after_s is not None and stopped is None and now - begun > stop_after_s:
                stopped = now
                self._service.carry_out(StopMapWork(), STATE, PROGRAM)


def load(path: Path) -> bool:
    """Print what reading and drawing a file cost, and how soon it stops when it is told to; whether that is soon."""
    reading = Reading()
    file = MapFile(path)
    report, took, _, count = reading.run(ReadMapFile(file))
    opened = report.result
    if not isinstance(opened, MapOpened):
        print(f"  {path.name}: {report.job.error or opened}")
        return False
    _, drawing, _, _ = reading.run(DrawMap(MapDraft(file=file, read=opened.read)))
    stops: list[float] = []
    for share in (0.05, 0.3, 0.6, 0.9):
        stopped, _, waited, _ = reading.run(ReadMapFile(file), stop_after_s=share * took)
        if stopped.job.state is JobState.CANCELLED:
            stops.append(waited)
    megabytes = path.stat().st_size / 1e6
    print(
        f"  {path.name} of {megabytes:.0f} MB: read in {took:.1f} s with {count} reports, drawn in {drawing:.1f} s, "
        f"stopped within {max(stops, default=0.0):.2f} s"
    )
    return max(stops, default=0.0) <= STOP_S


def main() -> int:
    """Print one line per measurement and return the exit code."""
    passed = edit()
    print("files")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_drawing(folder / "drawing.dxf", ENTITIES)
        write_stl(folder / "model.stl", MODEL_BYTES)
        write_obj(folder / "model.obj", MODEL_BYTES)
        for file in ("drawing.dxf", "model.stl", "model.obj"):
            passed &= load(folder / file)
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.1f} GB")
    print("passed" if passed else f"FAILED: expected edits below {LIMIT_MS:g} ms and stops within {STOP_S:g} s")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
