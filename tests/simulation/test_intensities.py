"""Intensities of virtual scans against closed forms that are written out here, effect by effect."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.simulation.scan import VirtualScanner
from commission.site.disturbances import Disturbances, ShinyObject, TiltedStretch
from commission.site.intensity import IntensityModel
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.scanner import Scanner
from tests.simulation.halls import QUIET, room

NOBODY = np.empty((0, 3))
THIN = replace(QUIET, beam_width_deg=0.0, resolution_deg=0.25)
"""Beams without a width, so that none is mixed."""
PURE = IntensityModel(enabled=True, noise=0.0, crosstalk=0.0, near_distance=0.0, echo_length=0.0, largest=1e6)
"""The fall with distance and incidence alone."""


def scan(
    model: IntensityModel,
    scanner: Scanner = THIN,
    *,
    seed: int = 0,
    circles: np.ndarray = NOBODY,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    **site: object,
) -> tuple[np.ndarray, np.ndarray]:
    disturbances = replace(site.pop("disturbances", Disturbances()), intensity=model)  # pyright: ignore[reportArgumentType]
    project = Project(scanners=(scanner,), disturbances=disturbances, **site)  # pyright: ignore[reportArgumentType]
    virtual = VirtualScanner.of(project, project.scanners[0])
    return virtual.bright_scan(np.array(pose), circles, np.random.default_rng(seed))


def plate(distance: float, turned_deg: float = 0.0, radius: float = 0.3) -> ReflectorMap:
    """A plate straight ahead whose normal is turned out of the line of sight."""
    heading = math.pi + math.radians(turned_deg)
    return ReflectorMap(
        (Reflector(id="P", x=distance, y=0.0, radius=radius, kind=ReflectorKind.FLAT, heading=heading),)
    )


def bearings(scanner: Scanner) -> np.ndarray:
    return scanner.angle_min + scanner.angle_increment * np.arange(scanner.beam_count)


def ahead(scanner: Scanner) -> int:
    return int(np.argmin(np.abs(bearings(scanner))))


@pytest.mark.parametrize("distance", [0.4, 1.0, 2.5, 10.0, 19.0, 29.0])
def test_intensity_falls_with_the_square_of_the_distance_and_rises_in_the_near_field(distance: float) -> None:
    model = replace(PURE, near_distance=1.2, reflector=3.0)
    ranges, intensities = scan(model, reflectors=plate(distance))
    overlap = (1.0 - math.exp(-((distance / 1.2) ** 2))) / (1.0 - math.exp(-((10.0 / 1.2) ** 2)))
    # Ranges are float32.
    assert ranges[ahead(THIN)] == pytest.approx(distance, rel=1e-6)
    assert intensities[ahead(THIN)] == pytest.approx(3.0 * overlap * (10.0 / distance) ** 2, rel=1e-5)
    nothing = np.isnan(ranges)
    assert nothing.any()
    assert (intensities[nothing] == 0.0).all()


def test_intensity_of_a_scanner_that_corrects_for_the_distance_stays() -> None:
    model = replace(PURE, range_exponent=0.0, reference_distance=4.0)
    near, far = (scan(model, reflectors=plate(d))[1][ahead(THIN)] for d in (2.0, 25.0))
    assert near == pytest.approx(far) == pytest.approx(1.0)


@pytest.mark.parametrize("turned_deg", [0.0, 10.0, 30.0, -45.0, 65.0, 80.0])
def test_tape_fades_with_the_power_of_the_cosine_of_the_incidence(turned_deg: float) -> None:
    _, intensities = scan(PURE, reflectors=plate(5.0, turned_deg))
    assert intensities[ahead(THIN)] == pytest.approx(4.0 * math.cos(math.radians(turned_deg)) ** 3.5, rel=1e-5)


def test_tape_seen_from_behind_returns_nothing() -> None:
    assert not scan(PURE, reflectors=plate(5.0, 95.0))[1].any()


def test_the_fall_of_tape_is_that_of_the_standard() -> None:
    """ASTM D4956-01, type III, white, at 0.2 degrees: 250 at -4 degrees of entrance, 150 at 30."""
    at = {turned: scan(PURE, reflectors=plate(5.0, turned))[1][ahead(THIN)] for turned in (-4.0, 30.0)}
    assert at[30.0] / at[-4.0] == pytest.approx(150.0 / 250.0, rel=0.02)
    defaults = IntensityModel()
    # The same unit: a white Lambertian wall has 1 / pi.
    assert defaults.reflector / defaults.wall == pytest.approx(250.0 * math.pi, rel=0.03)


def test_a_post_is_darker_towards_its_edges() -> None:
    radius, distance = 0.2, 3.0
    reflectors = ReflectorMap((Reflector(id="R", x=distance, y=0.0, radius=radius),))
    ranges, intensities = scan(PURE, reflectors=reflectors)
    met = np.flatnonzero(np.isfinite(ranges))
    assert len(met) == 2 * math.floor(math.degrees(math.asin(radius / distance)) / 0.25) + 1
    for i in met:
        # The normal at the point that is met, by its coordinates.
        point = ranges[i] * np.array([math.cos(bearings(THIN)[i]), math.sin(bearings(THIN)[i])])
        normal = (point - (distance, 0.0)) / radius
        cosine = -float(normal @ point) / float(np.hypot(*point))
        expected = cosine**3.5 * (10.0 / float(ranges[i])) ** 2
        # Near the edge, of which ranges are float32, the cosine is known to 1e-4.
        assert intensities[i] == pytest.approx(expected, rel=2e-3, abs=1e-3)


def test_walls_fade_with_the_cosine_of_the_incidence_and_the_distance() -> None:
    turn = replace(THIN, field_of_view_deg=(-180.0, 180.0))
    ranges, intensities = scan(replace(PURE, wall=0.7), turn, floor_map=room(10.0, 10.0), pose=(4.0, 3.0, 0.3))
    angles = bearings(turn) + 0.3
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angles) > 0, 9.95 - 4.0, 4.0 - 0.05) / np.abs(np.cos(angles))
        to_y = np.where(np.sin(angles) > 0, 9.95 - 3.0, 3.0 - 0.05) / np.abs(np.sin(angles))
    cosines = np.where(to_x < to_y, np.abs(np.cos(angles)), np.abs(np.sin(angles)))
    assert ranges == pytest.approx(np.minimum(to_x, to_y), abs=2e-6)
    expected = 0.7 * cosines * (10.0 / np.minimum(to_x, to_y)) ** 2
    # Within two beams of a corner the neighbors stand on another wall.
    corners = np.flatnonzero(np.diff(np.sign(to_x - to_y)))
    apart = np.abs(np.arange(len(angles))[:, np.newaxis] - corners - 0.5).min(axis=1)
    assert len(corners) == 4
    assert intensities[apart > 2.0] == pytest.approx(expected[apart > 2.0], rel=1e-4)


def test_people_are_dark_and_hide_what_is_behind_them() -> None:
    circles = np.array([[3.0, 0.0, 0.1]])
    ranges, intensities = scan(replace(PURE, people=0.02), reflectors=plate(5.0), circles=circles)
    i = ahead(THIN)
    assert ranges[i] == pytest.approx(2.9)
    assert intensities[i] == pytest.approx(0.02 * (10.0 / 2.9) ** 2, rel=1e-5)
    beside = np.flatnonzero(intensities > 1.0)
    assert (np.abs(np.degrees(bearings(THIN)[beside])) > math.degrees(math.asin(0.1 / 3.0)) - 0.25).all()


def test_shiny_objects_mirror_where_the_beam_comes_straight() -> None:
    model = replace(PURE, wall=0.05, shiny=2.0, shiny_lobe=0.2)
    shiny = Disturbances(shiny_objects=(ShinyObject(4.0, 0.0, 0.5),))
    _, intensities = scan(model, disturbances=shiny)
    for off_deg in (0.0, 1.0, 3.0, 6.0):
        bearing = math.radians(off_deg)
        incidence = math.asin(4.0 * math.sin(bearing) / 0.5)
        distance = 4.0 * math.cos(bearing) - math.sqrt(0.25 - (4.0 * math.sin(bearing)) ** 2)
        straight = 2.0 * math.exp(-0.5 * (incidence / 0.2) ** 2) + 0.05 * math.cos(incidence)
        found = intensities[ahead(THIN) + round(off_deg / 0.25)]
        assert found == pytest.approx(straight * (10.0 / distance) ** 2, rel=1e-4)


WIDE = replace(QUIET, resolution_deg=0.25, beam_width_deg=1.0)


def edge_beams(behind: float, model: IntensityModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A plate 5 m ahead before a wall: share of each beam on it, ranges and intensities."""
    floor = room(40.0, 40.0)
    x = 39.95 - 5.0 - behind
    heading = math.pi
    reflectors = ReflectorMap(
        (Reflector(id="P", x=x + 5.0, y=20.0, radius=0.3, kind=ReflectorKind.FLAT, heading=heading),)
    )
    ranges, intensities = scan(model, WIDE, floor_map=floor, reflectors=reflectors, pose=(x, 20.0, 0.0))
    edge, half, b = math.atan(0.3 / 5.0), math.radians(0.5), bearings(WIDE)
    shares = np.clip(np.minimum(b + half, edge) - np.maximum(b - half, -edge), 0.0, None) / (2.0 * half)
    return shares, ranges, intensities


