"""What is predicted by walls, tags, bearings and goods is what drives show metre by metre, and how far they are off."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.disturbances import Reel
from commission.site.parameters import OdometryParameters
from commission.studies.kinds import KINDS, corrected_by
from commission.studies.kinds_prediction import KindsInput, kinds_beside_ranges, kinds_prediction, metres_of
from commission.studies.metrics import pose_errors, reference_at
from tests.acceptance.test_every_kind import ROUTE, project_of
from tests.conftest import Seeds, few_of

AMONG_GOODS = "reflectors and corners that are remembered"
BESIDE = {"contours": "contours", "tags": "tags", "bearings": "bearings", AMONG_GOODS: "temporary landmarks"}
"""What corrects the pose in each project of the battery besides ranges and bearings of reflectors."""
REELS = (Reel(x=2.2, y=2.0, radius=0.4), Reel(x=5.0, y=6.4, radius=0.4), Reel(x=9.0, y=4.0, radius=0.4))


def consistent(kind: str):
    """A project whose filter takes the wheels, and the walls of a virtual hall, for what they are."""
    project = project_of(kind)
    if kind == AMONG_GOODS:
        project = dataclasses.replace(project, disturbances=dataclasses.replace(project.disturbances, reels=REELS))
    wheels = dataclasses.asdict(project.disturbances.wheels)
    names = {field.name for field in dataclasses.fields(OdometryParameters)} & wheels.keys()
    odometry = dataclasses.replace(project.parameters.odometry, **{name: wheels[name] for name in names})
    walls = dataclasses.replace(project.parameters.contour, map_sigma=1e-4, map_heading_sigma=1e-5)
    parameters = dataclasses.replace(project.parameters, odometry=odometry, contour=walls)
    return dataclasses.replace(project, parameters=parameters)


@pytest.mark.parametrize("kind", few_of(list(BESIDE), ["tags"]))
def test_predicted_sigma_is_what_drives_with_all_constants_drawn_are_off(kind: str, seeds: Seeds) -> None:
    project = consistent(kind)
    assert kinds_beside_ranges(project) == (BESIDE[kind],)
    found = kinds_prediction(KindsInput.of(project, ROUTE))
    # By each kind of which there is none, nothing is corrected.
    there = {BESIDE[kind], *(["reflectors"] if kind == AMONG_GOODS else [])}
    assert {name for name, some in zip(KINDS, found.corrections.any(axis=0), strict=True) if some} == there
    assert not found.stops.any()
    start, setup, squares = start_of(project, ROUTE), LocalizerSetup.of(project), []
    for seed in seeds(6, 60):
        log = virtual_drive(project, ROUTE, seed=100 + seed)
        columns = run(log, setup, Belief(0, start.pose, np.diag(start.sigmas**2)))
        metres, length = metres_of(columns, log)
        assert length == pytest.approx(found.length, rel=0.02)
        truth = reference_at(columns.stamps_ns, log.reference_stamps_ns, log.reference_poses)
        errors = pose_errors(columns.means, truth) ** 2
        bins = [(metres.astype(int) == metre) & np.isfinite(errors[:, 0]) for metre in found.metre]
        squares.append([errors[rows].mean(axis=0) if rows.any() else np.full(3, np.nan) for rows in bins])
    driven = np.nanmean(squares, axis=0)
    ratios = np.sqrt(found.variances[:, :2].sum(axis=1) / driven[:, :2].sum(axis=1))
    print(f"{kind}: predicted sigma over RMS error {np.median(ratios):.2f}")  # noqa: T201 - README
    # Constants stay for a drive, so that n drives tell an RMS of two axes to 1 / (2 sqrt(n)) of itself; twice that.
    margin = 1.0 / np.sqrt(len(squares))
    assert 1.0 - margin < np.median(ratios) < 1.25 + margin


@pytest.mark.with_all_seeds
def test_bearings_and_walls_and_tags_all_count_where_all_are_there() -> None:
    project = project_of("all")
    start = start_of(project, ROUTE)
    columns = run(
        virtual_drive(project, ROUTE, seed=1),
        LocalizerSetup.of(project),
        Belief(0, start.pose, np.diag(start.sigmas**2)),
    )
    corrected = corrected_by(columns)
    assert corrected.any(axis=0).all()
    # A reflex is no scan, and a frame is neither.
    assert not (corrected[:, 2] & corrected[:, [0, 1, 3]].any(axis=1)).any()
    assert not (corrected[:, 3] & corrected[:, :3].any(axis=1)).any()
