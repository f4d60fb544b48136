"""What is known about the project's files: the feature's part of the page's state."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from commission.app.project.actions import AskToReplace


@dataclass(frozen=True, slots=True, kw_only=True)
class FilesState:
    """Saved when, and changed by whom."""

    saved_at: str = ""
    """Time of day of the last save; empty: not saved in this session."""
    foreign: tuple[str, ...] = ()
    """Files of the project that somebody else has changed since they were read or saved."""
    holder: str = ""
    """Who else edits the project, in words; empty: nobody."""
    is_protected: bool = True
    """Whether all unsaved edits are in the journal."""
    kept_in: Path | None = None
    """Where unsaved edits are while the project's folder is gone; none: it is there."""


@dataclass(frozen=True, slots=True)
class CopyQuestion:
    """What one browser is asked: it names what lies in a folder that this browser has named."""

    asked: AskToReplace | None = None
    """A copy that waits for an answer; none: there is no question."""
