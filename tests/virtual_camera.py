"""A pinhole camera on a vehicle that looks at a board: what it sees, by plain geometry.

No code is shared with the estimator.
"""

from dataclasses import dataclass

import numpy as np

DEPTH = 7.7
"""Distance of the board in the first frame, as in the paper [m]."""
WAY = 3.5
"""How far the vehicle drives, as in the paper [m]."""


@dataclass(frozen=True)
class Camera:
    """Where the camera is on the vehicle, and how well points are tracked."""

    forward: float = 0.235
    left: float = 0.030
    yaw: float = 0.02
    pitch: float = -0.01
    roll: float = 0.005
    slant_across: float = 0.03
    slant_down: float = -0.02
    focal_length: float = 1000.0
    noise: float = 0.3
    """1-sigma of a coordinate of a control point [pixels]."""

    @property
    def constants(self) -> dict[str, float]:
        """All that the drive should tell."""
        names = ("forward", "left", "yaw", "slant_across", "slant_down", "pitch", "roll")
        return {name: getattr(self, name) for name in names}


def drive(frames: int = 200, way: float = WAY, turning_deg: float = 2.0) -> np.ndarray:
    """(K, 3) poses of base: along x, perturbed by small turnings, at the paper's 126 ms."""
    s = np.linspace(0.0, 1.0, frames)
    theta = np.radians(turning_deg) * (np.sin(3.0 * np.pi * s) + 0.5 * np.sin(1.4 * np.pi * s))
    steps = way / (frames - 1) * np.stack([np.cos(theta[:-1]), np.sin(theta[:-1])], axis=1)
    return np.column_stack([np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)]), theta])


def place(base: np.ndarray, camera: Camera) -> np.ndarray:
    """(K, 3) pose of the camera on the floor: x, y, direction it looks in."""
    c, s = np.cos(base[:, 2]), np.sin(base[:, 2])
    x = base[:, 0] + c * camera.forward - s * camera.left
    y = base[:, 1] + s * camera.forward + c * camera.left
    return np.column_stack([x, y, base[:, 2] + camera.yaw])


def increments(places: np.ndarray) -> np.ndarray:
    """(K, 3) forward, left and turn since the first."""
    d, angle = places - places[0], places[0, 2]
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0], d[:, 2]])


def board(points: int = 40, width: float = 1.6, height: float = 1.2) -> np.ndarray:
    """(N, 2) control points along the rim of an information board, right and down of its middle [m]."""
    rim = []
    for index in range(points):
        side, share = divmod(index / points * 4.0, 1.0)
        a = 2.0 * share - 1.0
        rim.append([(a, -1.0), (1.0, a), (-a, 1.0), (-1.0, -a)][int(side)])
    return np.array(rim) * [width / 2.0, height / 2.0]


def seen(
    base: np.ndarray, camera: Camera, rng: np.random.Generator, contour: np.ndarray | None = None, depth: float = DEPTH
) -> np.ndarray:
    """(K, N, 2) pixels from the principal point, u to the right and v down, of a board in front of the first pose."""
    rim = board() + np.array([0.2, -0.1]) if contour is None else contour
    looks = np.stack([_axes(angle, camera) for angle in place(base, camera)[:, 2]])
    eyes = np.column_stack([place(base, camera)[:, :2], np.zeros(len(base))])
    along = depth - rim @ [camera.slant_across, camera.slant_down]
    corners = eyes[0] + np.column_stack([rim, along]) @ looks[0].T
    ray = np.einsum("kji,knj->kni", looks, corners - eyes[:, np.newaxis])
    pixels = camera.focal_length * ray[..., :2] / ray[..., 2:]
    return pixels + rng.normal(0.0, camera.noise, pixels.shape)


def _axes(direction: float, camera: Camera) -> np.ndarray:
    """Columns: right, down and forward of the camera in x, y, z (up) of the map."""
    c, s = np.cos(direction), np.sin(direction)
    heading = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    level = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    # The floor's down, (0, 0, -1), is (roll, 1, pitch) in a tilted camera, to first order.
    p, r = -camera.pitch, camera.roll
    nod = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(p), -np.sin(p)], [0.0, np.sin(p), np.cos(p)]])
    bank = np.array([[np.cos(r), -np.sin(r), 0.0], [np.sin(r), np.cos(r), 0.0], [0.0, 0.0, 1.0]])
    return heading @ level @ nod @ bank
