"""Files from a browser: upload buttons with a stated limit, and the guard that refuses before anything is kept.

viser takes what any browser announces, for any of its widgets, and keeps the parts in memory until the last one comes.
Here a file is refused by its announced size, and cut off when more comes than was announced. What a file is called is
shown and never used as a path; what it holds is the business of whoever asked for it.
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from viser import GuiApi, GuiUploadButtonHandle, ViserServer

from commission.app.base import viser_private
from commission.app.base.server import PageServer
from commission.app.base.transfers import MOST_KEPT, Transfer, Transfers
from commission.io.imports import shown_name

REFUSED_AFTER_S = 0.5
"""Time until the browser's own note of the upload is replaced [s]; it would write over what comes at once."""

_ENDING = re.compile(r"\.[A-Za-z0-9]{1,8}")


@dataclass(frozen=True, slots=True, eq=False)
class Upload:
    """A file that a browser has sent."""

    name: str
    """As the browser calls it: shown, and its ending tells the format; never a path."""
    content: bytes
    """What it holds."""

    @property
    def title(self) -> str:
        """What it is called on the page."""
        return shown_name(self.name)

    @contextmanager
    def as_file(self) -> Generator[Path]:
        """Lay the content into a temporary file, which is gone after the block; only the name's ending is kept."""
        ending = Path(self.name).suffix
        with tempfile.TemporaryDirectory(prefix="commission-") as folder:
            path = Path(folder) / f"upload{ending if _ENDING.fullmatch(ending) else ''}"
            path.write_bytes(self.content)
            yield path


def megabytes(size: int) -> str:
    """Return a size as people read it: 32 MB, 0.25 MB, 12 bytes."""
    return f"{size / 1e6:.3g} MB" if size >= 10_000 else f"{size} bytes"


@dataclass(frozen=True, slots=True)
class _Button:
    """What becomes of files."""

    limit: int
    """Largest one [bytes]."""
    on_file: Callable[[int, Upload], None]
    """Takes the number of the browser's connection and the file."""


class Uploads:
    """Upload buttons of one `GuiApi`, shared or a browser's own; make one of these for each that has such buttons.

    Parameters
    ----------
    gui : where the buttons are made. From now on it takes files through them only.
    refused : takes the number of a browser's connection and one line that says why its file was not taken.
    """

    def __init__(self, gui: GuiApi, refused: Callable[[int, str], None]) -> None:
        self._gui, self._refused = gui, refused
        self._server = viser_private.server_of(gui)
        self._transfers = _transfers_of(self._server)
        self._buttons: dict[str, _Button] = {}
        viser_private.take_uploads(gui, self._begin, self._take)

    def add(
        self,
        label: str,
        on_file: Callable[[int, Upload], None],
        *,
        limit: int,
        endings: tuple[str, ...] = (),
        note: str = "",
    ) -> GuiUploadButtonHandle:
        """Add a button with a note under it that states the limit; viser shows no hint at such a button.

        Parameters
        ----------
        label : text on it.
        on_file : takes the number of the browser's connection and the file; it only posts.
        limit : largest file [bytes].
        endings : endings that the browser's dialog offers, with their dots; all when empty. Nothing is sure of them.
        note : one line about the file, written by us: it is shown as html.
        """
        button = self._gui.add_upload_button(label, mime_type=",".join(endings) or "*/*")
        stated = f"{note} At most {megabytes(limit)}.".strip()
        self._gui.add_html(f"<div class='c-note' style='padding:0 14px 4px 8px'>{stated}</div>")
        self._buttons[viser_private.identifier(button)] = _Button(limit, on_file)
        return button

    def _begin(self, client_id: int, message: Any) -> None:
        """Let an announced file in, or refuse it. Every interface hears every message: others' buttons are silent."""
        button = self._buttons.get(message.source_component_uuid)
        if button is None or self._transfers.get(message.transfer_uuid) is not None:
            return
        size, parts = message.size_bytes, message.part_count
        if size > button.limit:
            text = f"the file has {megabytes(size)} ({size:,} bytes); expected at most {megabytes(button.limit)}"
            self._refuse(client_id, message, text)
        elif not bool(size) <= parts <= size:
            self._refuse(client_id, message, f"the upload announces {parts} parts of {size} bytes; expected a file")
        elif viser_private.client_of(self._server, client_id) is not None:
            transfer = Transfer(
                client=client_id,
                button=message.source_component_uuid,
                name=message.filename,
                size=size,
                count=parts,
                touched=time.monotonic(),
            )
            self._transfers.begin(message.transfer_uuid, transfer)
            self._go_on(client_id, message, transfer)

    def _take(self, client_id: int, message: Any) -> None:
        """Let a part of an announced file in, as long as no more comes than was announced and than there is room."""
        transfer = self._transfers.get(message.transfer_uuid)
        if transfer is None or (transfer.client, transfer.button) != (client_id, message.source_component_uuid):
            return
        if transfer.button not in self._buttons or message.part_index in transfer.parts:
            return
        size = len(message.content)
        if transfer.received + size > transfer.size or message.part_index >= transfer.count:
            self._transfers.end(message.transfer_uuid)
            self._refused(client_id, "the upload sends more than it announced; it was dropped")
        elif self._transfers.kept + size > MOST_KEPT:
            self._transfers.end(message.transfer_uuid)
            text = f"other files of {megabytes(MOST_KEPT)} are on their way; expected to wait for them"
            self._refuse(client_id, message, text)
        else:
            transfer.parts[message.part_index] = message.content
            transfer.received += size
            transfer.touched = time.monotonic()
            self._go_on(client_id, message, transfer)

    def _go_on(self, client_id: int, message: Any, transfer: Transfer) -> None:
        """Tell the browser how far it is, and hand the file over when it is whole."""
        viser_private.acknowledge(self._server, client_id, message, transfer.received, transfer.size)
        if len(transfer.parts) < transfer.count:
            return
        self._transfers.end(message.transfer_uuid)
        if transfer.received != transfer.size:
            text = f"the upload sends {transfer.received} bytes; expected {transfer.size}, as it announced"
            self._refused(client_id, text)
            return
        content = b"".join(transfer.parts[index] for index in range(transfer.count))
        self._buttons[transfer.button].on_file(client_id, Upload(shown_name(transfer.name), content))

    def _refuse(self, client_id: int, message: Any, text: str) -> None:
        """Say why, and end the waiting of the browser's button and of its note."""
        viser_private.acknowledge(self._server, client_id, message, 1, 1)
        viser_private.event_loop(self._server).call_later(
            REFUSED_AFTER_S,
            lambda: viser_private.replace_upload_note(self._server, client_id, message.transfer_uuid, text),
        )
        self._refused(client_id, text)


def _transfers_of(server: ViserServer) -> Transfers:
    """Return what is on its way to a server; that of our own is the same for all its buttons."""
    return server.transfers if isinstance(server, PageServer) else Transfers(server)
