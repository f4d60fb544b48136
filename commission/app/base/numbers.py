"""Numbers as a person reads them, for panels of all features."""

from __future__ import annotations

from collections.abc import Sequence

from commission.site.quantity import number_text


def metres_text(metres: Sequence[int]) -> str:
    """Return numbers of metres as the ranges of the way that they make up."""
    ranges: list[list[int]] = []
    for metre in metres:
        if ranges and metre == ranges[-1][1]:
            ranges[-1][1] = metre + 1
        else:
            ranges.append([metre, metre + 1])
    return ", ".join(f"{number_text(a)} to {number_text(b)} m" for a, b in ranges) or "nothing fails"
