"""Where the scanners are on a vehicle, by the fixed transforms of a bag (`tf_static`, or `tf` that never changes)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.io.recordings.ros_messages import transform_of

BASES = ("base_link", "base_footprint", "base", "base_frame")
"""Frames of a vehicle, the preferred one first (REP 105)."""
_DEEPEST = 32
_MOVED = 1e-6
_LEVEL = 1e-9
_TILT = 5.0
"""Angle of the plane of a scanner with the floor from which it is told [deg]."""


class Frames:
    """Transforms between the frames of a vehicle, each with its parent."""

    def __init__(self) -> None:
        self._parent: dict[str, tuple[str, FloatArray]] = {}
        self._moving: set[str] = set()

    def add(self, stamped: Any) -> None:
        """Take a TransformStamped; one that changes is none of a scanner that is bolted on."""
        child, parent = str(stamped.child_frame_id).strip("/"), str(stamped.header.frame_id).strip("/")
        pose = transform_of(stamped.transform)
        known = self._parent.get(child)
        if known is not None and (known[0] != parent or not np.allclose(known[1], pose, atol=_MOVED)):
            self._moving.add(child)
        self._parent[child] = parent, pose

    def mounting(self, frame: str, base: str) -> str:
        """Mounting of a scanner in words; empty where the transforms do not tell.

        Parameters
        ----------
        frame : of the scanner.
        base : of the vehicle, as its odometry calls it; the usual names are tried, too.
        """
        T_frame_scanner = np.eye(4)
        wanted = {base.strip("/"), *BASES} - {""}
        for _ in range(_DEEPEST):
            if frame in wanted:
                return _in_words(frame, T_frame_scanner)
            step = self._parent.get(frame)
            if step is None or frame in self._moving:
                return ""
            frame, T_frame_scanner = step[0], step[1] @ T_frame_scanner
        return ""


def _in_words(base: str, T_base_scanner: FloatArray) -> str:
    """Place [m] and heading [rad] of a scanner in the frame of its vehicle."""
    # Adding 0 makes -0 a 0; what is left of a turn by rounding is none, either.
    x, y = np.round(T_base_scanner[:2, 3], 9) + 0.0
    heading = math.atan2(T_base_scanner[1, 0], T_base_scanner[0, 0])
    up = float(T_base_scanner[2, 2])
    down = ", upside down" if up < -_LEVEL else ""
    # What measures in a plane that leans sees no hall; a camera's optical frame stands upright.
    tilt = math.degrees(math.acos(min(1.0, abs(up))))
    leaning = (
        f", its plane leaning by {tilt:.3g} deg: expected is the frame in which it measures" if tilt > _TILT else ""
    )
    return f"[{x:.4g}, {y:.4g}, {heading:.4g}]{down}{leaning} (x [m], y [m], heading [rad] in {base})"
