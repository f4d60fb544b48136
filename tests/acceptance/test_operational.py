"""What is called operational is: slips are noticed, people and shiny things alone do not stop the vehicle.

The thresholds of the rule by rejections were chosen on the bundled sites with these seeds. `ELSEWHERE` are halls on
which nothing was chosen: a random third of the reflectors is gone there, from the hall and from the map. Slips are
noticed there as well; a shiny thing that is alone in sight for long, beside a mapped reflector, raises a false alarm
in about a fifth of the drives of that shop floor, and in none of the other halls.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from commission.geometry.arrays import FloatArray
from commission.io.project_file import load_project
from commission.localization import whole_run
from commission.localization.detection_log import DetectionLog, extract_detections
from commission.localization.estimate import Belief, Mode, Status
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.simulation.drive import DriveOptions
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.studies.metrics import pose_errors, reference_at
from tests.conftest import Seeds, few_of

SITES = ("laboratory", "shop_floor", "warehouse")
ELSEWHERE = (("laboratory", 1), ("shop_floor", 2), ("warehouse", 3))
PEOPLE = 50
SLIPS = (*((degrees, 0.0) for degrees in (2, 3, 5, 8)), (0, 0.12), (0, 0.2), (0, 0.3))
"""Turn [degrees] and way ahead [m] that odometry tells and that did not happen."""
START_OFF = 26
"""Seed of a drive that starts 35 mm off at the laboratory, 3.5 sigma: what it rejects there is harmless."""
LONGEST = 15
"""Cycles that a vehicle may be dangerous and operational."""

pytestmark = pytest.mark.slow


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """A virtual drive, detected once."""

    setup: LocalizerSetup
    log: RecordLog
    detected: DetectionLog
    start: Belief

    def localized(self, log: RecordLog | None = None) -> tuple[RunColumns, FloatArray]:
        """The run over its records, or others, and whether it is dangerous in each cycle."""
        run = whole_run.run(log or self.log, self.setup, self.start, detected=self.detected)
        references = reference_at(run.stamps_ns, self.log.reference_stamps_ns, self.log.reference_poses)
        errors = pose_errors(run.means, references)
        return run, (np.hypot(errors[:, 0], errors[:, 1]) > 0.1) | (np.abs(errors[:, 2]) > math.radians(3.0))

    def slipped(self, degrees: int, ahead: float, seed: int) -> RecordLog:
        """The same records with a motion in the odometry that did not happen, somewhere in the middle of the drive."""
        rng = np.random.default_rng(1000 * seed + degrees)
        displacements = np.array(self.log.displacements)
        row = int(rng.uniform(0.3, 0.7) * len(displacements))
        displacements[row, 2] += math.radians(degrees) * rng.choice((-1, 1))
        displacements[row, 0] += ahead
        return replace(self.log, displacements=displacements)


@cache
def hall(maps: Path, site: str, without: int = 0) -> Project:
    """A bundled site; without a third of its reflectors, drawn by a seed, where one is given."""
    project = load_project(maps / site)
    if not without:
        return project
    reflectors = project.reflectors.reflectors
    order = np.random.default_rng(without).permutation(len(reflectors))
    kept = sorted(order[: round(0.66 * len(reflectors))])
    return replace(project, reflectors=ReflectorMap(tuple(reflectors[index] for index in kept)))


def drive(project: Project, people: int, seed: int) -> Drive:
    """Drive one of the routes."""
    project = replace(project, disturbances=replace(project.disturbances, people=people))
    route = project.routes[seed % len(project.routes)].name
    log = virtual_drive(project, route, seed, options=DriveOptions(whole_scans=False))
    setup, start = LocalizerSetup.of(project), start_of(project, route)
    return Drive(setup, log, extract_detections(log, setup), Belief(0, start.pose, np.diag(start.sigmas**2)))


def unnoticed(
    project: Project, people: int, seed: int, *, in_sight: bool = False
) -> dict[tuple[int, int, int, float], int]:
    """Cycles that each slip is dangerous in while the vehicle is operational, where they are too many.

    With `in_sight` only those in which anything is detected: nothing says that a blind vehicle has slipped.
    """
    driven = drive(project, people, seed)
    found: dict[tuple[int, int, int, float], int] = {}
    for degrees, ahead in SLIPS:
        run, dangerous = driven.localized(driven.slipped(degrees, ahead, seed))
        said = dangerous & (run.modes == Mode.OPERATIONAL)
        if in_sight:
            said &= run.counts(Status.INLIER) + run.counts(Status.OUTLIER_ASSOCIATION) > 0
        found[people, seed, degrees, ahead] = int(np.count_nonzero(said))
    return {slip: cycles for slip, cycles in found.items() if cycles > LONGEST}


@pytest.mark.parametrize("people", [0, PEOPLE])
@pytest.mark.parametrize("site", SITES)
def test_no_slip_is_dangerous_for_long(repository: Path, seeds: Seeds, site: str, people: int) -> None:
    project = hall(repository / "maps", site)
    assert [unnoticed(project, people, seed) for seed in seeds(1, 5)] == [{}] * len(seeds(1, 5))


@pytest.mark.parametrize("site", few_of(SITES, ("laboratory", "shop_floor")))
def test_people_alone_never_make_a_vehicle_lost(repository: Path, seeds: Seeds, site: str) -> None:
    project, alarms = hall(repository / "maps", site), {}
    for seed in (*seeds(2, 50), START_OFF):
        run, dangerous = drive(project, PEOPLE, seed).localized()
        assert not dangerous.any()
        alarms[seed] = int(np.count_nonzero(run.modes == Mode.LOST))
    assert {seed: cycles for seed, cycles in alarms.items() if cycles} == {}


@pytest.mark.parametrize(("site", "without"), ELSEWHERE)
def test_no_slip_is_dangerous_for_long_elsewhere(repository: Path, seeds: Seeds, site: str, without: int) -> None:
    project = hall(repository / "maps", site, without)
    # With a third of the reflectors gone the laboratory's vehicle sees nothing for 37 cycles after one of the slips.
    missed = [unnoticed(project, PEOPLE, seed, in_sight=True) for seed in seeds(1, 5)]
    assert missed == [{}] * len(seeds(1, 5))


@pytest.mark.parametrize(("site", "without"), [ELSEWHERE[0], ELSEWHERE[2]])
def test_people_alone_never_make_a_vehicle_lost_elsewhere(
    repository: Path, seeds: Seeds, site: str, without: int
) -> None:
    project = hall(repository / "maps", site, without)
    for seed in seeds(1, 20):
        run, _ = drive(project, PEOPLE, seed).localized()
        assert not (run.modes == Mode.LOST).any(), seed
