"""What one message of a live source says: a record, and when and as which one it was sent. It decodes nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from commission.geometry.arrays import FloatArray, frozen
from commission.site.records import Record


@dataclass(frozen=True, slots=True)
class OdometryPose:
    """Where the wheels say that the vehicle is: of two of them, the way between becomes an odometry record.

    A message that is lost costs nothing: the next one says the whole way.
    """

    stamp_ns: int
    """Time of the pose [ns]."""
    pose: FloatArray
    """(3,) pose of base in the frame in which odometry began [m, m, rad]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", frozen(self.pose, (3,), "odometry pose"))


Sent: TypeAlias = Record | OdometryPose
"""What a message can say."""


@dataclass(frozen=True, slots=True)
class LiveMessage:
    """One record from outside; its stamp is set where clocks are known."""

    record: Sent
    """What was measured; its own stamp says nothing yet."""
    device_ns: int | None = None
    """Time by the sender's clock [ns]; None where it says none, and the time of arrival has to do."""
    sequence: int | None = None
    """Number of the message among those of its sender; None where it has none."""