def test_a_mixed_beam_lies_between_what_it_meets_by_the_light_of_each() -> None:
    model = replace(PURE, wall=0.6, echo_length=0.5, range_exponent=0.0, reflector_exponent=0.0)
    shares, ranges, intensities = edge_beams(0.25, model)
    mixed = np.flatnonzero((shares > 0.0) & (shares < 1.0))
    assert len(mixed) >= 6
    edge, b = math.atan(0.3 / 5.0), bearings(WIDE)
    for i in mixed:
        low, high = max(b[i] - math.radians(0.5), -edge), min(b[i] + math.radians(0.5), edge)
        front, back = 5.0 / math.cos(0.5 * (low + high)), 5.25 / math.cos(b[i])
        light = shares[i], (1.0 - shares[i]) * 0.6 * math.cos(b[i])
        assert intensities[i] == pytest.approx(sum(light), rel=1e-5)
        assert ranges[i] == pytest.approx((light[0] * front + light[1] * back) / sum(light), rel=1e-6)


def test_of_echoes_too_far_apart_the_stronger_counts() -> None:
    model = replace(PURE, wall=0.6, echo_length=0.5, range_exponent=0.0, reflector_exponent=0.0)
    shares, ranges, _ = edge_beams(3.0, model)
    # Equal light where s = 0.6 (1 - s): s = 0.375.
    on_plate = ranges < 6.0
    assert on_plate[shares > 0.38].all()
    assert not on_plate[shares < 0.37].any()


