"""Residuals of a drive: their size against noise that is known, in time, by what they go with, counted otherwise."""

from __future__ import annotations

import itertools
import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from commission.io.residual_charts import charts, page_of
from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import DetectorParameters, FilterParameters, OdometryParameters
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies.innovations import innovations
from commission.studies.intensity_peaks import intensity_peaks
from commission.studies.residual_study import EDGES, ResidualInput, ResidualStudy, residual_study
from commission.studies.residual_words import correlation_time, residual_lines
from commission.studies.run import RunInput, judged_run
from commission.studies.sensor_view import peak_of
from commission.studies.start import Start, StartOrigin
from tests.studies.recorded import BEARING_SIGMA, PROJECT, RANGE_SIGMA, SECOND, drive, start

EXACT = OdometryParameters(
    forward_per_sqrt_m=1e-4,
    lateral_per_sqrt_m=1e-4,
    heading_per_sqrt_m=1e-4,
    heading_per_sqrt_rad=1e-4,
    forward_per_sqrt_s=1e-4,
    heading_per_sqrt_s=1e-5,
)
"""The odometry of the drive is: what is left is the noise of detections."""


@cache
def studied(
    range_factor: float = 1.0,
    bearing_factor: float = 1.0,
    late_s: float = 0.0,
    odometry: OdometryParameters = EXACT,
    scale: float = 1.0,
) -> ResidualStudy:
    """The drive by formulas, with sigmas that are wrong by these factors."""
    observation = replace(
        PROJECT.parameters.observation,
        range_sigma=RANGE_SIGMA / range_factor,
        bearing_sigma=BEARING_SIGMA / bearing_factor,
    )
    parameters = replace(
        PROJECT.parameters,
        observation=observation,
        filter=FilterParameters(consider=False),
        odometry=odometry,
    )
    log = drive(late_s=late_s)
    log = replace(log, range_bearing=log.range_bearing * (scale, 1.0))
    given = RunInput.of(replace(PROJECT, parameters=parameters), log, Start(start(), StartOrigin.GIVEN))
    return residual_study(ResidualInput(run=judged_run(given), floor_map=None))


def test_a_sigma_that_is_half_or_twice_the_noise_is_told_with_its_factor() -> None:
    small = studied(range_factor=2.0)
    assert small.factors == pytest.approx([2.0, 1.0], rel=0.08)
    lines = residual_lines(small)
    assert any(line.startswith(("your range sigma is 2.0", "your range sigma is 1.9")) for line in lines)
    assert "your bearing sigma fits" in lines
    # The same where odometry is taken for far worse than it is: its noise is no excuse for that of detections.
    vague = studied(range_factor=2.0, odometry=OdometryParameters())
    assert vague.factors == pytest.approx([2.0, 1.0], rel=0.08)
    assert any("less sure of its pose than it could be" in line for line in residual_lines(vague))
    large = studied(bearing_factor=0.5)
    assert large.factors == pytest.approx([1.0, 0.5], rel=0.1)
    assert any("bearing sigma is" in line and "too large" in line for line in residual_lines(large))


def test_a_drive_with_the_noise_that_is_stated_has_nothing_to_name() -> None:
    study = studied()
    assert residual_lines(study)[:2] == ("your range sigma fits", "your bearing sigma fits")
    assert not any("go with" in line or "alike" in line for line in residual_lines(study))
    assert correlation_time(study, 0) == correlation_time(study, 1) == 0.0
    # Counted by hand: between edges, and beyond; chi-square with two degrees of freedom has exp(-d2 / 2) beyond d2.
    columns = study.inputs.run.columns
    d2 = [float(each) for each in columns.d2 if math.isfinite(each)]
    assert study.counts.tolist() == [sum(low <= each < high for each in d2) for low, high in itertools.pairwise(EDGES)]
    assert study.total == len(d2)
    for low, high, count in zip(EDGES[:-1], EDGES[1:], study.counts, strict=True):
        wanted = len(d2) * (math.exp(-0.5 * low) - math.exp(-0.5 * high))
        assert abs(count - wanted) < 5.0 * math.sqrt(wanted) + 1.0


def test_the_first_innovation_of_each_scan_is_that_of_the_filter() -> None:
    columns = studied().inputs.run.columns
    found = innovations(columns, columns.segments[0].setup)
    # Later ones of a scan meet a fresher state (Algorithm 1).
    first = columns.offsets[:-1][np.diff(columns.offsets) > 0]
    d2 = np.einsum(
        "ni,nij,nj->n", found.residuals[first], np.linalg.inv(found.covariances[first]), found.residuals[first]
    )
    assert d2 == pytest.approx(columns.d2[first], rel=1e-6, nan_ok=True)


def test_scans_that_are_late_leave_residuals_that_are_alike_in_time() -> None:
    lines = residual_lines(studied(late_s=0.05))
    assert any("residuals of one reflector are alike for" in line for line in lines), lines
    assert any("the filter is surer of its pose than it should be" in line for line in lines), lines


def test_ranges_that_are_a_share_too_long_go_with_range_alone() -> None:
    lines = [line for line in residual_lines(studied(scale=1.003)) if "go with" in line]
    (line,) = [line for line in lines if line.startswith("range residuals go with range: ")]
    near, far = (
        float(part.split(" mm")[0]) for part in line.removeprefix("range residuals go with range: ").split(", ")
    )
    # 0.3 % of 4 and of 14 m lie 30 mm apart, of which the pose, pushed to and fro, takes a part.
    assert 10.0 < far - near < 40.0, line


