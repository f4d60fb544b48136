"""Figures of what is accepted and rejected, counted by hand; what they say of a run, in words; sections of a drive."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry.arrays import read_only
from commission.localization.estimate import Mode, Status
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import AssociationParameters
from commission.site.stations import Station
from commission.studies.consistency import consistency, recent
from commission.studies.consistency_findings import lost_findings, noise_findings
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.sections import section_entries, sections
from commission.studies.start import start_of
from tests.odometry_of import PRECISE
from tests.studies.recorded import PROJECT, RecordLog, drive, start
from tests.studies.test_run import hall, replayed, standing_still

PERIOD = 0.1
"""Time between two scans of the drives below [s]."""
BLIND = range(40, 60)


@pytest.fixture(scope="module")
def columns() -> RunColumns:
    """100 cycles in which five reflectors are detected, but for two seconds in which none is."""
    return replayed(hall(), standing_still(100, blind=BLIND)).columns


def with_status(columns: RunColumns, rejected: range, d2: float = 20.0) -> RunColumns:
    """The run with all detections accepted at a distance of 1.0, but for the cycles in which all are rejected."""
    status, distances = np.full(len(columns.status), int(Status.INLIER), np.int8), np.ones(len(columns.d2))
    for cycle in rejected:
        rows = slice(int(columns.offsets[cycle]), int(columns.offsets[cycle + 1]))
        status[rows], distances[rows] = Status.OUTLIER_ASSOCIATION, d2
    modes = np.full(len(columns), int(Mode.OPERATIONAL), np.int8)
    return replace(columns, status=read_only(status), d2=read_only(distances), modes=read_only(modes))


def test_figures_of_a_stretch_are_those_of_its_cycles_alone(columns: RunColumns) -> None:
    run = with_status(columns, range(10, 15))
    found = consistency(run, 5, 50)
    # 35 cycles of five detections, 25 of them rejected; nothing is seen from cycle 40 to the end of the stretch.
    assert (found.cycles, found.accepted, found.rejected) == (45, 150, 25)
    assert found.nis_mean == 1.0
    assert found.nis_before_gate_mean == pytest.approx((150 * 1.0 + 25 * 20.0) / 175)
    assert found.rejected_fraction == pytest.approx(25 / 175)
    assert found.unseen_fraction == pytest.approx(15 / 45)
    assert found.longest_unseen == pytest.approx(10 * PERIOD)
    nothing = consistency(run, 40, 60)
    assert (nothing.accepted, nothing.rejected, nothing.unseen_fraction) == (0, 0, 1.0)
    assert all(map(math.isnan, (nothing.nis_mean, nothing.nis_before_gate_mean, nothing.rejected_fraction)))
    assert nothing.longest_unseen == pytest.approx(19 * PERIOD)


def test_the_last_second_holds_its_detections_and_no_older_ones(columns: RunColumns) -> None:
    found = recent(with_status(columns, range(10, 15)))
    # At cycle 9 none is rejected, at 14 five of ten scans; at 23 the last of them is 0.9 s old, at 24 it is 1.0 s old.
    assert found.rejected[[9, 14, 23, 24]] == pytest.approx([0.0, 0.5, 0.1, 0.0])
    assert found.nis[[9, 14, 23, 24]] == pytest.approx([1.0, 10.5, 2.9, 1.0])
    # Nothing is seen from cycle 40 on: at 48 the last detections are 0.9 s old.
    assert np.isfinite(found.rejected[48])
    assert np.isnan(found.rejected[49:60]).all()
    assert np.isnan(found.nis[49:60]).all()


def test_the_expected_nis_of_two_gates_is_as_often_that_of_each_as_it_was_used() -> None:
    log = RecordLog.collect(standing_still(30))
    usual, narrow = (hall(association=AssociationParameters(gate_probability=p)) for p in (0.95, 0.5))
    inputs = RunInput.of(usual, log, start_of(usual, log, (0.0, 0.0, 0.0)))
    both = judged_run(inputs.with_setup(LocalizerSetup.of(narrow), 20)).columns
    # 1.6847 in 20 and 0.6137 in 10 of the cycles.
    assert consistency(both).nis_expected == pytest.approx((2 * 1.6847 + 0.6137) / 3, abs=1e-4)
    assert consistency(both, 20).nis_expected == pytest.approx(0.6137, abs=1e-4)


def test_a_vehicle_that_is_lost_to_the_end_is_told_from_when_on(columns: RunColumns) -> None:
    (finding,) = lost_findings(with_status(columns, range(70, 100)))
    assert "are rejected from " in finding.found
    # Of the window's 5 s, 2 s are blind: in cycle t (t - 69) of (t - 69) + 20 + ... are rejected, most from 8.9 s on.
    assert finding.found.endswith("s on")


def test_each_stretch_of_being_lost_counts_and_the_first_is_named() -> None:
    columns = replayed(hall(), standing_still(600)).columns
    lost = with_status(columns, [*range(100, 200), *range(300, 500)])  # pyright: ignore[reportArgumentType]
    (finding,) = lost_findings(lost)
    # Of the last 50 scans more than 60 % are rejected from the 31st one on, until 20 good ones have come after.
    assert "first at 13.0 s" in finding.found
    assert "longest time from 33.0 to 51.9 s" in finding.found
    # 13.0 to 21.9 s and 33.0 to 51.9 s, of 59.9 s.
    assert "in 27.8 s (46 % of the drive)" in finding.found
    assert lost_findings(with_status(columns, range(100, 130))) == ()


def test_a_drive_that_rejects_nothing_is_not_called_lost(columns: RunColumns) -> None:
    assert lost_findings(with_status(columns, range(0))) == ()


def run_with(factor: float) -> RunResult:
    """A drive whose filter believes in noise smaller by a factor than the scanner has; constants are exact."""
    observation = PROJECT.parameters.observation
    believed = replace(
        observation,
        range_sigma=observation.range_sigma / factor,
        bearing_sigma=observation.bearing_sigma / factor,
    )
    filtered = replace(PROJECT.parameters.filter, consider=False)
    parameters = replace(PROJECT.parameters, observation=believed, filter=filtered, odometry=PRECISE)
    log = drive()
    return judged_run(RunInput.of(replace(PROJECT, parameters=parameters), log, start_of(PROJECT, log, *belief())))


def belief() -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Pose and sigmas at the start of the drive."""
    initial = start()
    x, y, theta = initial.mean.tolist()
    sx, sy, st = np.sqrt(np.diag(initial.covariance)).tolist()
    return (x, y, theta), (sx, sy, st)


