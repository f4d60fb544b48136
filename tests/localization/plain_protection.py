"""Protection levels once more, plain and slow: one textbook filter in numpy matrices for each reflector left out.

It shares no code with the package but the values it reads: beliefs of a run before and after each cycle, what it has
accepted, the map and the noise.
"""

from __future__ import annotations

import math

import numpy as np

from commission.localization.estimate import Status
from commission.localization.run_columns import RunColumns

Filter = tuple[np.ndarray, np.ndarray]
KEPT, NEGLIGIBLE = 20, 1.05


def wrapped(angle: float) -> float:
    return math.atan2(math.sin(angle), math.cos(angle))


def carried(of: Filter, before: Filter, prior: Filter) -> Filter:
    """A filter moved as the run's own belief was: the same displacement in the map, turned by what it is apart."""
    d = prior[0][:2] - before[0][:2]
    F = np.array([[1.0, 0.0, -d[1]], [0.0, 1.0, d[0]], [0.0, 0.0, 1.0]])
    Q = prior[1] - F @ before[1] @ F.T
    apart = of[0] - before[0]
    apart[2] = wrapped(apart[2])
    return prior[0] + F @ apart, F @ of[1] @ F.T + Q


def corrected(of: Filter, seen: np.ndarray, place: np.ndarray, variance: float, noise: np.ndarray, mount: np.ndarray):
    """Extended Kalman filter with range and bearing; Jacobian by central differences."""

    def expected(pose: np.ndarray) -> np.ndarray:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        eye = pose[:2] + np.array([[c, -s], [s, c]]) @ mount[:2]
        d = place - eye
        return np.array([np.hypot(*d), math.atan2(d[1], d[0]) - pose[2] - mount[2]])

    mean, P = of
    H = np.empty((2, 3))
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-6
        difference = expected(mean + step) - expected(mean - step)
        H[:, i] = difference[0] / 2e-6, wrapped(difference[1]) / 2e-6
    z = seen - expected(mean)
    z[1] = wrapped(z[1])
    distance = expected(mean)[0]
    S = H @ P @ H.T + noise + np.diag([variance, variance / distance**2])
    K = P @ H.T @ np.linalg.inv(S)
    A = np.eye(3) - K @ H
    return mean + K @ z, A @ P


def levels(columns: RunColumns, risk: float, fault: float) -> np.ndarray:
    """(K, 2) levels of a run with one setup, one scanner and no search."""
    setup = columns.segments[0].setup
    noise = np.diag([setup.parameters.observation.range_sigma**2, setup.parameters.observation.bearing_sigma**2])
    mount = np.asarray(setup.scanners[0].mounting)
    variances = setup.survey_sigmas**2
    every: Filter | None = None
    without: dict[int, Filter] = {}
    unseen: dict[int, int] = {}
    found = np.empty((len(columns), 2))
    for cycle in range(len(columns)):
        prior = tuple(np.array(part) for part in columns.priors.at(cycle))
        own = columns.means[cycle].copy(), columns.covariances[cycle].copy()
        if every is None:
            every = prior
        else:
            before = columns.means[cycle - 1], columns.covariances[cycle - 1]
            every = carried(every, before, prior)
            without = {j: carried(of, before, prior) for j, of in without.items()}
        rows = range(columns.offsets[cycle], columns.offsets[cycle + 1])
        accepted = [i for i in rows if columns.status[i] == Status.INLIER]
        unseen = {j: count + 1 for j, count in unseen.items()}
        for i in accepted:
            without.setdefault(int(columns.reflector[i]), every)
            unseen[int(columns.reflector[i])] = 0
        for i in accepted:
            m = int(columns.reflector[i])
            given = columns.range_bearing[i], setup.reflectors.centers[m], variances[m], noise, mount
            every = corrected(every, *given)
            without = {j: of if j == m else corrected(of, *given) for j, of in without.items()}
        k0 = math.sqrt(-2.0 * math.log(0.5 * risk))
        kj = math.sqrt(-2.0 * math.log(0.5 * risk / (len(without) * fault))) if without else 0.0
        largest = np.linalg.eigvalsh(own[1][:2, :2])[-1]
        position, heading = k0 * math.sqrt(largest), k0 * math.sqrt(own[1][2, 2])
        for j, (mean, P) in list(without.items()):
            grown = max(np.linalg.eigvalsh(P[:2, :2])[-1] / np.linalg.eigvalsh(every[1][:2, :2])[-1], 1.0)
            turned = max(P[2, 2] / every[1][2, 2], 1.0)
            apart = np.hypot(*(own[0] - mean)[:2])
            position = max(position, apart + kj * math.sqrt(largest * grown))
            heading = max(heading, abs(wrapped(own[0][2] - mean[2])) + kj * math.sqrt(own[1][2, 2] * turned))
            if unseen[j] > KEPT and grown < NEGLIGIBLE and apart**2 < 0.05 * largest:
                del without[j], unseen[j]
        found[cycle] = position, heading
    return found