def test_beams_beside_a_strong_reflector_return_its_overflow_from_its_distance() -> None:
    model = replace(PURE, crosstalk=0.02, crosstalk_width=0.02)
    ranges, intensities = scan(model, reflectors=plate(2.0))
    b, plain = bearings(THIN), scan(PURE, reflectors=plate(2.0))
    on_plate = np.isfinite(plain[0])
    beside = np.flatnonzero(~on_plate & np.isfinite(ranges))
    assert len(beside) > 20
    for i in beside:
        apart = np.abs(b - b[i])
        weights = np.where(on_plate & (apart < 0.16), 0.02 * plain[1] * np.exp(-apart / 0.02), 0.0)
        assert intensities[i] == pytest.approx(weights.sum(), rel=1e-4)
        assert ranges[i] == pytest.approx(np.nansum(weights * np.nan_to_num(plain[0])) / weights.sum(), rel=1e-5)
    np.testing.assert_array_equal(intensities[on_plate], plain[1][on_plate])


def test_overflow_hides_a_dark_wall_close_behind_and_mixes_with_it() -> None:
    shares, ranges, _ = edge_beams(1.0, replace(PURE, crosstalk=0.05, crosstalk_width=0.02, wall=0.001))
    _, without, _ = edge_beams(1.0, replace(PURE, wall=0.001))
    beside = np.flatnonzero(shares == 0.0)
    first = beside[np.argmin(np.abs(np.abs(bearings(WIDE)[beside]) - math.atan(0.06)))]
    assert without[first] == pytest.approx(6.0, abs=0.02)
    assert ranges[first] == pytest.approx(5.0, abs=0.02)


@pytest.mark.parametrize("response", [0.18, 0.5, 1.0])
def test_a_scanner_reports_a_power_of_the_light_from_that_of_tape_down(response: float) -> None:
    model = replace(PURE, reflector=300.0, wall=3.0, response=response)
    assert scan(model, reflectors=plate(10.0))[1][ahead(THIN)] == pytest.approx(300.0, rel=1e-5)
    of_wall = scan(model, floor_map=room(20.0, 20.0), pose=(10.05, 10.0, 0.0))[1][ahead(THIN)]
    assert of_wall == pytest.approx(300.0 * (3.0 * (10.0 / 9.9) ** 2 / 300.0) ** response, rel=1e-5)


@pytest.mark.parametrize(("level", "expected"), [(0.49, 49.0), (0.51, 50.0)])
def test_the_receiver_saturates(level: float, expected: float) -> None:
    _, intensities = scan(replace(PURE, reflector=level, largest=50.0), reflectors=plate(1.0))
    assert intensities[ahead(THIN)] == pytest.approx(expected)


