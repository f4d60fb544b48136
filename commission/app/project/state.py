"""What is known about the project's files: the feature's part of the page's state."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FilesState:
    """Saved when, and changed by whom."""

    saved_at: str = ""
    """Time of day of the last save; empty: not saved in this session."""
    foreign: tuple[str, ...] = ()
    """Files of the project that somebody else has changed since they were read or saved."""
