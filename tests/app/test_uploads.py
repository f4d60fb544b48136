"""Files that browsers send: what they are called is never trusted, and what is over the limit never arrives."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import viser
from viser import _messages as messages

from commission.app.server import start_server
from commission.app.uploads import Upload, add_upload, shown_name, too_large

LIMIT = 1000


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_server("127.0.0.1", 0)
    yield started
    started.stop()


@pytest.mark.parametrize(
    ("sent", "shown"),
    [
        ("hall.dxf", "hall.dxf"),
        ("/etc/passwd", "passwd"),
        ("..\\..\\hall.stl", "hall.stl"),
        ("a\x00b\nc.png", "a b c.png"),
        ("", "unnamed"),
        ("dir/", "unnamed"),
    ],
)
def test_a_name_is_shown_without_folders_and_control_characters(sent: str, shown: str) -> None:
    assert shown_name(sent) == shown


def test_a_long_name_keeps_its_ending() -> None:
    shown = shown_name("x" * 5000 + ".dxf")
    assert len(shown) <= 80
    assert shown.endswith(".dxf")


@pytest.mark.parametrize("name", ["hall.stl", "../../x.stl", "<b>.stl", "a b.stl"])
def test_content_is_read_from_a_file_of_our_own_name_that_is_gone_afterwards(name: str) -> None:
    with Upload(name, b"solid").as_file() as path:
        assert path.name == "upload.stl"
        assert path.read_bytes() == b"solid"
    assert not path.parent.exists()


@pytest.mark.parametrize("name", ["noending", "a.b/c", "x." + "y" * 100, "x.p?g"])
def test_an_odd_ending_is_not_kept(name: str) -> None:
    with Upload(name, b"").as_file() as path:
        assert path.name == "upload"


def test_what_is_refused_is_named_with_its_size() -> None:
    assert too_large("/x/hall.stl", 700_000_000) == "hall.stl has 700 MB; expected at most 256 MB to upload"


class Browser:
    """Sends the messages of an upload as viser's page does, to a server without a connection."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._gui: Any = server.gui
        self.arrived: list[Upload] = []
        self.refused: list[str] = []
        self.button = add_upload(
            server.gui,
            "Upload",
            ".dxf",
            lambda upload, _client: self.arrived.append(upload),
            lambda text, _client: self.refused.append(text),
            limit=LIMIT,
        )

    def send(self, message: messages.Message) -> None:
        for handler in list(self._gui._websock_interface._incoming_handlers[type(message)]):
            handler(7, message)

    def start(self, name: str, size: int, parts: int) -> None:
        uuid = self.button._impl.uuid
        self.send(messages.FileTransferStartUpload(uuid, "t", name, "", parts, size))

    def part(self, index: int, content: bytes) -> None:
        self.send(messages.FileTransferPart(self.button._impl.uuid, "t", index, content))

    @property
    def held(self) -> int:
        """Bytes that viser holds of transfers under way."""
        states = self._gui._current_file_upload_states.values()
        return sum(len(part) for state in states for part in state["parts"].values())


def test_a_file_over_the_limit_is_refused_before_it_arrives(server: viser.ViserServer) -> None:
    browser = Browser(server)
    browser.start("hall.dxf", LIMIT + 1, 2)
    assert browser.refused == [too_large("hall.dxf", LIMIT + 1, LIMIT)]
    browser.part(0, b"x" * LIMIT)
    assert (browser.held, browser.arrived) == (0, [])


def test_a_file_that_lies_about_its_size_is_dropped_when_it_has_sent_more(server: viser.ViserServer) -> None:
    browser = Browser(server)
    browser.start("hall.dxf", 10, 100)
    browser.part(0, b"x" * 600)
    assert browser.held == 600
    browser.part(1, b"x" * 600)
    assert (browser.held, len(browser.refused)) == (0, 1)
    browser.part(2, b"x" * 600)
    assert browser.held == 0


def test_an_allowed_file_is_taken(server: viser.ViserServer) -> None:
    browser = Browser(server)
    browser.start("hall.dxf", LIMIT, 2)
    browser.part(0, b"x" * (LIMIT // 2))
    assert browser.held == LIMIT // 2
    assert browser.refused == []


def test_nothing_of_a_name_is_a_path() -> None:
    with Upload("/tmp/../x.yaml", b"").as_file() as path:
        assert path.parent.parent == Path(path.parent.parent).resolve()
        assert path.name == "upload.yaml"
