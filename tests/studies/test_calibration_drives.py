"""Calibration by many drives: they say their weighed mean together, and what changed between them is not proposed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from commission.errors import UsageError
from commission.site.quantity import MILLIMETRES
from commission.studies.calibration import calibrate
from commission.studies.calibration_drives import (
    DriveCalibration,
    DrivesCalibrationInput,
    calibrate_drives,
    together,
    weighed,
)
from commission.studies.calibration_values import CalibrationInput, CalibrationVerdict, Value
from commission.studies.start import Start, StartOrigin
from commission.studies.workers import Threads
from tests.studies.recorded import PROJECT, drive, start

PROPOSED, AGREES, WORSE = CalibrationVerdict.PROPOSED, CalibrationVerdict.AGREES, CalibrationVerdict.WORSE
BIAS = "observation.range_bias"


def said(
    proposed: float, sigma: float, verdict: CalibrationVerdict = PROPOSED, *, key: str = BIAS, reason: str = ""
) -> Value:
    return Value(key=key, before=0.0, proposed=proposed, sigma=sigma, verdict=verdict, shown=MILLIMETRES, reason=reason)


def inputs(seconds: float, seed: int, *, bias: float = 0.0) -> CalibrationInput:
    return CalibrationInput.of(PROJECT, drive(seconds, bias=bias, seed=seed), Start(start(), StartOrigin.GIVEN))


def test_drives_that_agree_are_weighed_by_what_each_is_sure_of() -> None:
    # By hand: weights 1 and 1/4 of 1e6; mean 0.0104, 1-sigma sqrt(0.8) mm; they lie closer than they say.
    found = together([said(0.010, 0.001), said(0.012, 0.002)], 2)
    assert found.proposed == pytest.approx(0.0104, abs=1e-12)
    assert found.sigma == pytest.approx(0.001 * math.sqrt(0.8), rel=1e-12)
    assert found.verdict is PROPOSED
    assert found.reason == "proposed by 2 of 2 drives"


def test_many_drives_have_the_mean_and_its_deviation_of_plain_statistics() -> None:
    rng = np.random.default_rng(5)
    values, sigmas = rng.normal(0.02, 0.004, 9), rng.uniform(0.0005, 0.002, 9)
    found = together([said(float(v), float(s)) for v, s in zip(values, sigmas, strict=True)], 9)
    mean, total = np.average(values, weights=sigmas**-2, returned=True)
    chi2 = float((((values - mean) / sigmas) ** 2).sum())
    assert chi2 > 8.0
    assert found.proposed == pytest.approx(mean, rel=1e-12)
    assert found.sigma == pytest.approx(math.sqrt(chi2 / 8.0 / total), rel=1e-12)


def test_what_has_changed_between_drives_is_not_proposed_and_told() -> None:
    found = together([said(0.030, 0.0005), said(0.0, 0.0005, AGREES), said(0.031, 0.0005)], 3)
    assert found.verdict is AGREES
    # By hand: mean 61/3, scatter 620.67 / 0.25 mm^2 over 2: the root of 1241.3.
    assert "they differ by 35.2 times what they say: something has changed between them" in found.reason


@pytest.mark.parametrize(
    ("verdicts", "expected"),
    [
        ((PROPOSED, PROPOSED, WORSE), PROPOSED),
        ((PROPOSED, AGREES), AGREES),
        ((PROPOSED, WORSE), WORSE),
        ((PROPOSED, PROPOSED, WORSE, WORSE), WORSE),
        ((AGREES, AGREES, PROPOSED), AGREES),
    ],
)
def test_a_value_is_proposed_where_most_drives_propose_it(
    verdicts: tuple[CalibrationVerdict, ...], expected: CalibrationVerdict
) -> None:
    assert together([said(0.01, 0.001, verdict) for verdict in verdicts], len(verdicts)).verdict is expected


def test_a_drive_that_does_not_show_a_figure_says_nothing_of_it() -> None:
    hidden = said(5.0, 0.0001, CalibrationVerdict.NOT_SHOWN, reason="needs turning on the spot")
    found = together([hidden, said(0.010, 0.001)], 2)
    assert (found.proposed, found.sigma, found.verdict) == (pytest.approx(0.010), pytest.approx(0.001), PROPOSED)
    neither = together([hidden, hidden], 2)
    assert neither.verdict is CalibrationVerdict.NOT_SHOWN
    assert neither.reason == "not by any of 2 drives: needs turning on the spot"


def test_a_reflector_agrees_with_the_map_in_drives_that_do_not_list_it() -> None:
    place = said(0.05, 0.001, key="reflectors.R3.x")
    assert together([place], 2).verdict is AGREES
    assert together([place, place], 3).verdict is PROPOSED


def test_figures_keep_their_order_and_notes_say_of_which_drive_they_are() -> None:
    one = DriveCalibration(name="Monday", values=(said(0.01, 0.001),), notes=("ranges are too long",))
    other = DriveCalibration(name="Tuesday", values=(), notes=(), failure="the vehicle is lost")
    found = weighed(DrivesCalibrationInput(drives=(one, other)))
    assert [each.key for each in found.values] == [BIAS]
    assert found.notes == ("Tuesday: not calibrated: the vehicle is lost", "Monday: ranges are too long")
    assert [each.key for each in found.proposed] == [BIAS]


def test_each_drive_says_what_it_says_alone_and_all_are_nearer_to_the_truth() -> None:
    told: list[str] = []
    drives = [(f"drive {seed}", inputs(20.0, seed, bias=0.03)) for seed in (1, 2, 3)]
    found = calibrate_drives(iter(drives), 3, lambda _, message: told.append(message), workers=Threads(2))
    assert told[-1] == "3 of 3 drives"
    for each, (name, alone) in zip(found.inputs.drives, drives, strict=True):
        assert each.name == name
        assert each.values == calibrate(alone).values
    value = next(each for each in found.proposed if each.key == BIAS)
    assert abs(value.proposed - 0.03) < 0.001
    assert value.sigma < min(v.sigma for each in found.inputs.drives for v in each.values if v.key == BIAS)


def test_a_drive_that_cannot_be_calibrated_stops_no_others() -> None:
    def drives() -> Iterator[tuple[str, CalibrationInput]]:
        yield "mirrored", replace(inputs(20.0, 1), log=drive(20.0, mirrored=True))
        yield "good", inputs(20.0, 1, bias=0.03)

    found = calibrate_drives(drives(), 2, workers=Threads(1))
    assert found.inputs.drives[0].failure
    assert found.notes[0].startswith("mirrored: not calibrated: ")
    assert BIAS in {each.key for each in found.proposed}
    with pytest.raises(UsageError, match="no drive could be calibrated: mirrored: "):
        calibrate_drives(first_of(drives()), 1)


def first_of(drives: Iterator[tuple[str, CalibrationInput]]) -> Iterator[tuple[str, CalibrationInput]]:
    yield next(drives)
