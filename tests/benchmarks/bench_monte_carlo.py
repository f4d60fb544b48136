"""Virtual drives of the warehouse with and without beams, in one run: seconds of processor time for ten minutes driven.

Run: `python -m tests.benchmarks.bench_monte_carlo [DRIVES]` from the checkout. Each drive is simulated, localized and
judged. Its peers are the same drive beam by beam, of which only the beams that can meet a reflector are cast, and the
first cycles of one as it is written with numpy and filterpy: lines of sight sampled on the floor map, detections with
noise, an extended Kalman filter; no faults, no constants, no judgement. Required: a thousand drives of ten minutes in
30 s on two cores, which is 0.06 s of processor time each.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.se2 import compose, inverse
from commission.io.project_file import load_project
from commission.localization.estimate import Belief
from commission.localization.observation import range_bearing
from commission.localization.setup import LocalizerSetup
from commission.simulation.random_faults import FaultRates
from commission.site.floor_map import OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.monte_carlo import monte_carlo, warm_up
from commission.studies.monte_carlo_figures import Detecting, MonteCarloInput
from commission.studies.shadow_drives import ShadowWorld, shadow_drive
from commission.studies.workers import Threads
from tests.benchmarks.bench_filter import peer_seconds as filtered_by_peer

PEER_CYCLES = 250
RATE = 25.0
WAREHOUSE = Path(__file__).parents[2] / "maps" / "warehouse"


def peer_seconds(project: Project, cycles: int = PEER_CYCLES) -> tuple[float, float]:
    """Seconds of processor time for so many cycles as one writes them with numpy and filterpy, and the last error [m].

    Parameters
    ----------
    project : the site; its first route is driven.
    cycles : of the drive; where the vehicle is in each is given.
    """
    setup, route = LocalizerSetup.of(project), project.routes[0].name
    driven = shadow_drive(ShadowWorld.of(project, setup, (route,)), project, route, 1)
    poses = driven.reference_poses[:cycles]
    floor, scanner, rng = project.floor_map, project.scanners[0], np.random.default_rng(0)
    assert floor is not None
    occupied, centers = floor.cells == OCCUPIED, setup.reflectors.centers
    began = time.process_time()
    rows: list[FloatArray] = []
    for pose in poses:
        sensor = compose(pose, scanner.mounting)
        seen = range_bearing(pose, scanner.mounting, centers)
        low, high = np.radians(scanner.field_of_view_deg)
        ahead = (seen[:, 0] < scanner.reflector_range) & (seen[:, 1] >= low) & (seen[:, 1] <= high)
        kept = [index for index in np.flatnonzero(ahead) if _is_clear(occupied, floor, sensor[:2], centers[index])]
        noise = rng.normal(size=(len(kept), 2)) * np.sqrt(setup.observation_rows[0, 3:5])
        rows.append(seen[kept] + noise)
    simulated = time.process_time() - began
    moved = np.concatenate((np.zeros((1, 3)), compose(inverse(poses[:-1]), poses[1:])))
    stamps = driven.reference_stamps_ns[:cycles]
    log = RecordLog(
        odometry_stamps_ns=stamps,
        displacements=moved,
        detection_stamps_ns=stamps,
        detection_offsets=np.concatenate(([0], np.cumsum([len(each) for each in rows]))),
        range_bearing=np.concatenate(rows),
    )
    seconds, mean = filtered_by_peer(log, setup, Belief(0, poses[0], 1e-4 * np.eye(3)), cycles)
    return simulated + seconds, float(np.hypot(*(mean[:2] - poses[-1, :2])))


def _is_clear(occupied: BoolArray, floor: FloorMap, eye: FloatArray, target: FloatArray) -> bool:
    """Whether no wall stands between two places, by samples half a cell apart; the last 0.3 m are left out."""
    step = 0.5 * floor.resolution
    distance = float(np.hypot(*(target - eye)))
    along = np.arange(0.0, max(distance - 0.3, 0.0), step)[:, np.newaxis] / distance
    columns, rows = ((eye + along * (target - eye) - floor.origin[:2]) / floor.resolution).astype(int).T
    inside = (rows >= 0) & (columns >= 0) & (rows < occupied.shape[0]) & (columns < occupied.shape[1])
    return not occupied[rows[inside], columns[inside]].any()


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
    print(f"a thousand without beams, scaled: {1000.0 * took[Detecting.SHADOWS]:.0f} s of processor time (<= 60 s)")
    seconds, error = peer_seconds(project)
    seconds *= 600.0 * RATE / PEER_CYCLES
    print(
        f"numpy and filterpy: {seconds:.0f} s for ten minutes driven, ratio {seconds / took[Detecting.SHADOWS]:.0f}; "
        f"{1e3 * error:.0f} mm beside the truth at the end"
    )


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))
