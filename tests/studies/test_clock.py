"""The clock of a scanner by a drive's motion, against clocks that are set wrong on purpose."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry import se2
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.calibration import CalibrationInput
from commission.studies.calibration_constants import hides_clock
from commission.studies.calibration_values import with_value
from commission.studies.clock import ClockOffset, ClockVerdict, clock_offsets, displacement, speed_at
from commission.studies.run import RunInput, judged_run, summary
from commission.studies.start import Start, StartOrigin
from tests.studies import recorded
from tests.studies.recorded import PROJECT, SECOND, drive, start


def noisy(log: RecordLog, seed: int = 1) -> RecordLog:
    """The drive with noise of its wheels: 2 mm and 1 mrad after a metre."""
    rng = np.random.default_rng(seed)
    steps = log.displacements.copy()
    scale = np.sqrt(np.hypot(*steps[:, :2].T))[:, np.newaxis]
    steps += scale * rng.normal(0.0, (0.002, 0.0, 0.001), steps.shape)
    return replace(log, displacements=steps)


def found(log: RecordLog, project: Project = PROJECT) -> ClockOffset:
    (offset,) = clock_offsets(CalibrationInput.of(project, log, Start(start(), StartOrigin.GIVEN)))
    return offset


def rms(log: RecordLog, clock: float) -> float:
    inputs = RunInput.of(PROJECT, log, Start(start(), StartOrigin.GIVEN))
    setup = with_value(inputs.segments[0].setup, "scanners.scanner.clock_offset", clock)
    return float(summary(judged_run(inputs.with_setup(setup, 0)))["position_rmse_m"])


@pytest.mark.parametrize("late", [0.0, 0.06])
def test_an_offset_is_found_to_two_milliseconds_and_cures_the_run(late: float) -> None:
    log = noisy(drive(240.0, late_s=late))
    offset = found(log)
    assert offset.verdict is ClockVerdict.FOUND, offset
    assert abs(offset.offset - late) < 0.002
    ideal = rms(log, late)
    assert rms(log, offset.offset) < 1.1 * ideal
    if late > 0.05:
        assert rms(log, 0.0) > 1.5 * ideal, "a wrong clock matters in this drive"


def test_a_short_drive_says_how_well_it_shows_a_clock_and_how_much_more_it_takes() -> None:
    offset = found(noisy(drive(25.0, late_s=0.02)))
    assert offset.verdict is ClockVerdict.ROUGHLY
    assert abs(offset.offset - 0.02) < 3.0 * offset.sigma
    assert f"±{2000 * offset.sigma:.1f} ms only" in offset.reason
    assert "times as many turns and changes of speed" in offset.reason


def test_a_straight_drive_at_one_speed_shows_no_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    def straight(t: np.ndarray) -> np.ndarray:
        return np.stack([2.0 + 0.2 * t, 4.0 + 0.05 * t, np.full_like(t, math.atan2(0.05, 0.2))], axis=-1)

    monkeypatch.setattr(recorded, "pose_at", straight)
    offset = found(noisy(drive(60.0, late_s=0.03)))
    assert offset.verdict is ClockVerdict.NOT_SHOWN
    assert "a clock needs turns and changes of speed" in offset.reason


@pytest.mark.parametrize(
    ("prior", "sigma", "shift", "hides"),
    [
        (0.005, 0.0034, 0.01, False),
        (0.005, 0.0036, 0.01, True),
        # A straight drive whose prior gave way: surer of nothing than before.
        (0.005, 0.006, -0.02, True),
        # Thirty milliseconds to four are shown, though the project was sure of five.
        (0.005, 0.004, 0.031, False),
    ],
)
def test_a_clock_that_is_hardly_surer_than_before_is_not_shown(
    prior: float, sigma: float, shift: float, hides: bool
) -> None:
    assert hides_clock(prior, sigma, shift) is hides


def test_the_effect_of_a_clock_is_the_way_that_is_driven_in_it() -> None:
    log = drive(20.0)
    stamp = 7 * SECOND
    # By the formulas of the drive, over the same 0.4 s.
    before, after = recorded.pose_at(np.array([6.8, 7.2]))
    way = float(np.hypot(*se2.relative(before, after)[:2]))
    assert speed_at(log, stamp) == pytest.approx(way / 0.4, rel=0.01)
    assert displacement(-0.02, 1.5) == pytest.approx(0.03)
    assert speed_at(log, 10_000 * SECOND) == 0.0
