"""What is asked about failing reflectors: one frozen value in the page's state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.planning.dependence import Failure
from commission.site.quantity import Choice


@dataclass(frozen=True, slots=True)
class FailureSettings:
    """Which ranking is wanted, and whose failure is shown."""

    failure: Annotated[Failure, Choice("Each is")] = Failure.BLOCKED
    """What happens to each reflector in turn."""
    ranking: int = 0
    """Number of times a ranking by what depends on each reflector was asked for; 0: it is not wanted."""
    fallen: tuple[str, ...] = ()
    """Ids of reflectors that have failed already when the others are ranked, in the order of failing."""
    failed: str = ""
    """Id of the reflector whose failure is shown on the floor; empty: none."""