def test_noise_is_a_share_of_the_intensity_and_the_same_share_everywhere() -> None:
    found = np.array(
        [scan(replace(PURE, noise=0.1), seed=seed, reflectors=plate(4.0))[1][ahead(THIN)] for seed in range(800)]
    )
    expected = (10.0 / 4.0) ** 2
    assert found.mean() == pytest.approx(expected, rel=4.0 * 0.1 / math.sqrt(800))
    # A standard deviation of 800 draws is known to 2.5 %.
    assert found.std() / expected == pytest.approx(0.1, rel=0.1)


def test_what_is_black_still_stands_in_the_way() -> None:
    ranges, intensities = scan(replace(PURE, reflector=0.0), reflectors=plate(4.0))
    assert ranges[ahead(THIN)] == pytest.approx(4.0)
    assert not intensities.any()


def test_on_tilted_floor_beams_end_dark() -> None:
    tilted = Disturbances(tilted_stretches=(TiltedStretch(0.0, 0.0, 1.0, 3.0),))
    ranges, intensities = scan(PURE, reflectors=plate(4.0), disturbances=tilted)
    assert ranges == pytest.approx(3.0)
    assert not intensities.any()
    assert scan(PURE, reflectors=plate(2.5), disturbances=tilted)[1][ahead(THIN)] == pytest.approx(16.0)


def test_glints_are_as_strong_as_tape_where_they_are() -> None:
    glinting = Disturbances(glints_per_scan=3.0)
    model = replace(PURE, wall=0.001)
    ranges, intensities = scan(model, floor_map=room(), pose=(6.0, 4.0, 0.0), disturbances=glinting, seed=4)
    plain = scan(model, floor_map=room(), pose=(6.0, 4.0, 0.0))[1]
    glints = intensities > 10.0 * plain
    assert 3 <= glints.sum() <= 40
    assert intensities[glints] == pytest.approx((10.0 / ranges[glints]) ** 2, rel=1e-5)


@pytest.mark.parametrize("model", [IntensityModel(), replace(PURE, crosstalk=0.01, echo_length=0.4)])
def test_a_sweep_at_rest_is_a_scan_at_one_instant(model: IntensityModel) -> None:
    project = Project(
        floor_map=room(),
        scanners=(Scanner(),),
        reflectors=plate(9.0),
        disturbances=Disturbances(intensity=model, shiny_objects=(ShinyObject(8.0, 5.0, 0.2),)),
    )
    virtual, pose = VirtualScanner.of(project, project.scanners[0]), np.array([4.0, 1.0, 0.2])
    circles = np.array([[6.0, 2.0, 0.1]])
    poses = np.repeat(pose[np.newaxis], project.scanners[0].beam_count, axis=0)
    at_once = virtual.bright_scan(pose, circles, np.random.default_rng(5))
    swept = virtual.bright_scan(pose, circles, np.random.default_rng(5), beam_poses=poses)
    np.testing.assert_allclose(swept[0], at_once[0], rtol=1e-6)
    np.testing.assert_allclose(swept[1], at_once[1], rtol=1e-5)


def test_a_scanner_upside_down_reports_the_mirrored_scan_and_blind_sectors_nothing() -> None:
    reflectors = ReflectorMap((Reflector(id="R", x=4.0, y=1.0, radius=0.2),))
    upright, hanging = (
        scan(PURE, replace(THIN, upside_down=way), reflectors=reflectors, floor_map=room(), pose=(1.0, 1.0, 0.0))
        for way in (False, True)
    )
    for one, other in zip(upright, hanging, strict=True):
        np.testing.assert_allclose(other, one[::-1], rtol=1e-4)
    blind = replace(THIN, blind_sectors_deg=((-10.0, 10.0),))
    ranges, intensities = scan(PURE, blind, reflectors=reflectors, floor_map=room(), pose=(1.0, 1.0, 0.0))
    hidden = np.abs(np.degrees(bearings(blind))) < 10.0 + 1e-6
    assert np.isnan(ranges[hidden]).all()
    assert not intensities[hidden].any()
    np.testing.assert_array_equal(intensities[~hidden], upright[1][~hidden])


def test_ranges_of_thin_beams_are_those_of_scans_with_flags() -> None:
    reflectors = ReflectorMap((Reflector(id="R", x=9.0, y=5.0, radius=0.1),))
    project = Project(
        floor_map=room(),
        scanners=(replace(THIN, range_sigma=0.02, bearing_sigma_deg=0.1),),
        reflectors=reflectors,
        disturbances=Disturbances(intensity=PURE),
    )
    virtual, pose = VirtualScanner.of(project, project.scanners[0]), np.array([3.0, 3.0, 0.4])
    flagged, _ = virtual.scan(pose, NOBODY, np.random.default_rng(8))
    bright, _ = virtual.bright_scan(pose, NOBODY, np.random.default_rng(8))
    np.testing.assert_array_equal(bright, flagged)