@pytest.mark.parametrize("factor", [2.0, 2.5])
def test_noise_that_is_stated_too_small_is_told_with_its_factor(factor: float) -> None:
    (finding,) = noise_findings(run_with(factor).columns)
    assert "too small" in finding.probably
    # What odometry adds to an innovation is stated rightly: the factor lies between 1 and that of the scanner.
    told = float(finding.probably.split("factor of ")[1].split()[0])
    assert 0.6 * factor < told < factor


def test_noise_that_is_stated_too_large_is_told_and_right_noise_is_not() -> None:
    (finding,) = noise_findings(run_with(1.0 / 6.0).columns)
    assert "too large" in finding.probably
    assert noise_findings(run_with(1.0).columns) == ()


def test_false_detections_are_not_taken_for_noise(columns: RunColumns) -> None:
    # 60 % at twice the distance of a right one and 40 % far off: a Gaussian so wide has 36 % beyond the gate, too, but
    # 13 % beyond twice that.
    run = with_status(replayed(hall(), standing_still(200)).columns, range(0, 80), 1e3)
    assert noise_findings(replace(run, d2=read_only(run.d2 * 4.0))) == ()


def test_a_drive_is_cut_at_the_stations_that_it_passes() -> None:
    # A loop of 60 s: the first station is passed twice, the second looks the other way, the third lies beside.
    result = run_with(1.0)
    poses = result.columns.means
    at = [100, 300]
    stations = tuple(
        Station(name=name, x=float(x), y=float(y), heading=float(heading))
        for name, (x, y, heading) in (
            ("A", poses[at[0]]),
            ("B", poses[at[1]]),
            ("Other way", poses[200] + [0.0, 0.0, math.pi]),
            ("Beside", poses[200] + [1.0, 1.0, 0.0]),
        )
    )
    cut = sections(result.columns, stations)
    assert [(each.begin, each.end) for each in cut][:3] == [("start", "A"), ("A", "B"), ("B", cut[2].end)]
    assert [each.first for each in cut][:3] == [0, *at]
    assert sum(each.figures.cycles for each in cut) == len(result.columns)
    assert cut[-1].end == "end"
    entry = section_entries(cut)[1]
    assert (entry["begin"], entry["end"], entry["cycles"]) == ("A", "B", 200)
    assert entry["from_s"] == pytest.approx(10.0, abs=1e-9)
    assert entry["inliers"] == int(result.columns.counts(Status.INLIER)[100:300].sum())


def test_a_drive_past_no_station_is_one_section() -> None:
    result = replayed(hall(), standing_still(20))
    (only,) = sections(result.columns, ())
    assert (only.begin, only.end, only.figures) == ("start", "end", result.consistency)
