"""A project and a recording of the time of one scanner give what they gave then, to the last bit.

`schema_1/` and the figures below are those of the program before it had several scanners.
"""

from __future__ import annotations

import hashlib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from commission.io.project_file import load_project, save_project
from commission.io.recordings.base import load_log
from commission.simulation.scenario import virtual_drive
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.coverage import CoverageInput, CoverageOptions, coverage
from commission.studies.prediction import PredictionInput, prediction
from commission.studies.run import RunInput, judged_run
from commission.studies.start import start_of

OLD = Path(__file__).parent / "schema_1"


@pytest.fixture(scope="module")
def project() -> Project:
    return load_project(OLD / "project")


def digest(*arrays: np.ndarray) -> str:
    """First digits of the SHA-256 of arrays, bit for bit."""
    found = hashlib.sha256()
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()[:16]


def localized(project: Project, log: RecordLog) -> str:
    columns = judged_run(RunInput.of(project, log, start_of(project, log))).columns
    known = columns.d2[np.isfinite(columns.d2)]
    return digest(columns.means, columns.covariances, columns.modes, columns.status, columns.reflector, known)


def test_an_older_recording_is_localized_to_the_same_bits(project):
    assert localized(project, load_log(OLD / "recording")) == "adc3404850869ece"


def test_an_older_project_is_driven_and_localized_to_the_same_bits(project):
    log = virtual_drive(project, project.routes[0].name, 5)
    assert localized(project, log) == "425e26ad320bb78a"


def test_coverage_and_prediction_of_an_older_project_have_the_same_bits(project):
    found = coverage(CoverageInput.of(project, CoverageOptions(spacing=0.5))).coverage.fixes
    assert digest(found.visible, found.position_sigma, found.heading_sigma) == "2a2b18bd77f81512"
    predicted = prediction(PredictionInput.of(project, project.routes[0].name))
    for value, expected in ((predicted.prediction, "0efd2937f71553df"), (predicted.errors, "61c49ff0642a1515")):
        arrays = (getattr(value, field.name) for field in fields(value))
        assert digest(*(array for array in arrays if isinstance(array, np.ndarray))) == expected, type(value).__name__


def test_an_older_project_stays_what_it_is_when_it_is_saved_as_a_new_one(project, tmp_path):
    save_project(project, tmp_path)
    text = (tmp_path / "project.yaml").read_text(encoding="utf-8")
    assert text.startswith("schema: 2\n")
    assert "\nscanners:\n  - name: scanner\n    mounting: [0.15, 0.0, 0.0]" in text
    assert load_project(tmp_path) == project
