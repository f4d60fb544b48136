"""The drive that is on the page, for whoever reads its records: what was localized, and where the cursor is."""

from __future__ import annotations

from dataclasses import dataclass

from commission.localization.setup import LocalizerSetup
from commission.studies.run import RunInput


@dataclass(frozen=True, slots=True, eq=False)
class DriveNow:
    """A recorded, virtual or live drive; of a live one, what has come so far."""

    inputs: RunInput
    """Its records, its start, and what they were localized with."""
    stamp_ns: int
    """The cursor, by the clock of the records [ns]."""
    setup: LocalizerSetup
    """What the scan at the cursor was localized with."""
