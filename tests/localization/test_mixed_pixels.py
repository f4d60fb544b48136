"""Beams that meet a reflector and the wall behind it measure something in between, and must not say where it is.

The oracle is a fan of thin rays (`thick_beams`): a beam's range is the mean of what its rays meet.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from commission.localization.detector import detect
from commission.localization.detector_model import detector_model
from commission.localization.estimate import Status
from commission.site.parameters import DetectorParameters
from commission.site.records import Scan
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.scanner import Scanner
from tests.localization.thick_beams import Target, ThickBeams, scans_of

SCANS = 300
BEAMS = ThickBeams(
    step=math.radians(0.25),
    divergence=math.radians(0.3),
    share=0.2,
    bearing_sigma=math.radians(0.03),
    range_sigma=0.01,
)


def found(target: Target, seed: int = 0, **options: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Clusters of each scan, whether one of them passes, and errors of range [m] and bearing [rad] of what passes."""
    ranges, flags, angle_min, places = scans_of(BEAMS, target, SCANS, np.random.default_rng(seed))
    scanner = Scanner(
        resolution_deg=0.25, beam_width_deg=0.3, bearing_sigma_deg=0.03, range_sigma=0.01, reflector_range=40.0
    )
    parameters = DetectorParameters(**options)
    kind = ReflectorKind.CYLINDER if target.incidence is None else ReflectorKind.FLAT
    only = ReflectorMap((Reflector(id="R", x=0.0, y=0.0, radius=target.radius, kind=kind),))
    model = detector_model(only, scanner, parameters)
    clusters, passes, errors = [], [], []
    for row, seen, place in zip(ranges, flags, places, strict=True):
        scan = Scan(
            stamp_ns=0, ranges=row, angle_min=angle_min, angle_increment=BEAMS.step, intensities=None, reflector=seen
        )
        detected = detect(scan, model, parameters)
        inliers = detected.range_bearing[detected.status == Status.INLIER]
        clusters.append(len(detected.status))
        passes.append(len(inliers) > 0)
        errors += [each - (target.distance, place) for each in inliers[:1]]
    return np.array(clusters), np.array(passes), np.array(errors)


POSTS = [(0.04, None), (0.075, None), (0.1, 0.0), (0.1, math.radians(40.0))]


@pytest.mark.parametrize("gap", [0.15, 0.4, 1.0, 4.0])
@pytest.mark.parametrize(("radius", "incidence"), POSTS)
@pytest.mark.parametrize("distance", [2.0, 4.0, 7.0])
def test_a_wall_behind_neither_splits_a_reflector_nor_moves_it(
    distance: float, radius: float, incidence: float | None, gap: float
) -> None:
    alone = Target(distance=distance, radius=radius, incidence=incidence)
    before = Target(distance=distance, radius=radius, incidence=incidence, background=distance + gap)
    _, _, expected = found(alone)
    clusters, passes, errors = found(before)
    assert clusters.max() == 1
    # A plate that stands obliquely, whose edge beams are hidden in its own slope, may show a beam too many.
    assert passes.mean() >= (0.99 if incidence is None else 0.93)
    range_error, bearing_error = errors.mean(axis=0)
    # What lies less deep than a post, or a plate as steep as it may be, cannot be told from it.
    assert abs(range_error) <= (0.015 if incidence is None else 0.03)
    assert abs(bearing_error) <= 3e-4
    assert errors[:, 1].std() <= 1.6 * expected[:, 1].std()


def test_with_equation_3_as_printed_mixed_beams_are_reflectors_of_their_own() -> None:
    target = Target(distance=4.0, radius=0.04, background=8.0)
    clusters, _, errors = found(target, expected_beams="equation_3")
    assert (clusters > 1).mean() >= 0.95
    assert np.abs(errors[:, 0]).max() > 0.5


def test_a_reflector_close_beside_another_behind_it_is_not_taken_for_mixed_beams() -> None:
    near = Target(distance=3.0, radius=0.06)
    ranges, flags, angle_min, _ = scans_of(BEAMS, near, 1, np.random.default_rng(0))
    end = int(np.flatnonzero(flags[0])[-1]) + 1
    model = detector_model(
        ReflectorMap((Reflector(id="R", x=0.0, y=0.0, radius=0.06),)),
        Scanner(resolution_deg=0.25, beam_width_deg=0.3, range_sigma=0.01),
        DetectorParameters(),
    )
    for beams, bodies in ((1, 1), (2, 1), (3, 2), (4, 2)):
        row, seen = ranges[0].copy(), flags[0].copy()
        row[end : end + beams], seen[end : end + beams] = 5.0, True
        scan = Scan(
            stamp_ns=0, ranges=row, angle_min=angle_min, angle_increment=BEAMS.step, intensities=None, reflector=seen
        )
        detected = detect(scan, model, DetectorParameters())
        assert len(detected.status) == bodies, beams
        assert detected.range_bearing[0, 0] == pytest.approx(3.0, abs=0.02)
