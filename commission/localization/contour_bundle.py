"""All frames of a planar contour at once, under full perspective: what equations 1 to 12 leave out, by least squares.

A vehicle turns about one axis, so that a frame has four numbers: the turn, and the camera's place by the depth Z_0 of
the contour in the first frame. What frames share is estimated with them: the contour itself, how its plane is slanted,
and how the camera is tilted. The first frame's noise is then no error that all frames have in common.

Solved by Gauss-Newton; numbers of single frames are eliminated (Schur complement), as in bundle adjustment (Triggs et
al. 2000, "Bundle Adjustment: A Modern Synthesis", section 6.1).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from commission.geometry.arrays import FloatArray

ROUNDS = 30
"""Gauss-Newton steps at most."""
CONVERGED = 0.01
"""Change, in standard deviations of each number, below which nothing changes any more."""
SHARED = 4
"""Numbers of plane and camera: slant of the plane across and down, pitch and roll of the camera."""

MotionOf: TypeAlias = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""From (K, F) numbers of the frames, (E,) further numbers and (2,) tilt to (K, 4) turn and T / Z_0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Guess:
    """Where least squares begin, and what is known beforehand."""

    frames: FloatArray
    """(K, F) numbers of each frame."""
    frame_information: FloatArray
    """(K, F, F) inverse of their covariance beforehand about `frames`; 0: nothing is known."""
    further: FloatArray
    """(E,) further numbers that all frames share."""
    further_information: FloatArray
    """(E, E) inverse of their covariance beforehand about `further`; 0: nothing is known."""
    shared: FloatArray
    """(4,) slant of the plane and tilt of the camera [rad]."""
    shared_sigmas: FloatArray
    """(4,) 1-sigma of those about `shared` [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bundle:
    """What all frames together say."""

    frames: FloatArray
    """(K, F) numbers of each frame."""
    frame_covariances: FloatArray
    """(K, F, F) of those, with what the shared numbers contribute."""
    further: FloatArray
    """(E,) further numbers."""
    further_covariance: FloatArray
    """(E, E)."""
    shared: FloatArray
    """(4,) slant and tilt [rad]."""
    shared_covariance: FloatArray
    """(4, 4)."""
    contour: FloatArray
    """(N, 2) the contour in the first frame [focal lengths]."""
    noise: float
    """1-sigma of a coordinate of a point, by the residuals [focal lengths]."""
    residuals: FloatArray
    """(K, N, 2) measured less expected [focal lengths]."""
    converged: bool
    """Whether the steps came to rest."""


def skew(axis: FloatArray) -> FloatArray:
    """(3, 3) matrix of the cross product with an axis."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def axis_of(tilt: FloatArray) -> FloatArray:
    """(3,) vertical, downward, in the camera frame (right, down, forward) of a camera's pitch and roll [rad], small."""
    pitch, roll = tilt
    axis = np.array([roll, 1.0, pitch])
    return axis / np.linalg.norm(axis)


def rotations(turns: FloatArray, axis: FloatArray) -> FloatArray:
    """(K, 3, 3) what turns of the camera do to points in its frame.

    Parameters
    ----------
    turns : (K,) of the vehicle, counter-clockwise from above [rad].
    axis : (3,) see `axis_of`.

    Notes
    -----
    R = I + sin(a) [k] + (1 - cos(a)) [k]^2: Rodrigues' formula. About the downward axis, points turn the other way than
    the camera, which is counter-clockwise seen from below.
    """
    K = skew(axis)
    s, c = np.sin(turns)[:, np.newaxis, np.newaxis], np.cos(turns)[:, np.newaxis, np.newaxis]
    return np.eye(3) + s * K + (1.0 - c) * (K @ K)


def expected_points(contour: FloatArray, shared: FloatArray, motions: FloatArray) -> FloatArray:
    """(K, N, 2) where the points of a contour are seen [focal lengths].

    Parameters
    ----------
    contour : (N, 2) in the first frame [focal lengths].
    shared : (4,) slant and tilt [rad].
    motions : (K, 4) turn [rad] and T / Z_0 of each frame.

    Notes
    -----
    p = R q + T (n q) with q = (u, v, 1) and n = (slant, 1): the homography of a plane n X = Z_0 (Hartley and
    Zisserman 2004, result 13.1).
    """
    q = np.column_stack([contour, np.ones(len(contour))])
    depths = q @ np.array([shared[0], shared[1], 1.0])
    p = np.einsum("kij,nj->kni", rotations(motions[:, 0], axis_of(shared[2:])), q)
    p += depths[np.newaxis, :, np.newaxis] * motions[:, np.newaxis, 1:]
    return p[..., :2] / p[..., 2:]


def solve(seen: FloatArray, guess: Guess, motion_of: MotionOf) -> Bundle:
    """Fit frames, contour and everything that they share.

    Parameters
    ----------
    seen : (K, N, 2) control points of each frame [focal lengths], no degenerate contour.
    guess : where to begin.
    motion_of : how the numbers of a frame move the camera.
    """
    contour = seen[0].copy()
    frames, further, shared = guess.frames.copy(), guess.further.copy(), guess.shared.copy()
    converged, noise = False, 1.0
    system = _BundleSystem(seen, guess, motion_of)
    for round_number in range(ROUNDS):
        noise = system.noise(contour, frames, further, shared)
        step = system.step(contour, frames, further, shared, noise)
        scale = 1.0
        cost = system.cost(contour, frames, further, shared, noise)
        while True:
            tried = _moved(contour, frames, further, shared, step, scale)
            if system.cost(*tried, noise) <= cost * (1.0 + 1e-9) or scale < 1e-3:
                break
            scale /= 2.0
        contour, frames, further, shared = tried
        if scale * step.largest < CONVERGED and round_number:
            converged = True
            break
    noise = system.noise(contour, frames, further, shared)
    last = system.step(contour, frames, further, shared, noise)
    count = 2 * len(contour)
    covariance, end = last.covariance, count + SHARED
    return Bundle(
        frames=frames,
        frame_covariances=last.frame_covariances,
        further=further,
        further_covariance=covariance[end:, end:],
        shared=shared,
        shared_covariance=covariance[count:end, count:end],
        contour=contour,
        noise=noise,
        residuals=system.residuals(contour, frames, further, shared),
        converged=converged,
    )


@dataclass(frozen=True, slots=True)
class _BundleStep:
    """A step of Gauss-Newton and the covariance of where it leads."""

    whole: FloatArray
    """(G,) of contour, shared and further numbers."""
    frames: FloatArray
    """(K, F)."""
    covariance: FloatArray
    """(G, G)."""
    frame_covariances: FloatArray
    """(K, F, F)."""

    @property
    def largest(self) -> float:
        """Largest step in standard deviations."""
        own = np.sqrt(np.maximum(np.diagonal(self.frame_covariances, axis1=1, axis2=2), 1e-30))
        common = np.sqrt(np.maximum(np.diag(self.covariance), 1e-30))
        return float(max(np.abs(self.whole / common).max(), np.abs(self.frames / own).max()))


def _moved(  # noqa: PLR0917 - the four kinds of numbers
    contour: FloatArray, frames: FloatArray, further: FloatArray, shared: FloatArray, step: _BundleStep, scale: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """All numbers after a share of a step."""
    count = 2 * len(contour)
    return (
        contour + scale * step.whole[:count].reshape(-1, 2),
        frames + scale * step.frames,
        further + scale * step.whole[count + SHARED :],
        shared + scale * step.whole[count : count + SHARED],
    )


class _BundleSystem:
    """The normal equations of one problem."""

    def __init__(self, seen: FloatArray, guess: Guess, motion_of: MotionOf) -> None:
        self._seen, self._guess, self._motion_of = seen, guess, motion_of

    def residuals(self, contour: FloatArray, frames: FloatArray, further: FloatArray, shared: FloatArray) -> FloatArray:
        """(K, N, 2) measured less expected."""
        return self._seen - expected_points(contour, shared, self._motion_of(frames, further, shared[2:]))

    def noise(self, contour: FloatArray, frames: FloatArray, further: FloatArray, shared: FloatArray) -> float:
        """1-sigma of a coordinate by the residuals: each frame takes the freedom of its four numbers."""
        found = self.residuals(contour, frames, further, shared)
        freedom = found.size - 4 * len(frames) - contour.size
        return float(np.sqrt(np.square(found).sum() / max(freedom, 1))) + 1e-12

    def cost(
        self, contour: FloatArray, frames: FloatArray, further: FloatArray, shared: FloatArray, noise: float
    ) -> float:
        """Squared residuals by their variance, with what was known beforehand."""
        off = frames - self._guess.frames
        known = np.einsum("kf,kfg,kg->", off, self._guess.frame_information, off)
        known += (further - self._guess.further) @ self._guess.further_information @ (further - self._guess.further)
        known += np.square((shared - self._guess.shared) / self._guess.shared_sigmas).sum()
        return float(np.square(self.residuals(contour, frames, further, shared)).sum() / noise**2 + known)

    def step(
        self, contour: FloatArray, frames: FloatArray, further: FloatArray, shared: FloatArray, noise: float
    ) -> _BundleStep:
        """Solve the normal equations, the frames eliminated."""
        guess, count = self._guess, 2 * len(contour)
        own, common = self._jacobians(contour, frames, further, shared)
        residuals = self.residuals(contour, frames, further, shared).reshape(len(frames), count)
        weight = 1.0 / noise**2
        width = common.shape[2]
        normal, b = np.zeros((width, width)), np.zeros(width)
        at = np.arange(count, count + SHARED)
        normal[at, at] += guess.shared_sigmas**-2.0
        b[at] += (guess.shared - shared) * guess.shared_sigmas**-2.0
        end = count + SHARED
        normal[end:, end:] += guess.further_information
        b[end:] += guess.further_information @ (guess.further - further)
        turned = np.swapaxes(own, 1, 2) * weight
        inverses = np.linalg.inv(turned @ own + guess.frame_information)
        crossed = turned @ common
        known = np.einsum("kfg,kg->kf", guess.frame_information, guess.frames - frames)
        sides = np.einsum("kfn,kn->kf", turned, residuals) + known
        gain = inverses @ crossed
        every, rows, gains = (each.reshape(-1, width) for each in (common, crossed, gain))
        normal += weight * every.T @ every - rows.T @ gains
        b += weight * every.T @ residuals.ravel() - gains.T @ sides.ravel()
        covariance = _inverse(normal)
        whole = covariance @ b
        moved = np.einsum("kfg,kg->kf", inverses, sides - crossed @ whole)
        spread = inverses + gain @ covariance @ np.swapaxes(gain, 1, 2)
        return _BundleStep(whole, moved, covariance, spread)

    def _jacobians(
        self, contour: FloatArray, frames: FloatArray, further: FloatArray, shared: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(K, 2 N, F) with respect to the numbers of a frame, (K, 2 N, G) to those that all share."""
        motions = self._motion_of(frames, further, shared[2:])
        by_motion, by_contour, by_shared = point_jacobians(contour, shared, motions)
        K, N = by_motion.shape[:2]
        by_motion = by_motion.reshape(K, 2 * N, 4)
        by_frame = _differences(lambda x: self._motion_of(frames + x, further, shared[2:]), frames.shape[1])
        by_further = _differences(lambda x: self._motion_of(frames, further + x, shared[2:]), len(further))
        by_tilt = _differences(lambda x: self._motion_of(frames, further, shared[2:] + x), 2)
        common = np.zeros((K, 2 * N, 2 * N + SHARED + len(further)))
        index = np.arange(N)
        for row in range(2):
            for column in range(2):
                common[:, 2 * index + row, 2 * index + column] = by_contour[:, :, row, column]
        common[:, :, 2 * N : 2 * N + SHARED] = by_shared.reshape(K, 2 * N, SHARED)
        common[:, :, 2 * N + 2 : 2 * N + SHARED] += by_motion @ by_tilt
        common[:, :, 2 * N + SHARED :] = by_motion @ by_further
        return by_motion @ by_frame, common


def point_jacobians(
    contour: FloatArray, shared: FloatArray, motions: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives of `expected_points`.

    Parameters
    ----------
    contour, shared, motions : as there.

    Returns
    -------
    by_motion : (K, N, 2, 4) with respect to turn and T / Z_0.
    by_contour : (K, N, 2, 2) with respect to u and v of the point itself.
    by_shared : (K, N, 2, 4) with respect to slant and tilt.
    """
    q = np.column_stack([contour, np.ones(len(contour))])
    n, tilt = np.array([shared[0], shared[1], 1.0]), shared[2:]
    depths, T = q @ n, motions[:, np.newaxis, 1:]
    axis = axis_of(tilt)
    R, K = rotations(motions[:, 0], axis), skew(axis)
    p = np.einsum("kij,nj->kni", R, q) + depths[np.newaxis, :, np.newaxis] * T
    s, c = np.sin(motions[:, 0])[:, np.newaxis, np.newaxis], np.cos(motions[:, 0])[:, np.newaxis, np.newaxis]

    def seen(moved: FloatArray) -> FloatArray:
        """(K, N, 2) of (K, N, 3): u = p_x / p_z moves by (dp_x - u dp_z) / p_z."""
        return (moved[..., :2] - p[..., :2] / p[..., 2:] * moved[..., 2:]) / p[..., 2:]

    shape = p.shape
    columns = [np.einsum("kij,nj->kni", c * K + s * (K @ K), q)]
    columns += [np.broadcast_to(depths[:, np.newaxis] * np.eye(3)[i], shape) for i in range(3)]
    own = [np.broadcast_to(R[:, np.newaxis, :, i] + T * n[i], shape) for i in range(2)]
    slant = [T * q[np.newaxis, :, i, np.newaxis] for i in range(2)]
    length = np.linalg.norm([tilt[1], 1.0, tilt[0]])
    for part in (np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])):
        D = skew((part - axis * (axis @ part)) / length)
        slant.append(np.einsum("kij,nj->kni", s * D + (1.0 - c) * (D @ K + K @ D), q))
    by_motion, by_contour, by_shared = (
        np.stack([seen(column) for column in each], axis=-1) for each in (columns, own, slant)
    )
    return by_motion, by_contour, by_shared


def _differences(function: Callable[[FloatArray], FloatArray], count: int) -> FloatArray:
    """(K, 4, count) derivative of (K, 4) numbers, which bend little, by central differences."""
    step = 1e-5
    columns = []
    for index in range(count):
        change = np.zeros(count)
        change[index] = step
        columns.append((function(change) - function(-change)) / (2.0 * step))
    return np.stack(columns, axis=-1) if columns else np.zeros((len(function(np.zeros(0))), 4, 0))


def _inverse(N: FloatArray) -> FloatArray:
    """Inverse of a symmetric matrix whose numbers have different units."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(N), 1e-30))
    inverse = np.linalg.pinv(N * np.outer(scale, scale), rcond=1e-13, hermitian=True)
    return inverse * np.outer(scale, scale)
