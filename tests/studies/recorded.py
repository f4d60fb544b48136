"""A drive by formulas alone, as a recording: an oval with changing speed, seen by a scanner that has noise alone."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from commission.geometry import se2
from commission.localization.estimate import Belief
from commission.site.parameters import ObservationParameters, Parameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

SECOND = 1_000_000_000
PLACES = ((1.0, 1.0), (14.0, 0.5), (18.5, 7.0), (12.0, 13.0), (4.0, 12.0), (0.5, 6.5), (9.0, 7.0))
RANGE_SIGMA, BEARING_SIGMA = 0.01, 0.002

PROJECT = Project(
    reflectors=ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y, radius=0.04) for i, (x, y) in enumerate(PLACES))),
    scanners=(Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.5, rate=10.0, range=(0.05, 30.0)),),
    parameters=dataclasses.replace(
        Parameters(), observation=ObservationParameters(range_sigma=RANGE_SIGMA, bearing_sigma=BEARING_SIGMA)
    ),
)


def pose_at(t: np.ndarray) -> np.ndarray:
    """(N, 3) pose on an oval about (9, 6.5); the speed swings between 0.4 and 1.6 m/s in eight seconds."""
    along = 0.15 * t + 0.07 * np.sin(2.0 * math.pi * t / 8.0)
    x, y = 9.0 + 6.0 * np.cos(along), 6.5 + 4.0 * np.sin(along)
    return np.stack([x, y, np.unwrap(np.arctan2(4.0 * np.cos(along), -6.0 * np.sin(along)))], axis=-1)


def drive(
    seconds: float = 60.0,
    *,
    late_s: float = 0.0,
    bias: float = 0.0,
    mirrored: bool = False,
    turned: float = 0.0,
    seed: int = 1,
) -> RecordLog:
    """Return the recording; detections are stamped late, biased, mirrored or turned as asked for."""
    rng = np.random.default_rng(seed)
    odometry = np.arange(0, round(seconds * 50) + 1) * (SECOND // 50)
    poses = pose_at(odometry * 1e-9)
    steps = np.zeros((len(odometry), 3))
    steps[1:] = se2.compose(se2.inverse(poses[:-1]), poses[1:])
    scans = np.arange(1, round(seconds * 10)) * (SECOND // 10)
    rows = []
    for x, y, theta in pose_at(scans * 1e-9):
        d = np.array(PLACES) - (x, y)
        ranges = np.hypot(*d.T) + bias + rng.normal(0.0, RANGE_SIGMA, len(d))
        bearings = np.arctan2(d[:, 1], d[:, 0]) - theta + rng.normal(0.0, BEARING_SIGMA, len(d)) - turned
        bearings = np.remainder(bearings + math.pi, 2.0 * math.pi) - math.pi
        rows.append(np.stack([ranges, -bearings if mirrored else bearings], axis=1))
    return RecordLog(
        odometry_stamps_ns=odometry,
        displacements=steps,
        detection_stamps_ns=scans + round(late_s * SECOND),
        detection_offsets=np.arange(len(scans) + 1) * len(PLACES),
        range_bearing=np.concatenate(rows),
        reference_stamps_ns=odometry[::10],
        reference_poses=poses[::10],
    )


def start() -> Belief:
    """Where the drive begins."""
    (pose,) = pose_at(np.zeros(1))
    return Belief(0, pose, np.diag([0.02, 0.02, 0.01]) ** 2)


def scan_log(intensities: np.ndarray, *, ranges: float = 5.0, rate: float = 10.0, step_deg: float = 0.5) -> ScanLog:
    """Scans of one range, with these intensities (K, B)."""
    return ScanLog.even(
        np.arange(1, len(intensities) + 1) * round(SECOND / rate),
        np.full(intensities.shape, ranges, dtype=np.float32),
        (-math.pi, math.radians(step_deg)),
        intensities=intensities.astype(np.float32),
    )
