"""Looks into folders for browsers, in the background, and within what they may name."""

from __future__ import annotations

import os
from pathlib import Path

from commission.app.base.actions import Envelope, Sender
from commission.app.base.effects import Effect
from commission.app.base.jobs import Lane
from commission.app.base.reach import Reach, typed_path
from commission.app.base.service import Service
from commission.app.base.state import AppState
from commission.app.project.browsing import MOST_RECENT, Browse, Browsed, BrowseFolder
from commission.errors import CommissionError, UsageError
from commission.io.folder_listing import list_folder


class BrowseService(Service):
    """Lists folders."""

    effects = (BrowseFolder,)

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Look into a folder."""
        if not isinstance(effect, BrowseFolder):
            return
        asked, reach, begin = effect.asked, state.reach, state.folder
        self.context.jobs.start(
            "Looking into a folder",
            lambda _progress: looked(asked, reach, begin, sender),
            then=lambda found: Envelope(found, sender),
            key=("browse", sender.browser),
            lane=Lane.FILES,
            is_shown=False,
        )


def looked(asked: Browse, reach: Reach, begin: Path | None, sender: Sender) -> Browsed:
    """Return what is in a folder; why that cannot be said is part of what is returned.

    Parameters
    ----------
    asked : which folder; of a file the folder that it is in.
    reach : where the browser may name files.
    begin : where to begin where no folder is asked for: that of the project; none: a folder that is shared, or home.
    sender : who asks.
    """
    recent = tuple(each for each in asked.recent[:MOST_RECENT] if _is_there(each, reach, sender))
    try:
        folder = _folder(asked.path, reach, begin, sender)
        listing = list_folder(folder, lambda path: reach.lists(path, sender))
    except CommissionError as error:
        return Browsed(None, recent=recent, problem=str(error))
    above = folder.parent if folder.parent != folder and reach.lists(folder.parent, sender) else None
    return Browsed(listing, above, recent)


def _folder(path: str, reach: Reach, begin: Path | None, sender: Sender) -> Path:
    """Folder that is meant by what stands in a field."""
    shared = reach.folders or ()
    first = next((each for each in (begin, *shared) if each is not None and each.is_dir()), Path.home())
    asked = typed_path(path) if path.strip() else first
    folder = Path(os.path.normpath(asked if asked.is_absolute() else first / asked))
    if not reach.lists(folder, sender):
        names = ", ".join(str(each) for each in shared) or "none"
        raise UsageError(
            f"{path or 'the folder'}: is out of reach; expected one of the folders that are shared: {names}"
        )
    # What is typed may be half a path: its nearest folder is where one looks on.
    return next((each for each in (folder, *folder.parents) if each.is_dir() and reach.lists(each, sender)), first)


def _is_there(path: str, reach: Reach, sender: Sender) -> bool:
    try:
        return reach.lists(typed_path(path), sender) and typed_path(path).exists()
    except (OSError, ValueError):
        return False
