"""The Schmidt filter over all constants of a site at once: dense numpy matrices, straight from the equations.

It shares no code with the package but the values it reads. Its derivatives are those of one measurement of the pose and
all constants by complex steps: exact to the last digits, and without a formula of their own.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from commission.site.record_log import RecordLog
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from tests.localization.plain_localizer import PlainLocalizer
from tests.localization.plain_observation import Array, turned


def measured(numbers: Array, place: Array, mounting: Array, twist: Array) -> Array:
    """(2, B) range and bearing of a reflector, for B columns of numbers, which may be complex.

    `numbers` are x, y, theta of base at the stamp; how far off the reflector is (2), how far off the mounting (3), what
    is added to the range, and how late the scan is stamped. `twist` is the velocity of base [m/s, m/s, rad/s].
    """
    x, y, theta, off_x, off_y, askew_x, askew_y, askew, bias, late = numbers
    x, y = into(place[0] + off_x - x, place[1] + off_y - y, theta)
    # Base was not yet where it is at the stamp: to first order, which is all that a derivative sees.
    x, y = x + late * (twist[0] - twist[2] * y), y + late * (twist[1] + twist[2] * x)
    x, y = into(x - mounting[0] - askew_x, y - mounting[1] - askew_y, mounting[2] + askew)
    distance = np.sqrt(x * x + y * y)
    # numpy has no arctan2 of complex numbers: by its differential.
    turn = (x.real * y.imag - y.real * x.imag) / (x.real**2 + y.real**2)
    return np.array([distance + bias, np.arctan2(y.real, x.real) + 1j * turn])


def into(x: Array, y: Array, angle: Array) -> tuple[Array, Array]:
    """Seen in axes that are turned."""
    return np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x


def velocity(move: Array, seconds: float) -> Array:
    """Constant twist of a motion that took some time: chord / sin(h) h, turned back by h, with h half the turn."""
    half = 0.5 * np.arctan2(move[1, 0], move[0, 0])
    forward, left = into(move[0, 2], move[1, 2], half)
    return np.array([forward / np.sinc(half / np.pi), left / np.sinc(half / np.pi), 2.0 * half]) / seconds


@dataclass
class PlainConsidering(PlainLocalizer):
    scanners: tuple[Scanner, ...] = ()
    uncertainty: Uncertainty = field(default_factory=Uncertainty)

    def __post_init__(self) -> None:
        super().__post_init__()
        known = self.uncertainty
        surveyed = [each.sigma or known.survey for each in self.reflectors.reflectors]
        of_scanner = [*2 * [known.mounting_position], known.mounting_heading, known.range_bias, known.clock]
        sigmas = [*np.repeat(surveyed, 2), *len(self.scanners) * of_scanner]
        self.constant = np.diag(np.square(sigmas))
        self.cross = np.zeros((3, len(sigmas)))
        self.turn = 0
        self.known: tuple[Array, list] | None = None

    def run(self, log: RecordLog) -> list[dict]:
        self.of_scan = log.detection_scanners
        return super().run(log)

    def predict(self, move: Array, seconds: float) -> None:
        before = self.mean
        super().predict(move, seconds)
        F = np.eye(3)
        F[:2, 2] = before[1] - self.mean[1], self.mean[0] - before[0]
        self.cross = F @ self.cross

    def reach(self, now: float) -> None:
        self.scanner = self.scanners[self.of_scan[self.turn]]
        move, seconds = self.last_move, self.period_s
        if self.following and self.odometry_s is not None and self.odometry_s < now:
            stamp, move = self.following[0]
            seconds = stamp - self.odometry_s
        self.twist = velocity(move, seconds) if seconds else np.zeros(3)
        super().reach(now)
        self.turn += 1

    def derivatives(self, j: int) -> tuple[Array, Array, Array]:
        """Expected measurement of a reflector at the mean, H, and J of all constants."""
        numbers = np.array([*self.mean, *7 * [0.0]])[:, np.newaxis] + 1e-30j * np.eye(10)
        found = measured(numbers, self.reflectors.centers[j], self.scanner.mounting, self.twist)
        D = found.imag / 1e-30
        J = np.zeros((2, len(self.constant)))
        J[:, 2 * j : 2 * j + 2] = D[:, 3:5]
        first = 2 * len(self.reflectors) + 5 * self.of_scan[self.turn - 1]
        J[:, first : first + 5] = D[:, 5:]
        return found[:, 0].real, D[:, :3], J

    def innovation(self, z: Array, j: int) -> tuple[Array, Array, Array, Array]:
        """Innovation of a detection against one reflector, H, J and S."""
        h, H, J = self.derivatives(j)
        p = self.parameters.observation
        R = np.diag([p.range_sigma**2, p.bearing_sigma**2])
        HCJ = H @ self.cross @ J.T
        v = z - h
        v[1] = turned(v[1])
        return v, H, J, H @ self.cov @ H.T + HCJ + HCJ.T + J @ self.constant @ J.T + R

    def innovations(self, mean: Array, cov: Array, z: Array) -> tuple[Array, Array, Array, Array]:
        """Of one detection against every reflector: v, H, J and S; the state is that of the arguments."""
        assert mean is self.mean
        assert cov is self.cov
        if self.known is None or self.known[0] is not mean:
            self.known = mean, [self.innovation(np.zeros(2), j) for j in range(len(self.reflectors))]
        v, H, J, S = (np.array(each) for each in zip(*self.known[1], strict=True))
        v = v + z
        v[:, 1] = turned(v[:, 1])
        return v, H, S, J

    def correct(self, z: Array, j: int) -> None:
        v, H, J, S = self.innovation(z, j)
        K = (self.cov @ H.T + self.cross @ J.T) @ np.linalg.inv(S)
        self.mean = self.mean + K @ v
        self.mean[2] = turned(self.mean[2])
        cov = self.cov - K @ (H @ self.cov + J @ self.cross.T)
        self.cross = self.cross - K @ (H @ self.cross + J @ self.constant)
        self.cov = 0.5 * (cov + cov.T)
