"""Hybrid by area: reflectors correct in the aisles of the warehouse, contours in the hall around them."""

# pyright: basic

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from commission.io.project_file import load_project
from commission.localization.contour import ACCEPTED, USE
from commission.localization.estimate import Belief, Mode
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.localization.zones import kinds_at
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.parameters import ContourParameters
from commission.site.reflectors import ReflectorMap
from commission.site.zones import ObservationKind, Zone
from commission.studies.integrity import protection
from tests.conftest import REPOSITORY

ROUTE = "Through aisles 6 and 4"
"""It leaves and enters the aisles four times."""
JUMP = 0.020
"""Wanted: no step of the pose at any scan is larger [m]."""
SURVEY = 0.010
"""How far the reflectors' survey may be off that of the walls, all together: two crews, two fixed points [m]."""


def box(left, low, right, high):
    return ((left, low), (right, low), (right, high), (left, high))


AISLES = tuple(
    Zone(name=name, outline=outline, kinds=(ObservationKind.REFLECTORS,))
    for name, outline in (("Aisles, west", box(12.0, 10.0, 47.0, 53.0)), ("Aisles, east", box(53.0, 10.0, 91.0, 53.0)))
)
HALL = Zone(name="Hall", outline=box(-1.0, -1.0, 101.0, 61.0), kinds=(ObservationKind.CONTOURS,))


@pytest.mark.parametrize("off", [0.0, SURVEY], ids=["as surveyed", "reflectors and walls 10 mm apart"])
def test_no_step_of_the_pose_is_larger_than_20_mm_where_a_vehicle_leaves_the_aisles(seeds, off, drives):
    for seed in seeds(1, 10):
        project, log = drives(seed)
        moved = ReflectorMap(tuple(dataclasses.replace(each, x=each.x + off) for each in project.reflectors.reflectors))
        project = dataclasses.replace(project, reflectors=moved)
        setup, start = LocalizerSetup.of(project), start_of(project, ROUTE)
        columns = run(log, setup, Belief(0, start.pose, np.diag(start.sigmas**2)))
        before = columns.priors.rows().means
        counts = np.array([kinds_at(setup.zone_rows, x, y) for x, y in before[:, :2].tolist()])
        in_aisle = counts[:, 0]
        assert 0.3 < in_aisle.mean() < 0.7
        assert np.count_nonzero(np.diff(in_aisle)) == 4
        assert (columns.contours[~in_aisle, USE] == ACCEPTED).mean() > 0.99
        assert not columns.contours[in_aisle].any()
        # From a second after the start, whose pose is told to 20 mm only.
        steps = np.hypot(*(columns.means - before)[25:, :2].T)
        assert steps.max() <= JUMP
        truth = log.reference_poses[np.searchsorted(log.reference_stamps_ns, columns.stamps_ns)]
        errors = np.hypot(*(columns.means - truth)[:, :2].T)
        assert errors.max() <= JUMP + off
        largest, rms, most = 1e3 * steps.max(), 1e3 * np.sqrt(np.mean(errors**2)), 1e3 * errors.max()
        print(f"seed {seed}: step {largest:.1f} mm, error {rms:.2f} mm RMS, {most:.1f} at most")  # noqa: T201 - README
        assert (columns.modes == Mode.OPERATIONAL).all()
        if not off:
            # Contours correct the filters that leave a reflector out, too: the level does not grow where they count.
            levels = protection(columns).position
            assert (errors <= levels).all()
            assert (levels[25:] < project.parameters.supervisor.position_limit).mean() > 0.99


@pytest.fixture(scope="module")
def drives():
    known = {}
    site = load_project(REPOSITORY / "maps" / "warehouse")
    parameters = dataclasses.replace(site.parameters, contour=ContourParameters(enabled=True))
    project = dataclasses.replace(site, parameters=parameters, zones=(*AISLES, HALL))

    def drive(seed):
        if seed not in known:
            known[seed] = virtual_drive(project, ROUTE, seed)
        return project, known[seed]

    return drive
