"""Uploads as a browser sends them, and as a hostile client does: raw messages to a real server."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import viser

from commission.app.base.server import start_server
from commission.app.base.uploads import Upload, Uploads, megabytes
from tests.app.raw_client import RawClient

LIMIT = 1_000_000


class Desk:
    """A server with one upload button, and a client that sends what it likes."""

    def __init__(self) -> None:
        self.taken: list[tuple[str, bytes]] = []
        self.refused: list[str] = []
        self.server: viser.ViserServer = start_server("127.0.0.1", 0)
        uploads = Uploads(self.server.gui, lambda _client, text: self.refused.append(text))
        self.button = uploads.add("Upload", self._take, limit=LIMIT)
        self.slider = self.server.gui.add_slider("Other", 0, 1, 1, 0)
        self._client = RawClient(self.server)
        self.until(lambda: bool(self.server.get_clients()))

    def _take(self, _client: int, upload: Upload) -> None:
        self.taken.append((upload.name, upload.content))

    def send(self, **message: Any) -> None:
        self._client.send(**message)

    def begin(
        self, size: float, parts: int, *, name: str = "hall.csv", transfer: str = "t", widget: Any = None
    ) -> None:
        self.send(
            type="FileTransferStartUpload",
            source_component_uuid=(widget or self.button)._impl.uuid,
            transfer_uuid=transfer,
            filename=name,
            mime_type="text/csv",
            part_count=parts,
            size_bytes=size,
        )

    def part(self, index: int, content: bytes, *, transfer: str = "t", widget: Any = None) -> None:
        self.send(
            type="FileTransferPart",
            source_component_uuid=(widget or self.button)._impl.uuid,
            transfer_uuid=transfer,
            part_index=index,
            content=content,
        )

    @property
    def kept(self) -> int:
        """Bytes that the server holds of files on their way."""
        states = self.server.gui._current_file_upload_states.values()
        return sum(state["transferred_bytes"] for state in states)

    def until(self, reached: Callable[[], bool]) -> None:
        for _ in range(1000):
            if reached():
                return
            time.sleep(0.01)
        raise TimeoutError("it did not happen within 10 s")

    def close(self) -> None:
        self._client.close()
        self.server.stop()


@pytest.fixture
def desk() -> Iterator[Desk]:
    opened = Desk()
    yield opened
    opened.close()


def test_file_arrives_in_parts_and_is_not_kept_afterwards(desk: Desk) -> None:
    desk.begin(6, 2)
    desk.part(0, b"abc")
    desk.part(1, b"def")
    desk.until(lambda: bool(desk.taken))
    assert desk.taken == [("hall.csv", b"abcdef")]
    assert desk.kept == 0
    assert desk.button.value.content == b""
    desk.begin(0, 0, transfer="empty")
    desk.until(lambda: len(desk.taken) == 2)
    assert desk.refused == []


def test_file_over_the_limit_is_refused_by_its_announced_size_and_no_byte_of_it_is_kept(desk: Desk) -> None:
    desk.begin(40_000_000, 80)
    for index in range(80):
        desk.part(index, b"x" * 500_000)
    desk.until(lambda: bool(desk.refused))
    assert desk.refused == ["the file has 40 MB (40,000,000 bytes); expected at most 1 MB"]
    # The next file is taken as if nothing had happened, after all parts of the first have been heard.
    desk.begin(3, 1, transfer="next")
    desk.part(0, b"abc", transfer="next")
    desk.until(lambda: bool(desk.taken))
    assert desk.taken == [("hall.csv", b"abc")]
    assert desk.kept == 0


def test_file_that_is_larger_than_announced_is_dropped(desk: Desk) -> None:
    desk.begin(LIMIT, 1000)
    desk.part(0, b"x" * 400_000)
    desk.until(lambda: desk.kept == 400_000)
    desk.part(1, b"x" * 900_000)
    desk.until(lambda: bool(desk.refused))
    assert desk.refused == ["the upload sends more than it announced; it was dropped"]
    assert desk.kept == 0
    assert desk.taken == []


@pytest.mark.parametrize(("size", "parts"), [(-1, 1), (10, -1), (10, 10**9), (0, 1), (1e99, 1)])
def test_nonsense_is_refused(desk: Desk, size: float, parts: int) -> None:
    desk.begin(size, parts)
    desk.until(lambda: bool(desk.refused))
    assert desk.server.gui._current_file_upload_states == {}


def test_one_browser_sends_one_file_at_a_time(desk: Desk) -> None:
    for number in range(20):
        desk.begin(LIMIT, 3, transfer=f"t{number}")
        desk.part(0, b"x" * 300_000, transfer=f"t{number}")
    desk.until(lambda: "t19" in desk.server.gui._current_file_upload_states)
    desk.until(lambda: desk.kept == 300_000)
    assert list(desk.server.gui._current_file_upload_states) == ["t19"]


def test_files_come_in_through_upload_buttons_only(desk: Desk) -> None:
    desk.begin(3, 1, widget=desk.slider)
    desk.part(0, b"abc", widget=desk.slider)
    desk.begin(3, 1, transfer="next")
    desk.part(0, b"abc", transfer="next")
    desk.until(lambda: bool(desk.taken))
    assert desk.slider.value == 0


def test_sizes_are_written_as_people_read_them() -> None:
    assert [megabytes(size) for size in (12, 250_000, 32_000_000)] == ["12 bytes", "0.25 MB", "32 MB"]


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


def test_a_name_arrives_without_folders(desk: Desk) -> None:
    desk.begin(3, 1, name="..\\..\\etc/hall.csv")
    desk.part(0, b"abc")
    desk.until(lambda: bool(desk.taken))
    assert desk.taken == [("hall.csv", b"abc")]
