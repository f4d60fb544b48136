"""What became of the records of a session: how many came, how many the localizer took, and why the others are missing.

It counts nothing itself: sources and sorter do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from commission.io.live.status import SourceStatus
from commission.site.records import Detections, Odometry, Record, ReferencePose, Reflex, Scan, TagSightings

WORDS: dict[type[Record], tuple[str, str]] = {
    Odometry: ("odometry record", "odometry records"),
    ReferencePose: ("reference pose", "reference poses"),
    Detections: ("set of detections", "sets of detections"),
    Scan: ("scan", "scans"),
    TagSightings: ("frame with tags", "frames with tags"),
    Reflex: ("reflex", "reflexes"),
}
"""What one record and several are called."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordAccount:
    """Records of a session, and what became of them."""

    received: int = 0
    """Records that came, from all sources."""
    taken: int = 0
    """Records that the localizer took."""
    too_late: Mapping[type[Record], int] = field(default_factory=dict[type[Record], int])
    """Records of each kind that came when a later one had been taken: later than the patience allows."""
    dropped: int = 0
    """Records for which there was no room, since nobody took them in time."""
    refused: int = 0
    """Records that the localizer could not take; why is in the log."""
    given_up: int = 0
    """Records that waited when it was stopped, and were given up since the localizer got nowhere."""
    never_came: int = 0
    """Messages that never came, by the numbers that their senders give them."""
    undecodable: int = 0
    """Pieces that could not be decoded."""

    @staticmethod
    def of(
        statuses: Sequence[SourceStatus],
        taken: int,
        too_late: Mapping[type[Record], int],
        refused: int = 0,
        *,
        is_given_up: bool = False,
    ) -> RecordAccount:
        """Return the account of a session.

        Parameters
        ----------
        statuses : of its sources.
        taken : records that the localizer took.
        too_late : records that came too late, by kind.
        refused : records that it could not take.
        is_given_up : whether what waits is not taken any more.
        """
        received = sum(each.records for each in statuses)
        dropped = sum(each.overrun for each in statuses)
        waiting = received - taken - sum(too_late.values()) - dropped - refused
        return RecordAccount(
            received=received,
            taken=taken,
            too_late={kind: count for kind, count in too_late.items() if count},
            dropped=dropped,
            refused=refused,
            given_up=max(waiting, 0) if is_given_up else 0,
            never_came=sum(each.lost for each in statuses),
            undecodable=sum(each.undecodable for each in statuses),
        )

    @property
    def lost(self) -> int:
        """Records that are not in the run, and should be."""
        late = sum(self.too_late.values())
        return late + self.dropped + self.refused + self.given_up + self.never_came + self.undecodable

    @property
    def text(self) -> str:
        """In words: that none is lost, or how many for which reason."""
        if not self.lost:
            return f"{self.received} records received, none lost"
        reasons = [f"{counted(kind, count)} came too late" for kind, count in self.too_late.items()]
        reasons += [f"{self.dropped} dropped, since this computer was too slow"] if self.dropped else []
        reasons += [f"{self.refused} refused by the localizer"] if self.refused else []
        reasons += [f"{self.given_up} given up at the end"] if self.given_up else []
        reasons += [f"{self.never_came} never came"] if self.never_came else []
        reasons += [f"{self.undecodable} undecodable"] if self.undecodable else []
        return f"{self.received} records received, {self.lost} lost: {', '.join(reasons)}"


def counted(kind: type[Record], count: int) -> str:
    """Return a number of records of one kind in words."""
    return f"{count} {WORDS[kind][count != 1]}"
