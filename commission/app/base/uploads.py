"""Files from a browser: upload buttons with a stated limit, and the guard that refuses before anything is kept.

viser takes what any browser announces, for any of its widgets, and keeps the parts in memory until the last one comes.
Here a file is refused by its announced size, and cut off when more comes than was announced. What a file is called is
shown and never used as a path; what it holds is the business of whoever asked for it.
"""

from __future__ import annotations

import asyncio
import re
import tempfile
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from viser import GuiApi, GuiEvent, GuiUploadButtonHandle, UploadedFile, _messages

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


@dataclass(slots=True)
class _Transfer:
    """A file on its way."""

    client: int
    """Number of the browser's connection."""
    button: str
    """Identifier of the button."""
    left: int
    """Bytes that may still come."""


def megabytes(size: int) -> str:
    """Return a size as people read it: 32 MB, 0.25 MB, 12 bytes."""
    return f"{size / 1e6:.3g} MB" if size >= 10_000 else f"{size} bytes"


class Uploads:
    """Upload buttons of one `GuiApi`, shared or a browser's own; make one of these for each that has such buttons.

    Parameters
    ----------
    gui : where the buttons are made. From now on it takes files through them only.
    refused : takes the number of a browser's connection and one line that says why its file was not taken.
    """

    def __init__(self, gui: GuiApi, refused: Callable[[int, str], None]) -> None:
        self._gui, self._refused = gui, refused
        self._limits: dict[str, int] = {}
        self._transfers: dict[str, _Transfer] = {}
        # viser has no hook before it begins to collect: its two handlers are exchanged for ours, which call them.
        socket = gui._websock_interface
        socket.unregister_handler(_messages.FileTransferStartUpload, gui._handle_file_transfer_start)
        socket.unregister_handler(_messages.FileTransferPart, gui._handle_file_transfer_part)
        socket.register_handler(_messages.FileTransferStartUpload, self._begin)
        socket.register_handler(_messages.FileTransferPart, self._take)

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
        self._limits[button._impl.uuid] = limit

        async def uploaded(event: GuiEvent[Any]) -> None:
            file = event.target.value
            if event.client is None or not isinstance(file, UploadedFile):
                return
            # viser keeps the last file of each button for ever.
            button._impl.value = UploadedFile("", b"")
            on_file(event.client.client_id, Upload(shown_name(file.name), file.content))

        button.on_upload(uploaded)
        return button

    def _begin(self, client_id: int, message: _messages.FileTransferStartUpload) -> None:
        """Let an announced file in, or refuse it. Every interface hears every message: others' buttons are silent."""
        limit = self._limits.get(message.source_component_uuid)
        if limit is None or message.transfer_uuid in self._transfers:
            return
        size, parts = message.size_bytes, message.part_count
        if size > limit:
            text = f"the file has {megabytes(size)} ({size:,} bytes); expected at most {megabytes(limit)}"
            self._refuse(client_id, message, text)
        elif not 0 <= parts <= size:
            self._refuse(client_id, message, f"the upload announces {parts} parts of {size} bytes; expected a file")
        else:
            self._forget_others(client_id, message.source_component_uuid)
            self._transfers[message.transfer_uuid] = _Transfer(client_id, message.source_component_uuid, size)
            self._gui._handle_file_transfer_start(client_id, message)  # type: ignore[arg-type]

    def _take(self, client_id: int, message: _messages.FileTransferPart) -> None:
        """Let a part of an announced file in, as long as no more comes than was announced."""
        transfer = self._transfers.get(message.transfer_uuid)
        if transfer is None or transfer.client != client_id or not isinstance(message.content, bytes):
            return
        transfer.left -= len(message.content)
        if transfer.left < 0:
            self._forget(message.transfer_uuid)
            self._refused(client_id, "the upload sends more than it announced; it was dropped")
            return
        self._gui._handle_file_transfer_part(client_id, message)  # type: ignore[arg-type]
        if message.transfer_uuid not in self._gui._current_file_upload_states:
            del self._transfers[message.transfer_uuid]

    def _forget_others(self, client_id: int, button: str) -> None:
        """One file at a time for a browser and button: a hostile one could otherwise begin thousands."""
        for name, transfer in tuple(self._transfers.items()):
            is_over = name not in self._gui._current_file_upload_states
            if is_over or (transfer.client, transfer.button) == (client_id, button):
                self._forget(name)

    def _forget(self, transfer_uuid: str) -> None:
        self._transfers.pop(transfer_uuid, None)
        self._gui._current_file_upload_states.pop(transfer_uuid, None)

    def _refuse(self, client_id: int, message: _messages.FileTransferStartUpload, text: str) -> None:
        """Say why, and end the waiting of the browser's button and of its note."""
        socket = self._gui._websock_interface
        done = _messages.FileTransferPartAck(message.source_component_uuid, message.transfer_uuid, 1, 1)
        note = _messages.NotificationProps("Not taken", text, False, True, 10.0, "red")
        socket.queue_message(done)
        asyncio.get_running_loop().call_later(
            REFUSED_AFTER_S,
            lambda: socket.queue_message(_messages.NotificationUpdateMessage(f"upload-{message.transfer_uuid}", note)),
        )
        self._refused(client_id, text)
