"""What carries the talk between the page's script for files (`web_assets/files.js`) and the program; nobody sees it."""

from __future__ import annotations

import json
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct
from viser import GuiApi

from commission.app.base import viser_private
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.view import PageView
from commission.app.project.browsing import MOST_RECENT, Browse, Browsed, Browsing

LONGEST_PATH = 4_096
Path_ = Annotated[str, Meta(max_length=LONGEST_PATH)]


class FolderAsked(Struct, frozen=True, forbid_unknown_fields=True):
    """What the script asks for."""

    n: int
    """Counts up: to ask for the same thing again is another text."""
    path: Path_
    """Folder; empty: where to begin."""
    recent: Annotated[tuple[Path_, ...], Meta(max_length=MOST_RECENT)] = ()
    """What was chosen before."""


_DECODER = msgspec.json.Decoder(FolderAsked)


def asked(text: str) -> Browse:
    """Return what a line of the script asks for.

    Raises
    ------
    ValueError
        it is none.
    """
    try:
        found = _DECODER.decode(text)
    except msgspec.MsgspecError as error:
        raise ValueError(f"the page asks for the folder {text[:60]!r}; expected what its script says") from error
    return Browse(found.path, found.recent)


def told(found: Browsed) -> dict[str, Any]:
    """Return what the script shows."""
    listing = found.listing
    return {
        "folder": "" if listing is None else str(listing.folder),
        "above": None if found.above is None else str(found.above),
        "recent": list(found.recent),
        "problem": found.problem,
        "leftOut": 0 if listing is None else listing.left_out,
        "entries": []
        if listing is None
        else [
            {
                "name": each.name,
                "path": str(listing.folder / each.name),
                "isFolder": each.is_folder,
                "size": each.size,
                "changed": each.changed,
            }
            for each in listing.entries
        ],
    }


class BrowsePanel(BasePanel):
    """One browser's way to folders.

    Parameters
    ----------
    gui, post : where the widget is made, what takes its actions.
    browser : number of its connection.
    """

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._server, self._browser = viser_private.server_of(gui), browser
        inbox = gui.add_text("Folder to look into", "", visible=False)
        inbox.on_update(posting(post, lambda event: asked(event.target.value)))
        self.inbox = inbox
        self._told: Browsed | None = None
        script = f"window.commissionFolders = {json.dumps(viser_private.identifier(inbox))}"
        viser_private.run_on_page(self._server, browser, script)

    def draw(self, view: PageView) -> None:
        """Show what was found."""
        found = view.state.of_browser(self._browser, Browsing).found
        if found is not None and found is not self._told:
            self._told = found
            script = f"window.commissionFound?.({json.dumps(told(found))})"
            viser_private.run_on_page(self._server, self._browser, script)
