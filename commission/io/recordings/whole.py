"""What recordings have in common that are read as a whole, since their records lie in no order of stamps."""

from __future__ import annotations

from collections.abc import Iterator

from commission.site.record_log import RecordLog
from commission.site.records import Record
from commission.site.reference_mount import BASE, ReferenceMount
from commission.site.truth import Truth


class WholeRecording:
    """A recording of other programs, which say neither what is true nor where a reference measures."""

    def load(self) -> RecordLog:
        """Read everything into columns; raises FileFormatError."""
        raise NotImplementedError

    def records(self) -> Iterator[Record]:
        """Deliver every record in order of stamps; the recording is read through before the first one."""
        return self.load().records()

    def truth(self) -> Truth | None:
        """Return nothing: only virtual drives have constants that are known."""
        return None

    def reference_mount(self) -> ReferenceMount:
        """Return base, for which a reference is taken."""
        return BASE
