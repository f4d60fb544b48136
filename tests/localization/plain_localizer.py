"""The localizer once more, plain and slow: numpy matrices straight from the paper, every reflector compared.

It shares no code with the package but the values it reads; the tests compare the two. Detections come from the sensor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm, logm
from scipy.stats import chi2

from commission.localization.estimate import Belief
from commission.site.parameters import Parameters
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from tests.localization.plain_observation import (
    Array,
    innovations,
    jacobians,
    log_likelihoods,
    matrix,
    noises,
    observed,
    turned,
)


def pose_of(T: Array) -> Array:
    return np.array([T[0, 2], T[1, 2], math.atan2(T[1, 0], T[0, 0])])


def rotation(angle: float) -> Array:
    return matrix(np.array([0.0, 0.0, angle]))[:2, :2]


def columns(log: RecordLog) -> tuple[Array, Array]:
    return log.odometry_stamps_ns, log.displacements


@dataclass
class PlainLocalizer:
    reflectors: ReflectorMap
    scanner: Scanner
    parameters: Parameters
    initial: Belief
    mean: Array = field(init=False)
    cov: Array = field(init=False)
    mode: str = "operational"

    def __post_init__(self) -> None:
        self.mean, self.cov = np.array(self.initial.mean), np.array(self.initial.covariance)
        self.odometry_s: float | None = None
        self.belief_s = self.period_s = 0.0
        self.last_move, self.ahead = np.eye(3), np.eye(3)
        self.was_lost, self.counted_at = False, self.initial.stamp_ns * 1e-9
        self.weights: dict[int | None, list[tuple[float, bool]]] = {1: [], None: []}
        self.confirmed = math.inf
        self.against = 0

    def run(self, log: RecordLog) -> list[dict]:
        self.following = [(stamp * 1e-9, matrix(move)) for stamp, move in zip(*columns(log), strict=True)]
        events = [(stamp, 0, k) for k, stamp in enumerate(log.odometry_stamps_ns)]
        events += [(stamp, 1, k) for k, stamp in enumerate(log.detection_stamps_ns)]
        cycles = []
        for stamp, kind, k in sorted(events):
            if kind == 0:
                self.following.pop(0)
                self.odometry(stamp * 1e-9, log.displacements[k])
            else:
                rows = slice(log.detection_offsets[k], log.detection_offsets[k + 1])
                cycles.append(self.scan(stamp * 1e-9, log.range_bearing[rows]))
        return cycles

    def odometry(self, now: float, displacement: Array) -> None:
        if self.odometry_s is not None:
            move = matrix(displacement)
            self.predict(np.linalg.inv(self.ahead) @ move, now - self.belief_s)
            self.period_s, self.last_move = now - self.odometry_s, move
            # No gaps in the drives of the tests, and even intervals: the usual one is the last one.
        self.odometry_s = self.belief_s = now
        self.ahead = np.eye(3)

    def reach(self, now: float) -> None:
        if self.odometry_s is None or now <= self.belief_s:
            return
        due = self.period_s or 0.5
        if self.following and self.following[0][0] <= now + due + 1e-12:
            stamp, move = self.following[0]
            share = (now - self.odometry_s) / (stamp - self.odometry_s)
            step = np.linalg.inv(self.ahead) @ expm(share * np.real(logm(move)))
            self.predict(step, now - self.belief_s)
        else:
            until, done = (min(t - self.odometry_s, self.period_s) for t in (now, self.belief_s))
            step = np.eye(3)
            if until > done:
                step = expm((until - done) / self.period_s * np.real(logm(self.last_move)))
            self.predict(step, now - self.belief_s)
            after, before = (self.unmeasured(t - self.odometry_s, due) for t in (now, self.belief_s))
            turn = np.eye(3)
            turn[:2, :2] = rotation(self.mean[2])
            self.cov = self.cov + turn @ (after - before) @ turn.T
        self.ahead, self.belief_s = self.ahead @ step, now

    def unmeasured(self, seconds: float, due: float) -> Array:
        """Covariance of what may have happened since the last odometry, in the vehicle's axes."""
        p = self.parameters.odometry
        early, late = min(seconds, due), max(seconds - due, 0.0)
        accelerated = np.array([p.acceleration, 0.0, p.turn_acceleration]) * early**2 / 2.0
        driven = np.array([p.gap_speed, p.gap_speed, p.gap_turn_rate]) * late / math.sqrt(3.0)
        return np.diag(accelerated**2 + driven**2)

    def predict(self, move: Array, seconds: float) -> None:
        p, before = self.parameters.odometry, self.mean
        d = pose_of(move)
        self.mean = pose_of(matrix(before) @ move)
        chord = rotation(before[2]) @ d[:2]
        perpendicular = np.array([-chord[1], chord[0]])
        F = np.eye(3)
        F[:2, 2] = perpendicular
        length = np.linalg.norm(chord)
        distance = length / np.sinc(d[2] / (2.0 * math.pi))
        heading = (
            p.heading_per_sqrt_m**2 * distance
            + p.heading_per_sqrt_rad**2 * abs(d[2])
            + p.heading_per_sqrt_s**2 * seconds
        )
        Q = np.zeros((3, 3))
        if length > 0.0:
            along, across = chord / length, perpendicular / length
            Q[:2, :2] += p.forward_per_sqrt_m**2 * distance * np.outer(along, along)
            Q[:2, :2] += p.lateral_per_sqrt_m**2 * distance * np.outer(across, across)
        axis = rotation(before[2] + d[2] / 2.0)[:, 0]
        Q[:2, :2] += p.forward_per_sqrt_s**2 * seconds * np.outer(axis, axis)
        lever = np.array([*(perpendicular / 2.0), 1.0])
        Q += heading * np.outer(lever, lever)
        Q[:2, :2] += heading / 12.0 * np.outer(perpendicular, perpendicular)
        self.cov = F @ self.cov @ F.T + Q

    def innovations(self, mean: Array, cov: Array, z: Array) -> tuple[Array, Array, Array, Array]:
        """Of one detection against every reflector: v, H, S and R."""
        places, mounting, p = self.reflectors.centers, self.scanner.mounting, self.parameters.observation
        surveyed = np.array([reflector.sigma for reflector in self.reflectors.reflectors])
        H = jacobians(mean, mounting, places)
        R = noises((p.range_sigma, p.bearing_sigma), surveyed, observed(mean, mounting, places)[:, 0])
        return innovations(mean, mounting, places, z), H, H @ cov @ H.transpose(0, 2, 1) + R, R

    def scan(self, now: float, detections: Array) -> dict:
        self.reach(now)
        p = self.parameters
        prior = self.mean, self.cov
        gate = chi2.ppf(p.association.gate_probability, 2)
        measured = detections - [p.observation.range_bias, 0.0]
        status, chosen, d2s = [], [], []
        for z in measured:
            v, _, S, _ = self.innovations(*prior, z)
            d2, likelihood = log_likelihoods(v, S)
            best = int(np.argmax(likelihood))
            status.append("inlier" if d2[best] <= gate or not p.association.enabled else "outlier")
            chosen.append(best)
            d2s.append(float(d2[best]))
        if p.association.enabled:
            for j in set(chosen):
                claims = [i for i in range(len(chosen)) if chosen[i] == j and status[i] == "inlier"]
                for i in claims:
                    if i != min(claims, key=lambda k: (d2s[k], k)):
                        status[i] = "outlier"
        for z, j, kept in zip(measured, chosen, status, strict=True):
            if kept == "inlier":
                self.correct(z, j)
        self.supervise()
        self.count_rejections(now, prior, measured, status)
        return {
            "mean": self.mean.copy(),
            "cov": self.cov.copy(),
            "prior_mean": prior[0],
            "prior_cov": prior[1],
            "mode": self.mode,
            "status": status,
            "chosen": chosen,
            "d2": d2s,
        }

    def correct(self, z: Array, j: int) -> None:
        """Take in one detection of reflector j."""
        v, H, S, R = (of_all[j] for of_all in self.innovations(self.mean, self.cov, z))
        K = self.cov @ H.T @ np.linalg.inv(S)
        A = np.eye(3) - K @ H
        self.mean = self.mean + K @ v
        self.mean[2] = turned(self.mean[2])
        self.cov = A @ self.cov @ A.T + K @ R @ K.T

    def widest(self, cov: Array) -> tuple[float, float]:
        """2-sigma of the position and of the heading, as parts of their limits."""
        p = self.parameters.supervisor
        variance = max(cov[0, 0], cov[1, 1]) if p.position_sigma == "axes" else np.linalg.eigvalsh(cov[:2, :2]).max()
        return 2.0 * math.sqrt(variance) / p.position_limit, 2.0 * math.sqrt(cov[2, 2]) / p.heading_limit

    def count_rejections(self, now: float, prior: tuple[Array, Array], measured: Array, status: list[str]) -> None:
        """The rule by rejections, over lists: every past detection keeps a weight that is forgotten."""
        p, (mean, cov) = self.parameters.supervisor, prior
        place = mean[:2] + rotation(mean[2]) @ self.scanner.mounting[:2]
        along = 2.0 * math.sqrt(np.linalg.eigvalsh(cov[:2, :2]).max())
        doubtful = along > p.doubt_ratio * p.position_limit
        doubtful = doubtful or 2.0 * math.sqrt(cov[2, 2]) > p.doubt_ratio * p.heading_limit
        fresh = []
        for (distance, bearing), kept in zip(measured, status, strict=True):
            angle = mean[2] + self.scanner.mounting[2] + bearing
            seen = place + distance * np.array([math.cos(angle), math.sin(angle)])
            off = np.linalg.norm(self.reflectors.centers - seen, axis=1).min() if len(self.reflectors) else math.inf
            if kept == "inlier" and not doubtful:
                fresh.append((True, True))
            elif kept != "inlier" and off > p.rejection_harmless * (p.position_limit + p.heading_limit * distance):
                fresh.append((False, off <= p.rejection_reach + p.rejection_turn * distance))
        shares = []
        ways = (
            (1, p.rejection_near_limit, p.rejection_window, p.rejection_evidence),
            (
                None,
                p.rejection_limit,
                p.rejection_long_window,
                p.rejection_evidence / p.rejection_window * p.rejection_long_window,
            ),
        )
        for which, limit, window, fewest in ways:
            weights = self.weights[which]
            total = sum(weight for weight, _ in weights)
            kept = math.exp(-(now - self.counted_at) / window)
            if total > 0.0:
                kept = max(kept, min(1.0, fewest / total))
            weights[:] = [(weight * kept, accepted) for weight, accepted in weights]
            weights += [(1.0, accepted) for accepted, near in fresh if which is None or near]
            rejected = sum(weight for weight, accepted in weights if not accepted)
            shares.append(rejected / max(sum(weight for weight, _ in weights), fewest) / limit)
        refused = sum(not accepted for accepted, _ in fresh)
        taken = sum(kept == "inlier" for kept in status)
        if 4 * taken > refused:
            self.against = 0
        elif refused >= 3:
            self.against += 1
        self.counted_at = now
        self.confirmed = 0.0 if doubtful else self.confirmed + sum(accepted for accepted, _ in fresh)
        if p.enabled and self.confirmed < p.confirmations:
            self.mode = "fail"
        if p.enabled and p.rejection_enabled:
            over = max(shares) > 1.0 or (self.was_lost and (max(shares) >= 0.5 or self.against > 0))
            over = over or self.against >= p.rejection_scans
            self.mode, self.was_lost = ("lost" if over else self.mode), over

    def supervise(self) -> None:
        p = self.parameters.supervisor
        share = max(self.widest(self.cov))
        if self.mode == "lost":
            self.mode = "fail"
        if self.mode == "operational" and share > 1.0:
            self.mode = "fail"
        elif self.mode == "fail" and share < 1.0 / p.recovery_ratio:
            self.mode = "operational"
        if not p.enabled:
            self.mode = "operational"
