"""Looking for a file on the computer that serves the page: what can be asked, what came of it, and what that means.

A browser sees folders that it may name files in (`base/reach.py`), and nothing else: not even whether it is there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from commission.app.base.actions import Action, Sender
from commission.app.base.effects import Effect
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.io.folder_listing import FolderListing

MOST_RECENT = 8
"""Files of before that are looked for."""


@dataclass(frozen=True, slots=True)
class Browse(Action):
    """Look into a folder."""

    path: str
    """Folder, or a file in it; empty: where to begin."""
    recent: tuple[str, ...] = ()
    """Files and folders that were chosen before, to see which are still there."""


@dataclass(frozen=True, slots=True)
class Browsed(Action):
    """A folder was looked into."""

    listing: FolderListing | None
    """What is in it; none where that cannot be said."""
    above: Path | None = None
    """The folder above it; none: there is none, or it is out of reach."""
    recent: tuple[str, ...] = ()
    """What is still there of what was chosen before."""
    problem: str = ""
    """Why there is no listing."""


@dataclass(frozen=True, slots=True)
class BrowseFolder(Effect):
    """Look into a folder."""

    asked: Browse
    """Which one."""


@dataclass(frozen=True, slots=True)
class Browsing:
    """What one browser looks at."""

    found: Browsed | None = None
    """The newest folder; none before the first."""


@reduce.register
def browse(action: Browse, state: AppState, _sender: Sender) -> Outcome:
    """Look into a folder in the background: a disk of the network takes its time."""
    return Outcome(state, (BrowseFolder(action),))


@reduce.register
def browsed(action: Browsed, state: AppState, sender: Sender) -> Outcome:
    """Show what is there to who asked."""
    return Outcome(state.with_browser(sender.browser, Browsing(action)))
