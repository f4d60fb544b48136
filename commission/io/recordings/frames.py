"""Where the scanners are on a vehicle, by the fixed transforms of a bag (`tf_static`, or `tf` that never changes)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.io.recordings.ros_messages import transform_of
from commission.site.recorded_mounting import RecordedMounting

BASES = ("base_link", "base_footprint", "base", "base_frame")
"""Frames of a vehicle (REP 105), whatever stands before them: `robot1/base_link`."""
_DEEPEST = 32
_MOVED = 1e-6
_LEVEL = 1e-9


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

    def mounting(self, scanner: str, frame: str, base: str) -> RecordedMounting | None:
        """Mounting of a scanner; None where the transforms do not tell.

        Parameters
        ----------
        scanner, frame : its name, and its frame.
        base : of the vehicle, as its odometry calls it; where that is not reached, the nearest of the usual names.
        """
        T_frame_scanner, nearest = np.eye(4), None
        own = base.strip("/")
        for _ in range(_DEEPEST):
            if frame == own:
                return _mounted(scanner, frame, T_frame_scanner)
            if nearest is None and frame.rpartition("/")[2] in BASES:
                # Taken unless what the odometry moves is further up: `base_footprint` often is.
                nearest = _mounted(scanner, frame, T_frame_scanner)
            step = self._parent.get(frame)
            if step is None or frame in self._moving:
                break
            frame, T_frame_scanner = step[0], step[1] @ T_frame_scanner
        return nearest


def _mounted(scanner: str, base: str, T_base_scanner: FloatArray) -> RecordedMounting:
    """Place, heading and lean of a scanner in the frame of its vehicle."""
    # Adding 0 makes -0 a 0; what is left of a turn by rounding is none, either.
    x, y = np.round(T_base_scanner[:2, 3], 9) + 0.0
    up = float(T_base_scanner[2, 2])
    return RecordedMounting(
        scanner=scanner,
        base=base,
        x=float(x),
        y=float(y),
        heading=math.atan2(T_base_scanner[1, 0], T_base_scanner[0, 0]),
        upside_down=up < -_LEVEL,
        lean=math.acos(min(1.0, abs(up))),
    )
