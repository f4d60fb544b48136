"""The fits behind `vision`: a contour tied to the laser's poses, and a contour alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.angles import difference, wrap
from commission.geometry.arrays import FloatArray
from commission.localization.contour_bundle import Bundle, Guess, axis_of, rotations, skew, solve
from commission.localization.egomotion import motion_of, shape_vector

SLANT_SIGMA = math.radians(2.0)
"""1-sigma of the slant of a contour's plane that the paper's model takes for none [rad]."""
TILT_SIGMA = math.radians(2.0)
"""1-sigma of pitch and roll of a camera that is mounted level [rad]."""
EXACT = 1e12
"""Information of what is fixed."""


@dataclass(frozen=True, slots=True)
class Tied:
    """Contour and laser, fitted to each other."""

    bundle: Bundle
    """Errors of the laser and heights of the camera; further: forward, left, yaw, depth."""
    laser: FloatArray
    """(K, 3) motion of the camera's place by the laser, in the camera frame of the first frame, flat."""
    sigmas: FloatArray
    """(8,) of forward, left, yaw, depth, slants and tilts, for errors of the laser that go on for frames."""


def closed_forms(seen: FloatArray, poses: FloatArray | None) -> FloatArray:
    """(K, 4) turn and T / Z_0 by equations 1 to 12; the turn has the sign of the laser's, where there is one."""
    found = np.full((len(seen), 4), np.nan)
    for k in range(len(seen)):
        shape = shape_vector(seen[0], seen[k])
        turned = float(difference(poses[k, 2], poses[0, 2])) if poses is not None else 0.0
        try:
            motion = motion_of(shape, turned)
        except ValueError as error:
            raise UsageError(f"frame {k + 1}: {error}") from None
        found[k, 0] = math.atan2(motion.rotation[0, 2], motion.rotation[2, 2])
        found[k, 1:] = motion.translation
    return found


def _begin(first: FloatArray) -> FloatArray:
    """(K, 4) motions to begin with: places of the closed form as if the camera did not turn, which is small."""
    T = first[:, 1:].copy()
    T[:, 0] += np.sin(first[:, 0])
    T[:, 2] += np.cos(first[:, 0]) - 1.0
    return np.column_stack([np.zeros(len(first)), T])


def fit_alone(seen: FloatArray, first: FloatArray, tied: Bundle | None) -> Bundle:
    """Fit the contour alone; plane and tilt as they were found with the laser, or as the paper takes them.

    Parameters
    ----------
    seen : (K, N, 2) control points [focal lengths].
    first : (K, 4) turn and T / Z_0 to begin with.
    tied : what the laser told; None: nothing.
    """
    information = np.zeros((len(seen), 4, 4))
    information[0] = EXACT * np.eye(4)
    shared = np.zeros(4) if tied is None else tied.shared
    spread = np.repeat([SLANT_SIGMA, TILT_SIGMA], 2)
    sigmas = spread if tied is None else np.sqrt(np.diag(tied.shared_covariance))
    frames = _begin(first)
    frames[0] = 0.0
    guess = Guess(
        frames=frames,
        frame_information=information,
        further=np.zeros(0),
        further_information=np.zeros((0, 0)),
        shared=shared,
        shared_sigmas=sigmas,
    )
    return solve(seen, guess, lambda frames, _further, _tilt: frames)


def _tied_motions(poses: FloatArray) -> Callable[[FloatArray, FloatArray, FloatArray], FloatArray]:
    """How errors of the laser (K, 3) with heights (K, 1), and what all frames share, move the camera.

    Shared are forward, left, yaw, depth, and the error of the laser's first pose: all motion begins there.
    """
    at_first = np.zeros(len(poses))
    at_first[0] = 1.0

    def motion(frames: FloatArray, further: FloatArray, tilt: FloatArray) -> FloatArray:
        base = se2.relative(poses[0] + further[4:], poses + frames[:, :3] + at_first[:, np.newaxis] * further[4:])
        camera = se2.relative(further[:3], se2.compose(base, further[:3]))
        return _from_planar(camera, frames[:, 3], float(further[3]), tilt)

    return motion


