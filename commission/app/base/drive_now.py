"""The drive that is on the page, for whoever reads its records: what was localized, and where the cursor is."""

from __future__ import annotations

from dataclasses import dataclass

from commission.localization.run_columns import RunColumns
from commission.studies.run import RunInput


@dataclass(frozen=True, slots=True, eq=False)
class DriveNow:
    """A recorded, virtual or live drive; of a live one, what has come so far."""

    inputs: RunInput
    """Its records, its start, and what they were localized with."""
    stamp_ns: int
    """The cursor, by the clock of the records [ns]."""
    columns: RunColumns
    """What the localizer made of it."""
