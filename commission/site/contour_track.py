"""Tracked control points of a planar contour, as a camera on the vehicle sees them: frames of a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, frozen, read_only


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ContourTrack:
    """The same control points in frame after frame; frames in which a point is missing are not among them."""

    stamps_ns: IntArray
    """(K,) time of each frame, ascending [ns]."""
    points: FloatArray
    """(K, N, 2) u to the right and v down, in the unit of the table: focal lengths, or pixels."""
    names: tuple[str, ...]
    """(N,) of the points."""
    left_out: int = 0
    """Frames in which a point was missing."""

    def __post_init__(self) -> None:
        points = frozen(self.points, (len(self.stamps_ns), len(self.names), 2), "contour points")
        if len(self.stamps_ns) > 1 and not (np.diff(self.stamps_ns) > 0).all():
            raise ValueError("stamps of contours do not ascend; expected each frame once, in order")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "stamps_ns", read_only(self.stamps_ns))

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.stamps_ns)

    def in_focal_lengths(self, focal_length: float, principal_point: tuple[float, float]) -> ContourTrack:
        """Return the track of a table in pixels.

        Parameters
        ----------
        focal_length : of the camera [pixels], above 0.
        principal_point : u and v of it [pixels].
        """
        points = (self.points - np.array(principal_point)) / focal_length
        return ContourTrack(stamps_ns=self.stamps_ns, points=points, names=self.names, left_out=self.left_out)
