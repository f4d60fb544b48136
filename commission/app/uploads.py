"""Files that a browser sends: a button, a limit that is kept while they arrive, and a temporary file to read them from.

What a file is called is shown and never used as a path; what it holds is the business of whoever asked for it.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from viser import GuiApi, GuiEvent, GuiUploadButtonHandle, UploadedFile
from viser import _messages as messages

UPLOAD_LIMIT = 256_000_000
"""Bytes of one upload: it is held in memory until it is read."""
_LONGEST_NAME = 80
_ENDING = re.compile(r"\.[A-Za-z0-9]{1,8}")

OnFile = Callable[["Upload", int], None]
"""Takes a file and the number of the browser that sent it; called on a thread of viser's."""
OnRefused = Callable[[str, int], None]
"""Takes one line that says what was refused and what is expected, and the number of the browser."""


@dataclass(frozen=True, slots=True, eq=False)
class Upload:
    """A file that a browser has sent."""

    name: str
    """What it is called there: for the eye alone."""
    content: bytes
    """What it holds."""

    @contextmanager
    def as_file(self) -> Generator[Path]:
        """Lay the content into a temporary file, which is gone after the block; only the name's ending is kept."""
        ending = Path(self.name).suffix
        with tempfile.TemporaryDirectory(prefix="commission-") as folder:
            path = Path(folder) / f"upload{ending if _ENDING.fullmatch(ending) else ''}"
            path.write_bytes(self.content)
            yield path


def shown_name(name: str) -> str:
    """Return a name as a browser sent it without folders, control characters and excess length."""
    last = name.replace("\\", "/").rsplit("/", 1)[-1]
    printable = " ".join("".join(c if c.isprintable() else " " for c in last).split())
    if len(printable) > _LONGEST_NAME:
        printable = f"{printable[: _LONGEST_NAME - 12]}…{printable[-11:]}"
    return printable or "unnamed"


def megabytes(size: int) -> str:
    """Return a number of bytes as a person reads it."""
    return f"{size / 1e6:.0f} MB" if size >= 10_000_000 else f"{size / 1e6:.1f} MB"


def too_large(name: str, size: int, limit: int = UPLOAD_LIMIT) -> str:
    """Return what is said of a file over the limit."""
    return f"{shown_name(name)} has {megabytes(size)}; expected at most {megabytes(limit)} to upload"


def add_upload(
    gui: GuiApi,
    label: str,
    mime: str,
    on_file: OnFile,
    on_refused: OnRefused,
    *,
    hint: str | None = None,
    limit: int = UPLOAD_LIMIT,
) -> GuiUploadButtonHandle:
    """Add a button that takes a file from a browser.

    Parameters
    ----------
    gui : where the button is made.
    label, mime, hint : as `add_upload_button` takes them; the browser offers files of these types first.
    on_file : takes what has arrived.
    on_refused : told of a file over the limit.
    limit : bytes of a file. One that says that it is larger is refused before its content arrives, one that lies when
        it has sent more.
    """
    button = gui.add_upload_button(label, mime_type=mime, hint=hint)

    @button.on_upload
    def _(event: GuiEvent[Any]) -> None:
        sent: UploadedFile = event.target.value
        event.target._impl.value = UploadedFile("", b"")  # viser would hold the content until the next one comes
        if event.client_id is not None and sent.name:
            on_file(Upload(shown_name(sent.name), sent.content), event.client_id)

    _watch(gui, button, on_refused, limit)
    return button


def _watch(gui: GuiApi, button: GuiUploadButtonHandle, on_refused: OnRefused, limit: int) -> None:
    """Drop transfers to a button that are over the limit; viser's own handlers, which hold the parts, run before."""
    transfers = gui._current_file_upload_states
    interface = gui._websock_interface

    def refuse(client: int, transfer: str, size: int) -> None:
        name = str(transfers.pop(transfer)["filename"])
        on_refused(too_large(name, size, limit), client)
        # The browser shows a transfer until all of it is acknowledged.
        interface.queue_message(
            messages.FileTransferPartAck(
                source_component_uuid=button._impl.uuid,
                transfer_uuid=transfer,
                transferred_bytes=size,
                total_bytes=size,
            )
        )

    def started(client: int, message: messages.FileTransferStartUpload) -> None:
        is_ours = message.source_component_uuid == button._impl.uuid and message.transfer_uuid in transfers
        if is_ours and message.size_bytes > limit:
            refuse(client, message.transfer_uuid, message.size_bytes)

    def arrived(client: int, message: messages.FileTransferPart) -> None:
        transfer = transfers.get(message.transfer_uuid)
        if transfer is None or message.source_component_uuid != button._impl.uuid:
            return
        if transfer["transferred_bytes"] > limit:
            refuse(client, message.transfer_uuid, transfer["transferred_bytes"])

    interface.register_handler(messages.FileTransferStartUpload, started)
    interface.register_handler(messages.FileTransferPart, arrived)
