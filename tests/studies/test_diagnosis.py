"""Diagnosis of single reflectors, by a drive of formulas in which detections are left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.site.record_log import RecordLog
from commission.studies.calibration import CalibrationInput, calibrate
from commission.studies.diagnosis import Suspicion, diagnosis, diagnosis_input
from commission.studies.start import Start, StartOrigin
from tests.studies.recorded import PLACES, PROJECT, drive, start

OF = 3
"""The reflector that is not always seen."""


def seen_in(log: RecordLog, share: float) -> RecordLog:
    """The drive in which one reflector is seen in a share of the scans alone."""
    scans, places = len(log.detection_stamps_ns), len(PLACES)
    kept = np.ones((scans, places), dtype=np.bool_)
    kept[:, OF] = np.random.default_rng(2).random(scans) < share
    offsets = np.concatenate(([0], np.cumsum(kept.sum(axis=1))))
    return replace(log, detection_offsets=offsets, range_bearing=log.range_bearing[kept.ravel()])


@pytest.mark.parametrize(
    ("share", "suspicion"), [(1.0, None), (0.5, None), (0.2, Suspicion.DIRTY), (0.01, Suspicion.MISSING)]
)
def test_a_reflector_that_is_seen_too_rarely_is_dirty_and_one_that_hardly_ever_is_is_missing(
    share: float, suspicion: Suspicion | None
) -> None:
    log = seen_in(drive(40.0), share)
    found = calibrate(CalibrationInput.of(PROJECT, log, Start(start(), StartOrigin.GIVEN)))
    named = diagnosis(diagnosis_input(PROJECT, found, None))
    suspected = {each.id: each.suspicion for each in named.reflectors if each.suspicion is not None}
    assert suspected == ({} if suspicion is None else {f"R{OF}": suspicion})
    if suspicion is not None:
        (line,) = [each for each in named.lines if each.startswith(f"R{OF} is {suspicion.value}: seen in ")]
        seen, expected = (int(word) for word in line.split() if word.isdigit())
        assert seen / expected == pytest.approx(share, abs=0.08)


def test_a_handful_of_sightings_beside_its_place_does_not_say_that_a_reflector_has_moved() -> None:
    log = drive(40.0)
    beside = log.range_bearing.copy()
    beside[OF :: len(PLACES), 0] += 0.06
    few = seen_in(replace(log, range_bearing=beside), 0.05)
    found = calibrate(CalibrationInput.of(PROJECT, few, Start(start(), StartOrigin.GIVEN)))
    named = diagnosis(diagnosis_input(PROJECT, found, None))
    assert 5 <= np.count_nonzero(found.fit.reflector == OF) < 30
    # Gone, for all that it is seen at its place; that it stands elsewhere, nobody has seen often enough.
    assert [(each.id, each.suspicion) for each in named.reflectors if each.suspicion is not None] == [
        (f"R{OF}", Suspicion.MISSING)
    ]
