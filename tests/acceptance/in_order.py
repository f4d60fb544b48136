"""The exact filter of sweeps, plain and slow: every detection corrects at the time of its own beam, in order.

Between them the pose moves by odometry with all of its noise, so that nothing is bridged by a velocity: no filter that
is given the same detections knows more of the pose at the stamp of the last beam. It is told which reflector is which.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.localization.estimate import Status
from commission.localization.run_columns import RunColumns
from commission.site.record_log import RecordLog
from commission.site.scanner import Scanner, StampOf
from tests.localization.plain_localizer import PlainLocalizer, rotation
from tests.localization.plain_observation import innovations, jacobians, matrix, noises, observed, turned

Array = np.ndarray


def beam_seconds(scanner: Scanner, bearings: Array) -> Array:
    """When beams are measured, after a stamp of the last one [s]: spread evenly over the field of view."""
    assert scanner.stamp_of is StampOf.LAST
    assert not scanner.upside_down
    assert scanner.clock_offset == 0.0
    low, high = np.radians(scanner.field_of_view_deg)
    share = (bearings - low) / (high - low)
    return scanner.sweep_duration * ((share if scanner.sweep_direction > 0 else 1.0 - share) - 1.0)


def twist(move: Array) -> Array:
    """(3,) constant twist of a displacement: its chord is as long as the arc times sinc of half the turn."""
    along = rotation(-0.5 * move[2]) @ move[:2] / np.sinc(0.5 * move[2] / np.pi)
    return np.array([*along, move[2]])


def arc(way: Array) -> Array:
    """(3, 3) displacement of a twist."""
    chord = rotation(0.5 * way[2]) @ way[:2] * np.sinc(0.5 * way[2] / np.pi)
    return matrix(np.array([*chord, way[2]]))


@dataclass
class InOrder(PlainLocalizer):
    """Predict and correct of the plain localizer, one reflector at a time."""

    def correct(self, z: Array, j: int) -> None:
        places, mounting, p = self.reflectors.centers[j : j + 1], self.scanner.mounting, self.parameters.observation
        sigma = np.array([self.reflectors.reflectors[j].sigma])
        R = noises((p.range_sigma, p.bearing_sigma), sigma, observed(self.mean, mounting, places)[:, 0])[0]
        H = jacobians(self.mean, mounting, places)[0]
        K = self.cov @ H.T @ np.linalg.inv(H @ self.cov @ H.T + R)
        A = np.eye(3) - K @ H
        self.mean = self.mean + K @ innovations(self.mean, mounting, places, z - [p.range_bias, 0.0])[0]
        self.mean[2] = turned(self.mean[2])
        self.cov = A @ self.cov @ A.T + K @ R @ K.T

    def move_to(self, now: float) -> None:
        """Go along the odometry up to a time: a constant twist between two records."""
        while now > self.now and self.row + 1 < len(self.times):
            start, end = self.times[self.row], self.times[self.row + 1]
            until = min(now, end)
            if until > max(self.now, start):
                share = (until - max(self.now, start)) / (end - start)
                self.predict(arc(share * self.twists[self.row]), until - max(self.now, start))
            self.now = max(self.now, until)
            if until == end:
                self.row += 1

    def means_of(self, log: RecordLog, run: RunColumns) -> Array:
        """(K, 3) estimate at each stamp from the detections that a run has accepted."""
        self.times, self.row = 1e-9 * log.odometry_stamps_ns, 0
        self.twists = [twist(move) for move in log.displacements[1:]]
        self.now = self.times[0]
        measured = run.detected.range_bearing
        seconds = beam_seconds(self.scanner, measured[:, 1])
        means = np.empty((len(run), 3))
        for k, stamp_ns in enumerate(run.stamps_ns.tolist()):
            rows = np.arange(run.offsets[k], run.offsets[k + 1])
            rows = rows[run.status[rows] == Status.INLIER]
            for i in rows[np.argsort(seconds[rows], kind="stable")]:
                self.move_to(1e-9 * stamp_ns + seconds[i])
                self.correct(measured[i], int(run.reflector[i]))
            self.move_to(1e-9 * stamp_ns)
            means[k] = self.mean
        return means
