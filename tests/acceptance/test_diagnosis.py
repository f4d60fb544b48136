"""Faults put into a virtual drive, each alone and all together: each is named rightly, and nothing in clean drives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.geometry import se2
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.localization.estimate import Belief
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.disturbances import ConstantErrors, ScannerError, ShinyObject
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.uncertainty import Uncertainty
from commission.studies.calibration import CalibrationInput, calibrate
from commission.studies.diagnosis import Diagnosis, diagnosis, diagnosis_input
from commission.studies.start import Start, StartOrigin
from tests.acceptance.eight import eight
from tests.conftest import Seeds
from tests.planning.driven import QUICK

FAULTS = ("moved", "missing", "double", "shiny", "bias", "turned", "late", "wheels")
NAMED = {
    "moved": "L1 has moved by",
    "missing": "L3 is missing",
    "double": "L2 is double",
    "shiny": "something at 3.50, 5.00 m looks like a reflector",
    "bias": "ranges are",
    "turned": "scanner scanner is turned by",
    "late": "scans of scanner are stamped",
    "wheels": "turns are",
}
CLEAN_DRIVES, FEW_CLEAN_DRIVES = 30, 1

pytestmark = pytest.mark.slow


def laboratory(laps: int) -> Project:
    """The laboratory with a figure of eight driven some times."""
    project = load_project(bundled_folder("maps") / "laboratory")
    return replace(project, routes=(eight(laps),), uncertainty=Uncertainty(survey=0.003))


def diagnosed(project: Project, faults: tuple[str, ...], seed: int) -> Diagnosis:
    """Drive through a hall with some faults, and diagnose by the project that knows nothing of them."""
    error = ScannerError(
        range_bias=0.015 if "bias" in faults else 0.0,
        mounting=(0.0, 0.0, np.radians(1.0) if "turned" in faults else 0.0),
        clock_offset=0.04 if "late" in faults else 0.0,
    )
    every = list(project.reflectors.reflectors)
    if "moved" in faults:
        every[0] = replace(every[0], x=every[0].x + 0.06)
    if "double" in faults:
        every.append(replace(every[1], id="double", x=every[1].x + 0.3))
    if "missing" in faults:
        every = [each for each in every if each.id != "L3"]
    disturbances = replace(
        project.disturbances.undisturbed(),
        constants=ConstantErrors(survey_sigma=0.003, scanners=(error,)),
        shiny_objects=(ShinyObject(3.5, 5.0, 0.05),) if "shiny" in faults else (),
    )
    hall = replace(project, disturbances=disturbances, reflectors=ReflectorMap(tuple(every)))
    log = virtual_drive(hall, "Eight", seed, options=QUICK)
    if "wheels" in faults:
        reported = se2.log(log.displacements) * (1.0, 1.0, 1.02)
        log = replace(log, displacements=se2.exp(reported))
    begin = start_of(project, "Eight")
    start = Start(Belief(0, begin.pose, np.diag(begin.sigmas**2)), StartOrigin.DRIVE)
    found = calibrate(CalibrationInput.of(project, log, start))
    return diagnosis(diagnosis_input(project, found, project.floor_map))


def check_named(found: Diagnosis, faults: tuple[str, ...]) -> None:
    """Each fault is named once, by what it is, and nothing else is."""
    for fault in faults:
        assert sum(NAMED[fault] in line for line in found.lines) == 1, (fault, found.lines)
    extra = [line for line in found.lines if not any(NAMED[fault] in line for fault in faults)]
    assert not extra


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_alone_is_named_and_nothing_else(fault: str, seeds: Seeds) -> None:
    # Two percent of turns show on a long drive only; all else within a minute.
    project = laboratory(3 if fault == "wheels" else 1)
    for seed in seeds(1, 3):
        check_named(diagnosed(project, (fault,), seed), (fault,))


def test_all_faults_together_are_named(seeds: Seeds) -> None:
    project = laboratory(3)
    for seed in seeds(1, 3):
        check_named(diagnosed(project, FAULTS, seed), FAULTS)


def test_nothing_is_named_in_a_clean_drive(seeds: Seeds) -> None:
    project = laboratory(1)
    for seed in seeds(FEW_CLEAN_DRIVES, CLEAN_DRIVES):
        assert diagnosed(project, (), seed).lines == ()
