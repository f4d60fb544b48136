"""Intensities of virtual walls against those that a real scanner, a TiM781S at rest in a room, has of its own walls."""

from __future__ import annotations

import math
import struct
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from commission.simulation.scan import VirtualScanner
from commission.site.disturbances import Disturbances
from commission.site.intensity import IntensityModel
from commission.site.project import Project
from commission.site.scanner import Scanner
from tests.simulation.halls import room

SCANNER = Scanner(
    field_of_view_deg=(-135.0, 135.0), resolution_deg=1.0 / 3.0, range_sigma=0.0, bearing_sigma_deg=0.0, rate=15.0
)
WALL = slice(284, 446)
"""Beams on one flat wall, 1.27 to 1.64 m away, met at up to 39 degrees."""
FITTED = slice(0, 60)
"""Those of them by which the model is fitted, at 18 degrees and more; the others, nearer and straighter, judge it."""
TAPE_TO_WALL = 250.0 * math.pi
"""Of `IntensityModel`: tape of ASTM D4956-01, type III, against a white wall."""


def telegrams(path: Path) -> Iterator[bytes]:
    """Scans in a capture: packets (pcapng), in the order of their sequence numbers, cut at the CoLa B frames."""
    raw, place = path.read_bytes(), 0
    streams: dict[bytes, dict[int, bytes]] = defaultdict(dict)
    while place < len(raw):
        kind, size = struct.unpack_from("<II", raw, place)
        if kind == 6:
            (length,) = struct.unpack_from("<I", raw, place + 20)
            packet = raw[place + 28 : place + 28 + length]
            internet = packet[14:] if packet[12:14] == b"\x08\x00" else packet[4:]
            if internet[0] >> 4 == 4 and internet[9] == 6:
                (total,) = struct.unpack_from(">H", internet, 2)
                segment = internet[4 * (internet[0] & 15) : total]
                (number,) = struct.unpack_from(">I", segment, 4)
                streams[internet[12:16] + segment[:2]].setdefault(number, segment[4 * (segment[12] >> 4) :])
        place += size
    for parts in streams.values():
        stream = b"".join(parts[number] for number in sorted(parts))
        at = stream.find(b"\x02\x02\x02\x02")
        while at >= 0:
            (size,) = struct.unpack_from(">I", stream, at + 4)
            body = stream[at + 8 : at + 8 + size]
            is_scan = body.startswith(b"sSN LMDscandata ") and len(body) == size
            if is_scan:
                yield body
            at = stream.find(b"\x02\x02\x02\x02", at + (8 + size if is_scan else 4))


def channel(telegram: bytes, name: bytes) -> np.ndarray:
    """Values of a 16-bit channel."""
    at = telegram.find(name)
    scale, offset, _, _, count = struct.unpack_from(">ffiHH", telegram, at + 5)
    return np.frombuffer(telegram, ">u2", count, at + 21) * scale + offset


@pytest.fixture(scope="module")
def measured(shared_data: Path) -> tuple[np.ndarray, np.ndarray]:
    """Medians over all scans of range [m] and intensity of each beam."""
    found = list(telegrams(shared_data / "sick_captures" / "example_tim781s.pcapng"))
    assert len(found) > 700
    ranges, intensities = (np.median([channel(each, name) for each in found], axis=0) for name in (b"DIST1", b"RSSI1"))
    return 1e-3 * ranges, intensities


def test_a_virtual_wall_fades_with_distance_and_incidence_as_a_real_one(measured) -> None:
    ranges, intensities = (each[WALL] for each in measured)
    bearings = (SCANNER.angle_min + SCANNER.angle_increment * np.arange(SCANNER.beam_count))[WALL]
    points = ranges[:, np.newaxis] * np.column_stack((np.cos(bearings), np.sin(bearings)))
    normal = np.linalg.svd(points - points.mean(axis=0))[2][1]
    normal *= np.sign(normal @ points.mean(axis=0))
    assert ((points - points.mean(axis=0)) @ normal).std() < 0.01
    away, facing = float(points.mean(axis=0) @ normal), math.atan2(normal[1], normal[0])
    # I = k (cos(i) / r^2)^g by the logarithms of the slanting half.
    light = np.log(np.cos(bearings - facing) / ranges**2)
    response, offset = np.polyfit(light[FITTED], np.log(intensities[FITTED]), 1)
    assert 0.1 < response < 0.25
    tape = math.exp(offset) * (TAPE_TO_WALL / 100.0) ** response
    model = IntensityModel(
        enabled=True,
        reflector=tape,
        wall=tape / TAPE_TO_WALL,
        response=response,
        near_distance=0.0,
        noise=0.0,
        largest=1e6,
    )
    project = Project(floor_map=room(10.0, 10.0), scanners=(SCANNER,), disturbances=Disturbances(intensity=model))
    pose = np.array([9.95 - away, 5.0, -facing])
    virtual = VirtualScanner.of(project, SCANNER).bright_scan(pose, np.empty((0, 3)), np.random.default_rng(0))
    error = virtual[1][WALL] / intensities - 1.0
    assert virtual[0][WALL] == pytest.approx(ranges, abs=0.02)
    judged = np.ones(len(error), np.bool_)
    judged[FITTED] = False
    assert np.sqrt(np.mean(error[judged] ** 2)) < 0.02
    assert np.abs(error).max() < 0.04
    # Without a power the same wall would fade by half.
    assert math.exp(light.min() - light.max()) < 0.5
    assert intensities.min() / intensities.max() > 0.85


def test_real_marks_outshine_walls_by_what_the_same_power_makes_of_tape(measured) -> None:
    """Marks 0.94 m away against walls at 1 m: 785 times the light, by a power of 0.13 to 0.18, is 2.4 to 3.3 times."""
    ranges, intensities = measured
    bright = intensities > 35_000.0
    near_by = (ranges > 0.9) & (ranges < 1.3) & (intensities > 12_000.0) & (intensities < 15_000.0)
    ratio = np.median(intensities[bright]) / np.median(intensities[near_by])
    assert bright.sum() >= 5
    assert TAPE_TO_WALL**0.13 < ratio < TAPE_TO_WALL**0.18
