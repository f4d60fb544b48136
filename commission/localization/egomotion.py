"""Motion of a camera from the deformation of a planar contour: Alenya et al. 2005, section III, equations 1 to 12.

Points of the contour are in coordinates of a calibrated camera, divided by the focal length: u = X / Z to the right,
v = Y / Z down, from the principal point. So f is 1 in all equations. The camera is weak-perspective here: what
perspective adds is in `contour_bundle`, which begins with what this module finds.

Slips of the paper's text that are handled: equation 12 has 1 + T_z / Z_0 where R_33 + T_z / Z_0 is meant (equation 8),
and equation 11 leaves open which of the two rotations of one foreshortening it is: the caller says which way it turned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.site.quantity import number_text

FEWEST_POINTS = 4
"""Points below which perspective is not determined: a homography of a plane has eight numbers."""
FLATTEST = 0.05
"""Width of a contour by its length below which it is a line: motion across it is not seen."""
SMALLEST = 0.005
"""Half the extent of a contour below which its growth is not told from noise, in focal lengths."""
WIDEST = 5.0
"""Distance from the axis beyond which coordinates are no focal lengths: 79 degrees."""


@dataclass(frozen=True, slots=True)
class CameraMotion:
    """Rotation and scaled translation of a camera since the first contour: a point p moves to R p + T."""

    rotation: FloatArray
    """(3, 3) R, equation 9."""
    translation: FloatArray
    """(3,) T / Z_0, equations 6 to 8: right, down, forward."""


def why_degenerate(points: FloatArray) -> str:
    """Say why motion cannot be told from a contour; empty where it can.

    Parameters
    ----------
    points : (N, 2) control points of the first contour [focal lengths].
    """
    if len(points) < FEWEST_POINTS:
        return f"has {len(points)} points; expected at least {FEWEST_POINTS}"
    farthest = float(np.abs(points).max())
    if farthest > WIDEST:
        found = f"has points {number_text(farthest)} focal lengths from the axis"
        return f"{found}; expected at most {WIDEST:g}: are they pixels?"
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / math.sqrt(len(points))
    if extent[0] < SMALLEST:
        return f"is {number_text(extent[0], 2)} focal lengths in extent (1 sigma); expected at least {SMALLEST:g}"
    if extent[1] < FLATTEST * extent[0]:
        return f"is a line: {extent[1] / extent[0]:.1%} as wide as long; expected at least {FLATTEST:.0%}"
    return ""


def shape_matrix(first: FloatArray, *, with_shear: bool = True) -> FloatArray:
    """W of equation 2, or of equation 4: all affine deformations, or those of a vehicle that does not roll.

    Parameters
    ----------
    first : (N, 2) control points Q_0 [focal lengths].
    with_shear : whether M_21 and M_12 may differ from 0.

    Returns
    -------
    W : (2 N, 6) or (2 N, 4): rows are all u, then all v; columns as in equations 3 and 5.
    """
    one, none = np.ones(len(first)), np.zeros(len(first))
    u, v = first[:, 0], first[:, 1]
    across = [one, none, u, none, none, v]
    down = [none, one, none, v, u, none]
    columns = 6 if with_shear else 4
    return np.concatenate([np.stack(across[:columns], axis=1), np.stack(down[:columns], axis=1)])


def shape_vector(first: FloatArray, now: FloatArray, *, with_shear: bool = True) -> FloatArray:
    """S of equation 1 by least squares.

    That is (t_x, t_y, M_11 - 1, M_22 - 1, M_21, M_12), equation 3; the first four without shear, equation 5.

    Parameters
    ----------
    first, now : (N, 2) control points Q_0 and Q [focal lengths]; Q_0 not degenerate.
    with_shear : as in `shape_matrix`.
    """
    moved = (now - first).T.ravel()
    solved = np.linalg.lstsq(shape_matrix(first, with_shear=with_shear), moved, rcond=None)[0]
    return np.asarray(solved, dtype=np.float64)


def motion_of(shape: FloatArray, turned: float) -> CameraMotion:
    """Rotation and scaled translation of a shape vector: equations 6 to 12 with f = 1.

    Parameters
    ----------
    shape : (6,) or (4,) shape vector S.
    turned : a turn about the vertical whose sign the rotation has, counter-clockwise from above; only its sign counts.

    Raises
    ------
    ValueError
        the contour is seen mirrored or edge-on, which no camera in front of it sees.
    """
    t, M = shape[:2], np.eye(2)
    M[0, 0] += shape[2]
    M[1, 1] += shape[3]
    if len(shape) > 4:
        M[1, 0], M[0, 1] = shape[4], shape[5]
    if not np.linalg.det(M) > 0.0:
        raise ValueError("the contour is mirrored or edge-on; expected the side that the first frame shows")
    values, vectors = np.linalg.eigh(M @ M.T)
    scale, cosine = math.sqrt(values[1]), math.sqrt(values[0] / values[1])
    phi = math.atan2(vectors[1, 1], vectors[0, 1])
    # Of v_1 and -v_1, which both solve equation 11, the one with R_13 = sin(phi) sin(theta) of the turn's sign.
    if math.sin(phi) * turned < 0.0:
        phi += math.pi
    spin = np.diag([1.0, 1.0 / cosine]) @ _turn(-phi) @ M / scale
    psi = math.atan2(spin[1, 0], spin[0, 0])
    theta = math.acos(min(cosine, 1.0))
    R = _about_z(phi) @ _about_x(theta) @ _about_z(psi)
    T = np.array([t[0] / scale, t[1] / scale, 1.0 / scale]) - R[:, 2]
    return CameraMotion(R, T)


def _turn(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _about_z(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _about_x(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
