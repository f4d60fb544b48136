"""Scans against geometry that can be worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.simulation.scan import VirtualScanner
from commission.site.disturbances import Disturbances, ShinyObject, TiltedStretch
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.scanner import Scanner
from tests.simulation.halls import QUIET, room

NOBODY = np.empty((0, 3))
FULL_TURN = replace(QUIET, field_of_view_deg=(-180.0, 180.0))


def scan(project: Project, pose: tuple[float, float, float], circles: np.ndarray = NOBODY, seed: int = 0):
    return VirtualScanner.of(project, project.scanners[0]).scan(np.array(pose), circles, np.random.default_rng(seed))


def bearings(scanner: Scanner) -> np.ndarray:
    return scanner.angle_min + scanner.angle_increment * np.arange(scanner.beam_count)


def equation_3(distance: float, radius: float, scanner: Scanner) -> int:
    return math.floor(2.0 * math.asin(radius / distance) / scanner.angle_increment)


def test_ranges_in_a_square_room_are_those_to_its_four_walls() -> None:
    project = Project(floor_map=room(10.0, 10.0), scanners=(FULL_TURN,))
    ranges, flags = scan(project, (4.0, 3.0, 0.3))
    angles = bearings(FULL_TURN) + 0.3
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angles) > 0, 9.95 - 4.0, 4.0 - 0.05) / np.abs(np.cos(angles))
        to_y = np.where(np.sin(angles) > 0, 9.95 - 3.0, 3.0 - 0.05) / np.abs(np.sin(angles))
    # Ranges are float32.
    assert ranges == pytest.approx(np.minimum(to_x, to_y), abs=2e-6)
    assert not flags.any()


def test_mounting_moves_and_turns_the_scanner() -> None:
    mounted = replace(QUIET, mounting=np.array([1.0, 0.5, math.pi / 2]))
    ranges, _ = scan(Project(floor_map=room(10.0, 10.0), scanners=(mounted,)), (4.0, 3.0, 0.0))
    ahead = np.argmin(np.abs(bearings(mounted)))
    assert ranges[ahead] == pytest.approx(9.95 - 3.5, abs=2e-6)


def test_open_field_returns_nothing() -> None:
    ranges, flags = scan(Project(scanners=(QUIET,)), (0.0, 0.0, 0.0))
    assert np.isnan(ranges).all()
    assert not flags.any()


def test_cylinder_is_met_at_its_nearest_point_and_flagged() -> None:
    reflectors = ReflectorMap((Reflector(id="A", x=5.0, y=0.0, radius=0.1),))
    ranges, flags = scan(Project(reflectors=reflectors, scanners=(QUIET,)), (0.0, 0.0, 0.0))
    assert np.nanmin(ranges) == pytest.approx(4.9, abs=1e-3)
    assert np.array_equal(flags, np.isfinite(ranges))
    middle = bearings(QUIET)[flags].mean()
    assert abs(middle) < QUIET.angle_increment


@pytest.mark.parametrize("distance", [0.7, 1.0, 2.0, 3.5, 5.0, 8.0, 12.0])
@pytest.mark.parametrize("resolution_deg", [0.25, 0.5])
def test_beams_on_a_reflector_follow_equation_3_within_the_detectors_window(
    distance: float, resolution_deg: float
) -> None:
    scanner = replace(Scanner(), resolution_deg=resolution_deg)
    counts = []
    for seed in range(40):
        turn = 0.37 * seed
        place = Reflector(id="A", x=distance * math.cos(turn), y=distance * math.sin(turn))
        project = Project(
            reflectors=ReflectorMap((place,)), scanners=(replace(scanner, field_of_view_deg=(-180.0, 180.0)),)
        )
        counts.append(int(scan(project, (0.0, 0.0, 0.0), seed=seed)[1].sum()))
    errors = np.array(counts) - equation_3(distance, 0.04, scanner)
    # Bearing noise of 0.05 deg now and then moves one beam off either edge.
    assert np.mean((errors >= -1) & (errors <= 2)) >= 0.975
    assert errors.min() >= -2
    assert errors.max() <= 3


def test_reflector_behind_a_full_turn_scanner_is_not_cut_at_the_seam() -> None:
    reflectors = ReflectorMap((Reflector(id="A", x=-2.0, y=0.0),))
    _, flags = scan(Project(reflectors=reflectors, scanners=(FULL_TURN,)), (0.0, 0.0, 0.0))
    assert flags[:2].all()
    assert flags[-2:].all()
    assert 0 <= flags.sum() - equation_3(2.0, 0.04, FULL_TURN) <= 2


def test_reflector_outside_the_field_of_view_is_not_seen() -> None:
    reflectors = ReflectorMap((Reflector(id="A", x=-2.0, y=0.0),))
    _, flags = scan(Project(reflectors=reflectors, scanners=(QUIET,)), (0.0, 0.0, 0.0))
    assert not flags.any()


def test_reflector_beyond_its_detection_range_is_a_wall() -> None:
    reflectors = ReflectorMap((Reflector(id="A", x=11.0, y=4.0, radius=0.1),))
    near_sighted = replace(QUIET, reflector_range=5.0)
    ranges, flags = scan(Project(floor_map=room(), reflectors=reflectors, scanners=(near_sighted,)), (1.0, 4.0, 0.0))
    assert not flags.any()
    assert np.isfinite(ranges).all()


def test_person_hides_the_reflector_behind() -> None:
    project = Project(reflectors=ReflectorMap((Reflector(id="A", x=5.0, y=0.0),)), scanners=(QUIET,))
    person = np.array([[2.5, 0.0, 0.2]])
    ranges, flags = scan(project, (0.0, 0.0, 0.0), person)
    assert not flags.any()
    assert np.nanmin(ranges) == pytest.approx(2.3, abs=1e-3)
    _, flags = scan(project, (0.0, 0.0, 0.0), np.array([[7.5, 0.0, 0.2]]))
    assert flags.any()


def test_wall_hides_the_reflector_behind() -> None:
    project = Project(floor_map=room(), reflectors=ReflectorMap((Reflector(id="A", x=13.0, y=4.0),)), scanners=(QUIET,))
    _, flags = scan(project, (6.0, 4.0, 0.0))
    assert not flags.any()


@pytest.mark.parametrize(("facing_deg", "seen"), [(180.0, True), (150.0, True), (100.0, False), (0.0, False)])
def test_flat_plate_is_flagged_only_where_it_faces_the_scanner(facing_deg: float, seen: bool) -> None:
    plate = Reflector(id="P", x=4.0, y=0.0, radius=0.15, kind=ReflectorKind.FLAT, heading=math.radians(facing_deg))
    ranges, flags = scan(Project(reflectors=ReflectorMap((plate,)), scanners=(QUIET,)), (0.0, 0.0, 0.0))
    assert flags.any() == seen
    if seen:
        lit = ranges[flags] * np.exp(1j * bearings(QUIET)[flags])
        normal = np.exp(1j * math.radians(facing_deg))
        across = np.real((lit - 4.0) * np.conj(normal))
        # Edge beams report the middle of their lit part, off the beam's own bearing by up to half its width.
        assert np.abs(across[1:-1]).max() < 1e-5
        assert np.ptp(np.imag((lit - 4.0) * np.conj(normal))) == pytest.approx(0.3, abs=0.07)


@pytest.mark.parametrize("bearing_deg", [0.0, 77.0, -110.0])
def test_plate_of_unknown_direction_faces_the_scanner_wherever_that_is(bearing_deg: float) -> None:
    place = 4.0 * np.exp(1j * math.radians(bearing_deg))
    plate = Reflector(id="P", x=place.real, y=place.imag, radius=0.15, kind=ReflectorKind.FLAT)
    facing = replace(plate, heading=math.radians(bearing_deg + 180.0))
    seen, expected = (
        scan(Project(reflectors=ReflectorMap((each,)), scanners=(QUIET,)), (0.0, 0.0, 0.0)) for each in (plate, facing)
    )
    assert expected[1].any()
    assert np.array_equal(seen[1], expected[1])
    np.testing.assert_allclose(seen[0], expected[0], atol=1e-6)


def test_shiny_object_passes_for_a_reflector() -> None:
    project = Project(scanners=(QUIET,), disturbances=Disturbances(shiny_objects=(ShinyObject(3.0, 1.0),)))
    _, flags = scan(project, (0.0, 0.0, 0.0))
    assert flags.any()


def test_tilted_floor_cuts_every_beam_and_hides_reflectors() -> None:
    project = Project(
        floor_map=room(),
        reflectors=ReflectorMap(
            (
                Reflector(id="Near", x=4.0, y=4.0),
                Reflector(id="Far", x=8.0, y=4.0, radius=0.1),
                Reflector(id="Aside", x=8.0, y=6.0, radius=0.1),  # in nobody's shadow
            )
        ),
        scanners=(QUIET,),
        disturbances=Disturbances(tilted_stretches=(TiltedStretch(2.0, 4.0, 1.0),)),
    )
    ranges, flags = scan(project, (2.0, 4.0, 0.0))
    assert np.max(ranges) == pytest.approx(4.0, abs=1e-6)
    assert np.max(ranges[flags]) < 2.1
    ranges, flags = scan(project, (3.5, 4.0, math.pi))
    assert np.max(ranges) < 6.1
    _, flags = scan(project, (5.0, 4.0, 0.0))
    assert flags.any()


def test_range_noise_has_the_scanners_sigma() -> None:
    scanner = replace(QUIET, range_sigma=0.02)
    clean, _ = scan(Project(floor_map=room(), scanners=(QUIET,)), (5.0, 4.0, 0.0))
    noisy = np.stack(
        [scan(Project(floor_map=room(), scanners=(scanner,)), (5.0, 4.0, 0.0), seed=k)[0] for k in range(20)]
    )
    errors = noisy - clean
    # 10,800 draws: 1-sigma of the standard deviation is 0.7 %, of the mean 0.2 mm.
    assert np.std(errors) == pytest.approx(0.02, rel=0.035)
    assert abs(np.mean(errors)) < 0.001


def test_glints_come_at_their_rate_in_short_runs_of_beams() -> None:
    project = Project(floor_map=room(), scanners=(QUIET,), disturbances=Disturbances(glints_per_scan=0.5))
    scanner, rng = VirtualScanner.of(project, project.scanners[0]), np.random.default_rng(0)
    starts = longest = 0
    for _ in range(400):
        _, flags = scanner.scan(np.array([5.0, 4.0, 0.0]), NOBODY, rng)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
        starts += len(edges) // 2
        longest = max(longest, *np.diff(edges)[::2], 0) if len(edges) else longest
    # 200 expected of a Poisson law with sigma 14; a few overlap.
    assert 140 < starts < 260
    assert longest >= 5


def test_echoes_nearer_than_the_scanner_measures_are_missing() -> None:
    blind = replace(QUIET, range=(1.0, 30.0))
    ranges, _ = scan(Project(floor_map=room(), scanners=(blind,)), (0.5, 4.0, math.pi))
    assert np.isnan(ranges[np.argmin(np.abs(bearings(blind)))])
    assert np.nanmin(ranges) >= 1.0


@pytest.mark.parametrize("upside_down", [False, True])
def test_nothing_comes_back_from_blind_sectors_and_all_else_to_the_last_bit(upside_down: bool) -> None:
    scanner = replace(FULL_TURN, upside_down=upside_down, range_sigma=0.01)
    reflectors = ReflectorMap(tuple(Reflector(id=str(i), x=4.0 + i, y=3.0 + i) for i in (-2, 2)))
    sectors = ((-160.0, -20.0), (30.0, 31.0))
    disturbances = Disturbances(glints_per_scan=20.0)
    seeing, blind = (
        scan(
            Project(floor_map=room(), reflectors=reflectors, scanners=(each,), disturbances=disturbances),
            (4.0, 3.0, 0.4),
        )
        for each in (scanner, replace(scanner, blind_sectors_deg=sectors))
    )
    reported = np.degrees(bearings(scanner))
    hidden = np.array([any(low - 1e-6 <= beam <= high + 1e-6 for low, high in sectors) for beam in reported])
    assert seeing[1][hidden].any()
    assert np.isnan(blind[0][hidden]).all()
    assert not blind[1][hidden].any()
    for one, other in zip(seeing, blind, strict=True):
        assert one[~hidden].tobytes() == other[~hidden].tobytes()
