"""Poses that go along until scans tell which is right, plainly: matrices, no map index, every reflector tried."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tests.localization.plain_observation import innovations, jacobians

MOST, LEAST, RIVALS, RATIO = 6, 1e-4, 4, 6.0


@dataclass(frozen=True)
class Pose:
    """One of them."""

    mean: np.ndarray
    covariance: np.ndarray
    weight: float = 1.0
    root: int = 0
    spread: np.ndarray | None = None
    """What others put together with it have widened it by, in this scan."""
    entries: tuple[int, ...] = ()


def turned(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    d = b - a
    d[2] = math.remainder(d[2], 2.0 * math.pi)
    return d


def moved(rival: Pose, before: Pose, prior: Pose) -> Pose:
    """A rival carried along: what moved the run's own pose moves it, in its own axes."""
    step = prior.mean - before.mean
    own = np.array([[1.0, 0.0, -step[1]], [0.0, 1.0, step[0]], [0.0, 0.0, 1.0]])
    noise = prior.covariance - own @ before.covariance @ own.T
    turn = turned(rival.mean[2] - before.mean[2])
    there = turn @ step
    F = np.array([[1.0, 0.0, -there[1]], [0.0, 1.0, there[0]], [0.0, 0.0, 1.0]])
    return replace(rival, mean=rival.mean + there, covariance=F @ rival.covariance @ F.T + turn @ noise @ turn.T)


def corrected(pose: Pose, v: np.ndarray, H: np.ndarray, S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    K = pose.covariance @ H.T @ np.linalg.inv(S)
    return pose.mean + K @ v, pose.covariance - K @ S @ K.T


def branches(pose: Pose, z: np.ndarray, mounting: np.ndarray, places: np.ndarray, R: np.ndarray, gate: float):
    """A pose after a detection: of none, and of each of the likeliest reflectors inside the gate."""
    yield replace(pose, entries=(*pose.entries, -1))
    v, H = innovations(pose.mean, mounting, places, z), jacobians(pose.mean, mounting, places)
    found = []
    for j in range(len(places)):
        S = H[j] @ pose.covariance @ H[j].T + R
        d2 = float(v[j] @ np.linalg.solve(S, v[j]))
        if d2 <= gate:
            found.append((d2 + math.log(np.linalg.det(S)), j, S))
    for cost, j, S in sorted(found, key=lambda each: each[0])[:RIVALS]:
        if j in pose.entries:
            continue
        mean, covariance = corrected(pose, v[j], H[j], S)
        yield replace(
            pose,
            mean=mean,
            covariance=covariance,
            weight=pose.weight * RATIO * math.exp(-0.5 * cost) / (2.0 * math.pi),
            entries=(*pose.entries, j),
        )


def are_one(a: Pose, b: Pose) -> bool:
    d = difference(a.mean, b.mean)
    return all(float(d @ np.linalg.solve(pose.covariance, d)) < 1.0 for pose in (a, b))


def left(grown: list[Pose]) -> list[Pose]:
    """The likeliest, those that are one put together."""
    ordered = sorted(grown, key=lambda pose: -pose.weight)
    kept: list[Pose] = []
    for pose in (each for each in ordered if each.weight >= LEAST * ordered[0].weight):
        same = next((k for k, other in enumerate(kept) if are_one(other, pose)), None)
        if same is not None:
            main = kept[same]
            b = pose.weight / (main.weight + pose.weight)
            d = difference(main.mean, pose.mean)
            more = b * (1.0 - b) * np.outer(d, d)
            spread = more if main.spread is None else main.spread + more
            kept[same] = replace(
                main,
                mean=main.mean + b * d,
                covariance=main.covariance + more,
                spread=spread,
                weight=main.weight + pose.weight,
            )
        elif len(kept) < MOST:
            kept.append(pose)
    return kept


def decided(
    poses: list[Pose], scan: np.ndarray, mounting: np.ndarray, places: np.ndarray, R: np.ndarray, gate: float
) -> tuple[Pose, list[Pose]]:
    """The pose that the run goes on from and its rivals, weighed against it; the first of `poses` is the run's own."""
    now = [replace(pose, root=k, entries=(), spread=None) for k, pose in enumerate(poses)]
    for z in scan:
        now = left([each for pose in now for each in branches(pose, z, mounting, places, R, gate)])
    own = [pose for pose in now if pose.root == 0 and 3.0 * pose.weight > now[0].weight]
    told = now[0] if now[0].root == 0 or not own else own[0]
    rest = [replace(pose, weight=pose.weight / told.weight) for pose in now if pose is not told]
    # What the run makes of the same detections, widened by the others as they were when they became one with it.
    alone = poses[told.root]
    for z, j in zip(scan, told.entries, strict=True):
        if j >= 0:
            v, H = innovations(alone.mean, mounting, places[[j]], z)[0], jacobians(alone.mean, mounting, places[[j]])[0]
            mean, covariance = corrected(alone, v, H, H @ alone.covariance @ H.T + R)
            alone = replace(alone, mean=mean, covariance=covariance)
    widened = alone.covariance if told.spread is None else alone.covariance + told.spread
    return replace(told, weight=1.0, covariance=widened), rest
