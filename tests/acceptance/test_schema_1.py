"""A project and a recording of the time of one scanner give what they gave then.

`schema_1/` and the figures below are those of the program before it had several scanners. The filter rounds some last
bits otherwise since it works with directions instead of angles, and so do other processors: 1e-9 is held here.
Then, the beams expected of a reflector were those of equation 3 as printed: the project here asks for them. Predictions
took in the reflectors of a scan in the order of their file; by distance, as now, figures are smaller by 0.1 to 0.35 %.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.io.project_file import load_project, save_project
from commission.io.recordings.base import load_log
from commission.simulation.scenario import virtual_drive
from commission.site.parameters import FilterParameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.uncertainty import Uncertainty
from commission.studies.coverage import CoverageInput, CoverageOptions, coverage
from commission.studies.prediction import PredictionInput, prediction
from commission.studies.run import RunInput, judged_run
from commission.studies.start import start_of

OLD = Path(__file__).parent / "schema_1"

RECORDED = [134.81466144352345, 0.0002315825108422165, 0.0, 4.0, 156.0, 152.457674396603]
DRIVEN = [19658.033423725436, 0.013008487322992701, 0.0, 250.0, 11105.0, 10150.085651027053]
COVERED = [6336.0, 10.829276178546635, 1.6341856456243617]
PREDICTED = [0.019903036853950003, 19589.29345728077, 0.013324419529806956, 0.0, 7352.0, 0.0]
ERRORS = [0.010769507924139781]


@pytest.fixture(scope="module")
def project() -> Project:
    """The project as its filter was then: it considered no constants, and predictions took them for exact."""
    old = load_project(OLD / "project")
    detector = replace(old.parameters.detector, expected_beams="equation_3")
    parameters = replace(old.parameters, detector=detector, filter=FilterParameters(consider=False))
    exact = Uncertainty(survey=0.0, mounting_position=0.0, mounting_heading=0.0, range_bias=0.0, clock=0.0)
    return replace(old, parameters=parameters, uncertainty=exact)


def sizes(*arrays: np.ndarray) -> list[float]:
    """Sum of the magnitudes of each array, what is not finite left out."""
    return [float(np.abs(array[np.isfinite(array)]).sum()) for array in (np.asarray(a, np.float64) for a in arrays)]


def localized(project: Project, log: RecordLog) -> list[float]:
    columns = judged_run(RunInput.of(project, log, start_of(project, log))).columns
    return sizes(columns.means, columns.covariances, columns.modes, columns.status, columns.reflector, columns.d2)


def same(expected: list[float]) -> object:
    return pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_an_older_recording_is_localized_as_it_was(project):
    assert localized(project, load_log(OLD / "recording")) == same(RECORDED)


def test_an_older_project_is_driven_and_localized_as_it_was(project):
    log = virtual_drive(project, project.routes[0].name, 5)
    assert localized(project, log) == same(DRIVEN)


def test_coverage_and_prediction_of_an_older_project_are_what_they_were(project):
    found = coverage(CoverageInput.of(project, CoverageOptions(spacing=0.5))).coverage.fixes
    assert sizes(found.visible, found.position_sigma, found.heading_sigma) == same(COVERED)
    predicted = prediction(PredictionInput.of(project, project.routes[0].name))
    # What predictions had then.
    names = ("prior_covariances", "means", "covariances", "modes", "seen", "on_odometry")
    assert sizes(*(getattr(predicted.prediction, name) for name in names)) == same(PREDICTED)
    assert sizes(predicted.errors.squares) == same(ERRORS)


def test_an_older_project_stays_what_it_is_when_it_is_saved_as_a_new_one(project, tmp_path):
    save_project(project, tmp_path)
    text = (tmp_path / "project.yaml").read_text(encoding="utf-8")
    assert text.startswith("schema: 2\n")
    assert "\nscanners:\n  - name: scanner\n    kind: laser\n    mounting: [0.15, 0.0, 0.0]" in text
    assert load_project(tmp_path) == project
