"""Virtual vehicles that are switched on anywhere, among people and false detections: found where they are, or not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from commission.localization.estimate import Mode
from commission.localization.whole_run import run
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.site.project import Project
from commission.studies.start import unknown_start
from tests.acceptance.switched_on import places_on, seen_on, site_named, way_from
from tests.conftest import REPOSITORY, Seeds

WRONG = 0.5
"""Distance to the truth from which a pose that was confirmed is a wrong one [m]."""
SCANS_OF_A_SECOND = 1.05
"""[s]: the scan that ends the first second is one of them."""


SITES = (
    ("shop_floor", 200, 8, 137, 0.94),
    ("utexas_gdc_3", 200, 2, 34, 0.93),
    ("warehouse", 200, 1, 11, 0.87),
    ("loading_bay", 150, 1, 23, 0.95),
)
"""Name, poses that are drawn, how many of them are tried, how many with all seeds, and the share found then."""


def found_soon(project: Project, drawn: int, numbers: range) -> tuple[np.ndarray, np.ndarray]:
    """Whether a vehicle is found within a second, and whether three reflectors are in reach, of each unique pose.

    Wherever it is found, it is there.
    """
    poses, ambiguous = places_on(project, drawn, 2)
    visible = vehicle_visibility(project).visible_from_poses(poses).counts()
    soon, enough = list[bool](), list[bool]()
    for index in numbers:
        way = way_from(project, poses[index], 2.0, np.random.default_rng((2, index)))
        seen = seen_on(project, way, 200_000 + index)
        columns = run(seen.log, seen.setup, unknown_start(project, seen.log).state(), detected=seen.detected)
        away = np.hypot(*(columns.means[:, :2] - seen.log.reference_poses[:, :2]).T)
        located = np.flatnonzero(columns.modes != Mode.INITIALIZING)
        assert not len(located) or away[located[0]] < WRONG
        assert not (away[columns.modes == Mode.OPERATIONAL] > WRONG).any()
        if not ambiguous[index]:
            enough.append(bool(visible[index] >= 3))
            soon.append(len(located) > 0 and float(columns.stamps_ns[located[0]]) * 1e-9 <= SCANS_OF_A_SECOND)
    return np.array(soon, dtype=bool), np.array(enough, dtype=bool)


@pytest.mark.parametrize(("name", "drawn", "few", "total", "share"), SITES)
def test_a_vehicle_that_stands_among_people_is_found_within_a_second_and_never_elsewhere(
    repository: Path, shared_data: Path, seeds: Seeds, name: str, drawn: int, few: int, total: int, share: float
) -> None:
    soon, enough = found_soon(site_named(name, repository, shared_data), drawn, seeds(few, total))
    if seeds.all:
        # Two reflectors fit wherever two are as far apart: they are never believed.
        assert np.mean(soon[enough]) >= share


def print_found() -> None:
    """The figures of the README: `python -c 'from tests.acceptance.test_start_on_sites import *; print_found()'`."""
    for name, drawn, _, total, _ in SITES:
        project = site_named(name, REPOSITORY, REPOSITORY.parent / "shared" / "data")
        soon, enough = found_soon(project, drawn, range(total))
        print(  # noqa: T201
            f"{name:13s} within a second {soon[enough].sum()} of {enough.sum()} with three reflectors in reach, "
            f"{soon.sum()} of all {len(soon)} unique; of {total} none elsewhere"
        )
