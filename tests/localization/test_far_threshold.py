"""The threshold of the intensity falls with the distance, live and over whole drives alike; unset it does nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.io.project_file import apply_settings, load_project
from commission.io.recordings.base import load_log
from commission.localization.detector import reflective_beams, threshold_at
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.site.parameters import DetectorParameters, Parameters
from commission.site.record_log import RecordLog
from commission.site.records import Record, Scan
from commission.studies.plausibility import PlausibilityInput, plausibility

from .drives import Plan, random_drive
from .test_whole_run import assert_same_estimate, setup_of

FALLING = DetectorParameters(intensity_threshold=100.0, far_threshold=0.25, far_distance=10.0)


@pytest.mark.parametrize(
    ("distance", "expected"),
    # By hand: 100 - 7.5 per metre up to 10 m.
    [(0.0, 100.0), (2.0, 85.0), (5.0, 62.5), (10.0, 25.0), (10.01, 25.0), (40.0, 25.0), (float("nan"), 100.0)],
)
def test_beams_count_as_reflective_from_the_threshold_at_their_range_on(distance: float, expected: float) -> None:
    ranges = np.array([distance], np.float32)
    assert threshold_at(ranges, FALLING) == pytest.approx(expected)
    below, at = (
        reflective_beams(ranges, np.array([expected + more], np.float32), None, FALLING)[0] for more in (-0.01, 0.01)
    )
    assert (below, at) == (False, True)


def test_a_threshold_may_rise_with_the_distance() -> None:
    rising = replace(FALLING, far_threshold=2.0)
    assert threshold_at(np.array([5.0, 20.0], np.float32), rising) == pytest.approx([150.0, 200.0])


def test_unset_it_is_one_number_wherever_far_away_begins() -> None:
    assert threshold_at(np.array([1.0, 30.0]), replace(DetectorParameters(), far_distance=3.0)) == 0.5


def test_the_scanners_own_flag_knows_no_threshold() -> None:
    flags = np.array([True, False])
    found = reflective_beams(np.array([1.0, 9.0], np.float32), np.array([0.0, 500.0], np.float32), flags, FALLING)
    assert found.tolist() == flags.tolist()


def faded(record: Record) -> Record:
    """A scan whose reflectors fade as the threshold of `FALLING` does, with walls at half of it."""
    if not isinstance(record, Scan):
        return record
    assert record.reflector is not None
    strength = 100.0 - 7.5 * np.clip(np.nan_to_num(record.ranges), 0.0, 10.0)
    strength = np.where(record.reflector, 1.02, 0.5) * strength
    return replace(record, intensities=strength.astype(np.float32), reflector=None)


@pytest.fixture
def flagged() -> tuple[LocalizerSetup, object]:
    rng = np.random.default_rng(3)
    setup = setup_of(rng)
    return setup, random_drive(setup, rng, Plan(scans=25, beams=1440, clutter=2.0))


def test_a_drive_of_fading_echoes_is_localized_as_one_with_flags_live_and_whole(flagged) -> None:
    setup, drive = flagged
    falling = replace(setup, parameters=replace(setup.parameters, detector=_threshold(setup, FALLING)))
    records = [faded(record) for record in drive.log.records()]
    log = RecordLog.collect(records, drive.log.scanners)
    expected, found = run(drive.log, setup, drive.initial), run(log, falling, drive.initial)
    assert len(expected.status) > 0
    for name in ("means", "covariances", "status", "range_bearing", "beams"):
        assert getattr(found, name).tobytes() == getattr(expected, name).tobytes(), name
    live = Localizer(falling, drive.initial)
    estimates = [estimate for record in records for estimate in live.feed(record)] + list(live.flush())
    assert len(estimates) == len(found)
    for k, estimate in enumerate(estimates):
        assert_same_estimate(estimate, found.estimate(k))
    # With one threshold for all, far reflectors are lost.
    constant = replace(falling, parameters=replace(setup.parameters, detector=_threshold(setup, FALLING, 1.0)))
    assert len(run(log, constant, drive.initial).status) < len(found.status)


def _threshold(setup: LocalizerSetup, like: DetectorParameters, far: float = 0.25) -> DetectorParameters:
    return replace(
        setup.parameters.detector,
        intensity_threshold=like.intensity_threshold,
        far_threshold=far,
        far_distance=like.far_distance,
    )


@pytest.mark.parametrize("change", [{"far_threshold": 0.9}, {"far_distance": 11.0}, {"intensity_threshold": 1.0}])
def test_another_threshold_detects_anew(flagged, change: dict[str, float]) -> None:
    setup, _ = flagged
    other = replace(setup.parameters, detector=replace(setup.parameters.detector, **change))
    assert not replace(setup, parameters=other).detects_like(setup)


def test_it_is_set_by_commands_and_refused_outside_of_its_bounds() -> None:
    found = apply_settings(Parameters(), ["detector.far_threshold=0.3", "detector.far_distance=12"]).detector
    assert (found.far_threshold, found.far_distance) == (0.3, 12.0)
    for name, value in (("far_threshold", -0.01), ("far_threshold", 10.1), ("far_distance", 0.0)):
        with pytest.raises(ValueError, match=f"detector.{name} is"):
            DetectorParameters(**{name: value})


def test_real_poles_that_a_high_threshold_loses_far_away_come_back(shared_data: Path) -> None:
    """Intensities of the car park have levels of 0 to 4."""
    folder = shared_data / "car_park"
    project, log = load_project(folder), load_log(folder / "recording")
    scans = log.scans[0].block(0, len(log.scans[0]))
    assert scans.intensities is not None
    ranges, near = np.asarray(scans.ranges), np.asarray(scans.ranges) < 10.0

    def flags(**changes: float) -> np.ndarray:
        detector = replace(project.parameters.detector, **changes)
        return reflective_beams(scans.ranges, scans.intensities, None, detector)

    low, high = flags(), flags(intensity_threshold=1.5)
    both = flags(intensity_threshold=1.5, far_threshold=1.0 / 3.0, far_distance=10.0)
    far = ranges >= 10.0
    assert low[far].sum() > high[far].sum()
    assert np.array_equal(both[far], low[far])
    assert low[near].sum() > both[near].sum() > high[near].sum()
    inputs = PlausibilityInput.of(project, log)
    lost = replace(inputs, detector=replace(inputs.detector, intensity_threshold=4.5))
    found = replace(lost, detector=replace(lost.detector, far_threshold=0.1))
    assert any("no beam of the scans reaches" in each.found for each in plausibility(lost))
    assert not any("no beam of the scans reaches" in each.found for each in plausibility(found))