def test_correlations_are_those_of_pairs_counted_one_by_one() -> None:
    study = studied(late_s=0.05)
    columns = study.inputs.run.columns
    found = innovations(columns, columns.segments[0].setup)
    series: dict[tuple[int, int], float] = {}
    for cycle, (begin, end) in enumerate(zip(columns.offsets[:-1], columns.offsets[1:], strict=True)):
        for row in range(begin, end):
            if columns.reflector[row] >= 0 and columns.d2[row] < 25.0:
                z = found.residuals[row, 1] / math.sqrt(found.covariances[row, 1, 1])
                series[int(columns.reflector[row]), cycle] = z
    mean = sum(series.values()) / len(series)
    variance = sum((each - mean) ** 2 for each in series.values()) / len(series)
    step = round(study.lags[1] / 0.1)
    pairs = [(a - mean) * (series[of, k + step] - mean) for (of, k), a in series.items() if (of, k + step) in series]
    assert study.correlations[1, 1] == pytest.approx(sum(pairs) / len(pairs) / variance, rel=1e-9)
    assert study.chance[1] == pytest.approx(1.96 / math.sqrt(len(pairs)))


def test_each_relation_holds_every_residual_once_and_its_mean() -> None:
    study = studied()
    columns = study.inputs.run.columns
    found = innovations(columns, LocalizerSetup.of(replace(PROJECT, parameters=columns.segments[0].setup.parameters)))
    mean = float(found.residuals[np.isfinite(columns.d2) & (columns.d2 < 25.0), 0].mean())
    assert {each.name for each in study.relations} == {"range", "bearing", "speed", "turn rate"}
    for relation in study.relations:
        assert relation.counts.sum() == study.total
        assert (relation.counts * relation.means[:, 0]).sum() / study.total == pytest.approx(mean, abs=1e-6)
        assert np.all(np.diff(relation.places) > 0.0)


def test_plots_are_drawn_of_all_that_is_known_and_the_page_says_what_it_is_of() -> None:
    study = studied()
    drawn = list(charts(study))
    assert len(drawn) >= 2 + 2 * len(study.relations)
    for each in drawn:
        ET.fromstring(each)
        assert "nan" not in each
    page = page_of(study, ["a < b"], ["project: 12"])
    assert "a &lt; b" in page
    assert "project: 12" in page
    assert page.count("<svg") == len(drawn)


def test_ranges_that_are_longer_where_an_echo_is_bright_go_with_intensity() -> None:
    rng, period, radius, beams = np.random.default_rng(7), SECOND // 10, 0.04, 1440
    around = np.column_stack((np.linspace(-2.9, 2.4, 7), rng.uniform(2.5, 4.5, 7)))
    angles = -math.pi + math.radians(0.25) * np.arange(beams)
    stamps = np.arange(1, 401) * period
    is_bright = rng.random(400) < 0.5
    ranges, intensities = np.full((400, beams), 8.0), rng.uniform(5.0, 20.0, (400, beams))
    for bearing, distance in around:
        off = np.remainder(angles - bearing + math.pi, 2.0 * math.pi) - math.pi
        hit = np.flatnonzero(np.abs(off) < math.asin(radius / distance))
        surface = distance * np.cos(off[hit]) - np.sqrt(radius**2 - (distance * np.sin(off[hit])) ** 2)
        longer = np.where(is_bright, 0.015, -0.015) + rng.normal(0.0, 0.003, 400)
        ranges[:, hit] = surface + longer[:, np.newaxis]
        intensities[:, hit] = np.where(is_bright, 3000.0, 1500.0)[:, np.newaxis] - rng.uniform(
            0.0, 50.0, (400, len(hit))
        )
    scans = ScanLog.even(
        stamps, ranges.astype(np.float32), (-math.pi, math.radians(0.25)), intensities=intensities.astype(np.float32)
    )
    log = RecordLog(odometry_stamps_ns=np.arange(402) * period, displacements=np.zeros((402, 3)), scans=(scans,))
    places = around[:, 1:] * np.column_stack((np.cos(around[:, 0]), np.sin(around[:, 0])))
    parameters = replace(PROJECT.parameters, detector=DetectorParameters(enabled=False, intensity_threshold=1000.0))
    reflectors = tuple(Reflector(id=f"R{i}", x=float(x), y=float(y), radius=radius) for i, (x, y) in enumerate(places))
    project = replace(PROJECT, reflectors=ReflectorMap(reflectors), parameters=parameters)
    begin = Start(Belief(0, np.zeros(3), 1e-6 * np.eye(3)), StartOrigin.GIVEN)
    run = judged_run(RunInput.of(project, log, begin))
    study = residual_study(ResidualInput(run=run, floor_map=None))
    (relation,) = [each for each in study.relations if each.name == "intensity"]
    assert relation.counts.sum() == study.total > 2000
    assert relation.places[[0, -1]] == pytest.approx([1490.0, 2990.0], abs=40.0)
    # All around alike, so that no pose takes a part of it.
    assert relation.means[[0, -1], 0] == pytest.approx([-0.015, 0.015], abs=0.003)
    (line,) = [line for line in residual_lines(study) if line.startswith("range residuals go with intensity")]
    assert line.endswith("sensor's units")
    # Of single clusters it is found otherwise.
    columns = run.columns
    peaks = intensity_peaks(log, columns.detected, columns.segments[0].setup)
    cycle = np.repeat(np.arange(len(columns)), np.diff(columns.offsets))
    for row in range(0, len(peaks), 97):
        bearing, width = float(columns.detected.range_bearing[row, 1]), int(columns.detected.beams[row])
        assert peaks[row] == peak_of(scans.scan(int(cycle[row])), bearing, width)
    assert not any(each.name == "intensity" for each in studied().relations)
