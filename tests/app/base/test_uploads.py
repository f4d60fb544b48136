"""Uploads as a browser sends them, and as a hostile client does: raw messages to a real server."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from commission.app.base import transfers, uploads
from commission.app.base.server import PageServer, start_server
from commission.app.base.uploads import Upload, Uploads, megabytes
from tests.app.raw_client import RawClient

LIMIT = 1_000_000


class Desk:
    """A server with one upload button, and a client that sends what it likes."""

    def __init__(self) -> None:
        self.taken: list[tuple[str, bytes]] = []
        self.refused: list[str] = []
        self.server: PageServer = start_server("127.0.0.1", 0)
        buttons = Uploads(self.server.gui, lambda _client, text: self.refused.append(text))
        self.button = buttons.add("Upload", self._take, limit=LIMIT)
        self.slider = self.server.gui.add_slider("Other", 0, 1, 1, 0)
        self.client = RawClient(self.server)
        self.until(lambda: bool(self.server.get_clients()))

    def _take(self, _client: int, upload: Upload) -> None:
        self.taken.append((upload.name, upload.content))

    def begin(
        self,
        size: float,
        parts: int,
        *,
        name: str = "hall.csv",
        transfer: str = "t",
        widget: Any = None,
        client: RawClient | None = None,
    ) -> None:
        (client or self.client).send(
            type="FileTransferStartUpload",
            source_component_uuid=(widget or self.button)._impl.uuid,
            transfer_uuid=transfer,
            filename=name,
            mime_type="text/csv",
            part_count=parts,
            size_bytes=size,
        )

    def part(
        self,
        index: int,
        content: bytes,
        *,
        transfer: str = "t",
        widget: Any = None,
        client: RawClient | None = None,
    ) -> None:
        (client or self.client).send(
            type="FileTransferPart",
            source_component_uuid=(widget or self.button)._impl.uuid,
            transfer_uuid=transfer,
            part_index=index,
            content=content,
        )

    @property
    def kept(self) -> int:
        """Bytes that the server holds of files on their way."""
        return sum(transfer.received for transfer in self.server.transfers.open)

    def until(self, reached: Callable[[], bool]) -> None:
        for _ in range(1000):
            if reached():
                return
            time.sleep(0.01)
        raise TimeoutError("it did not happen within 10 s")

    def close(self) -> None:
        self.client.close()
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


@pytest.mark.parametrize(("size", "parts"), [(10, 0), (10, 11), (10, 10**9), (0, 1)])
def test_parts_that_cannot_make_up_the_file_are_refused(desk: Desk, size: int, parts: int) -> None:
    desk.begin(size, parts)
    desk.until(lambda: bool(desk.refused))
    assert desk.refused == [f"the upload announces {parts} parts of {size} bytes; expected a file"]
    assert desk.server.transfers.open == ()


@pytest.mark.parametrize(("size", "parts"), [(-1, 1), (10, -1), (1e99, 1), (1.5, 1)])
def test_sizes_that_are_none_are_refused(desk: Desk, size: float, parts: int) -> None:
    desk.begin(size, parts)
    desk.client.hear_until(lambda message: message["type"] == "NotificationShowMessage")
    assert desk.client.refused == 1
    assert desk.server.transfers.open == ()


def test_files_of_browsers_that_have_left_are_not_kept(desk: Desk) -> None:
    others = [RawClient(desk.server) for _ in range(4)]
    desk.until(lambda: len(desk.server.get_clients()) == 5)
    for number, other in enumerate(others):
        desk.begin(LIMIT, 3, transfer=f"t{number}", client=other)
        desk.part(0, b"x" * 300_000, transfer=f"t{number}", client=other)
    desk.until(lambda: desk.kept == 1_200_000)
    for other in others:
        other.close()
    desk.until(lambda: desk.server.transfers.open == ())


def test_files_on_their_way_are_bounded_over_all_browsers(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "MOST_KEPT", 1_000_000)
    other = RawClient(desk.server)
    desk.until(lambda: len(desk.server.get_clients()) == 2)
    desk.begin(LIMIT, 2, transfer="first", client=other)
    desk.part(0, b"x" * 700_000, transfer="first", client=other)
    desk.until(lambda: desk.kept == 700_000)
    desk.begin(LIMIT, 2)
    desk.part(0, b"x" * 299_000)
    desk.until(lambda: desk.kept == 999_000)
    desk.part(1, b"x" * 2_000)
    desk.until(lambda: bool(desk.refused))
    assert desk.refused == ["other files of 1 MB are on their way; expected to wait for them"]
    assert desk.kept == 700_000
    other.close()


def test_a_file_of_which_nothing_comes_any_more_makes_room_for_the_next(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transfers, "STALE_AFTER_S", 0.0)
    other = RawClient(desk.server)
    desk.until(lambda: len(desk.server.get_clients()) == 2)
    desk.begin(LIMIT, 2, transfer="stale", client=other)
    desk.until(lambda: desk.server.transfers.get("stale") is not None)
    desk.begin(LIMIT, 2, transfer="new")
    desk.until(lambda: desk.server.transfers.get("new") is not None)
    assert desk.server.transfers.get("stale") is None
    other.close()


def test_nobody_else_hears_of_an_upload_and_nothing_of_it_stays(desk: Desk) -> None:
    other = RawClient(desk.server)
    other.hear_all(0.3)
    kept = len(desk.server._websock_server.get_message_buffer().message_from_id)
    desk.begin(6, 2)
    desk.part(0, b"abc")
    desk.part(1, b"def")
    desk.begin(LIMIT + 1, 2, transfer="large")
    desk.until(lambda: bool(desk.taken) and bool(desk.refused))
    other.hear_all(1.0)
    assert [message["type"] for message in other.heard if message["type"].startswith(("FileT", "Notif"))] == []
    assert len(desk.server._websock_server.get_message_buffer().message_from_id) == kept
    desk.client.hear_all(0.3)
    acks = [m["transferred_bytes"] for m in desk.client.heard if m["type"] == "FileTransferPartAck"]
    assert acks == [0, 3, 6, 1]
    other.close()


def test_nobody_can_send_parts_of_the_file_of_another_browser(desk: Desk) -> None:
    other = RawClient(desk.server)
    desk.until(lambda: len(desk.server.get_clients()) == 2)
    desk.begin(6, 2)
    desk.until(lambda: desk.server.transfers.get("t") is not None)
    desk.part(0, b"xyz", client=other)
    desk.part(0, b"abc")
    desk.part(0, b"123")
    desk.part(1, b"def")
    desk.until(lambda: bool(desk.taken))
    assert desk.taken == [("hall.csv", b"abcdef")]
    other.close()


def test_a_file_shorter_than_announced_is_dropped(desk: Desk) -> None:
    desk.begin(6, 2)
    desk.part(0, b"abc")
    desk.part(1, b"de")
    desk.until(lambda: bool(desk.refused))
    assert desk.refused == ["the upload sends 5 bytes; expected 6, as it announced"]
    assert desk.taken == []


def test_one_browser_sends_one_file_at_a_time(desk: Desk) -> None:
    for number in range(20):
        desk.begin(LIMIT, 3, transfer=f"t{number}")
        desk.part(0, b"x" * 300_000, transfer=f"t{number}")
    desk.until(lambda: desk.server.transfers.get("t19") is not None)
    desk.until(lambda: desk.kept == 300_000)
    assert len(desk.server.transfers.open) == 1


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