def _ways(tilt: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Forward and left on the floor, and down, each (3,) in the camera frame (right, down, forward)."""
    down = axis_of(tilt)
    ahead = np.array([0.0, 0.0, 1.0]) - down * down[2]
    ahead /= np.linalg.norm(ahead)
    return ahead, skew(ahead) @ down, down


def _from_planar(camera: FloatArray, depth_down: FloatArray, depth: float, tilt: FloatArray) -> FloatArray:
    """(K, 4) turn and T / Z_0 of a camera's motion on the floor: T = -R C."""
    ahead, left, down = _ways(tilt)
    C = (camera[:, :1] * ahead + camera[:, 1:2] * left + depth_down[:, np.newaxis] * down) / depth
    R = rotations(camera[:, 2], axis_of(tilt))
    return np.column_stack([camera[:, 2], -np.einsum("kij,kj->ki", R, C)])


def to_planar(motions: FloatArray, tilt: FloatArray) -> FloatArray:
    """(K, 3) forward and left by Z_0, and turn, of (K, 4) turn and T / Z_0: C = -R^T T."""
    ahead, left, _ = _ways(tilt)
    C = -np.einsum("kji,kj->ki", rotations(motions[:, 0], axis_of(tilt)), motions[:, 1:])
    return np.column_stack([C @ ahead, C @ left, motions[:, 0]])


def planar_motion(alone: Bundle, depth: float) -> tuple[FloatArray, FloatArray]:
    """Motions of the camera on the floor [m, m, rad] with their covariances."""
    tilt, step, unit = alone.shared[2:], 1e-6, np.array([depth, depth, 1.0])
    camera = to_planar(alone.frames, tilt) * unit
    columns = [
        (to_planar(alone.frames + change, tilt) - to_planar(alone.frames - change, tilt)) * unit / (2.0 * step)
        for change in step * np.eye(4)
    ]
    J = np.stack(columns, axis=2)
    spread = J @ alone.frame_covariances @ np.swapaxes(J, 1, 2)
    # All motion is since the first frame.
    camera[0], spread[0] = 0.0, 0.0
    camera[:, 2] = wrap(camera[:, 2])
    return camera, spread


def fit_tied(seen: FloatArray, poses: FloatArray, covariances: FloatArray, first: FloatArray) -> Tied:
    """Fit constants, contour and the laser's errors to each other.

    Parameters
    ----------
    seen : (K, N, 2) control points [focal lengths].
    poses, covariances : (K, 3), (K, 3, 3) pose of base by laser [m, m, rad], map frame, and its covariance.
    first : (K, 4) turn and T / Z_0 to begin with.
    """
    information = np.zeros((len(seen), 4, 4))
    information[:, :3, :3] = np.linalg.inv(covariances)
    further_information = np.zeros((7, 7))
    further_information[4:, 4:] = information[0, :3, :3]
    # The first pose's error is shared by all motion: it stands among what is shared, and the first frame has none else.
    information[0] = EXACT * np.eye(4)
    start = fit_alone(seen, first, None)
    base = se2.relative(poses[0], poses)
    planar, _ = planar_motion(start, 1.0)
    # The depth at which both motions are equally long, to begin with, and the direction that turns one into the other.
    squares = float(np.sum(planar[:, :2] ** 2))
    across = complex(np.sum((base[:, 0] + 1j * base[:, 1]) * np.conj(planar[:, 0] + 1j * planar[:, 1])))
    depth = abs(across) / max(squares, 1e-12)
    further = np.array([0.0, 0.0, math.atan2(across.imag, across.real), max(depth, 1e-3), 0.0, 0.0, 0.0])
    heights = -start.frames[:, 2:3] * further[3]
    heights[0] = 0.0
    guess = Guess(
        frames=np.column_stack([np.zeros((len(seen), 3)), heights]),
        frame_information=information,
        further=further,
        further_information=further_information,
        shared=np.zeros(4),
        shared_sigmas=np.repeat([math.radians(20.0), TILT_SIGMA], 2),
    )
    bundle = solve(seen, guess, _tied_motions(poses))
    camera = se2.relative(bundle.further[:3], se2.compose(base, bundle.further[:3]))
    variances = np.concatenate([np.diag(bundle.further_covariance)[:4], np.diag(bundle.shared_covariance)])
    longer = _correlation(bundle.frames[1:, :3], covariances[1:])
    return Tied(bundle, camera, np.sqrt(variances * longer))


def _correlation(errors: FloatArray, covariances: FloatArray) -> float:
    """For how many frames an error of the laser goes on: variances grow by it; 1 where frames are independent.

    Parameters
    ----------
    errors : (K, 3) of the laser, as fitted.
    covariances : (K, 3, 3) of the laser.

    Notes
    -----
    1 + 2 sum rho_k up to the first that is not positive (Geyer 1992), the largest of x, y and heading.
    """
    white = errors / np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    longest = 1.0
    for column in (white - white.mean(axis=0)).T:
        square, total = float(column @ column), 1.0
        for lag in range(1, len(column) // 2):
            rho = float(column[lag:] @ column[:-lag]) / max(square, 1e-300)
            if rho <= 0.0:
                break
            total += 2.0 * rho
        longest = max(longest, total)
    return longest
