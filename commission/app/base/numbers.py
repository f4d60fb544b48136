"""Numbers as a person reads them, for panels of all features."""

from __future__ import annotations

from collections.abc import Sequence


def number_text(value: float) -> str:
    """Return a number with three digits, without an exponent where a person would write none."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def metres_text(metres: Sequence[int]) -> str:
    """Return numbers of metres as the ranges of the way that they make up."""
    ranges: list[list[int]] = []
    for metre in metres:
        if ranges and metre == ranges[-1][1]:
            ranges[-1][1] = metre + 1
        else:
            ranges.append([metre, metre + 1])
    return ", ".join(f"{number_text(a)} to {number_text(b)} m" for a, b in ranges) or "nothing fails"
