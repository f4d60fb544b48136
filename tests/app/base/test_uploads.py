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


class UploadBench:
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
def bench() -> Iterator[UploadBench]:
    opened = UploadBench()
    yield opened
    opened.close()


def test_file_arrives_in_parts_and_is_not_kept_afterwards(bench: UploadBench) -> None:
    bench.begin(6, 2)
    bench.part(0, b"abc")
    bench.part(1, b"def")
    bench.until(lambda: bool(bench.taken))
    assert bench.taken == [("hall.csv", b"abcdef")]
    assert bench.kept == 0
    assert bench.button.value.content == b""
    bench.begin(0, 0, transfer="empty")
    bench.until(lambda: len(bench.taken) == 2)
    assert bench.refused == []


def test_file_over_the_limit_is_refused_by_its_announced_size_and_no_byte_of_it_is_kept(bench: UploadBench) -> None:
    bench.begin(40_000_000, 80)
    for index in range(80):
        bench.part(index, b"x" * 500_000)
    bench.until(lambda: bool(bench.refused))
    assert bench.refused == ["the file has 40 MB (40,000,000 bytes); expected at most 1 MB"]
    # The next file is taken as if nothing had happened, after all parts of the first have been heard.
    bench.begin(3, 1, transfer="next")
    bench.part(0, b"abc", transfer="next")
    bench.until(lambda: bool(bench.taken))
    assert bench.taken == [("hall.csv", b"abc")]
    assert bench.kept == 0


def test_file_that_is_larger_than_announced_is_dropped(bench: UploadBench) -> None:
    bench.begin(LIMIT, 1000)
    bench.part(0, b"x" * 400_000)
    bench.until(lambda: bench.kept == 400_000)
    bench.part(1, b"x" * 900_000)
    bench.until(lambda: bool(bench.refused))
    assert bench.refused == ["the upload sends more than it announced; it was dropped"]
    assert bench.kept == 0
    assert bench.taken == []


@pytest.mark.parametrize(("size", "parts"), [(10, 0), (10, 11), (10, 10**9), (0, 1)])
def test_parts_that_cannot_make_up_the_file_are_refused(bench: UploadBench, size: int, parts: int) -> None:
    bench.begin(size, parts)
    bench.until(lambda: bool(bench.refused))
    assert bench.refused == [f"the upload announces {parts} parts of {size} bytes; expected a file"]
    assert bench.server.transfers.open == ()


@pytest.mark.parametrize(("size", "parts"), [(-1, 1), (10, -1), (1e99, 1), (1.5, 1)])
def test_sizes_that_are_none_are_refused(bench: UploadBench, size: float, parts: int) -> None:
    bench.begin(size, parts)
    bench.client.hear_until(lambda message: message["type"] == "NotificationShowMessage")
    assert bench.client.refused == 1
    assert bench.server.transfers.open == ()


def test_files_of_browsers_that_have_left_are_not_kept(bench: UploadBench) -> None:
    others = [RawClient(bench.server) for _ in range(4)]
    bench.until(lambda: len(bench.server.get_clients()) == 5)
    for number, other in enumerate(others):
        bench.begin(LIMIT, 3, transfer=f"t{number}", client=other)
        bench.part(0, b"x" * 300_000, transfer=f"t{number}", client=other)
    bench.until(lambda: bench.kept == 1_200_000)
    for other in others:
        other.close()
    bench.until(lambda: bench.server.transfers.open == ())


def test_files_on_their_way_are_bounded_over_all_browsers(bench: UploadBench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "MOST_KEPT", 1_000_000)
    other = RawClient(bench.server)
    bench.until(lambda: len(bench.server.get_clients()) == 2)
    bench.begin(LIMIT, 2, transfer="first", client=other)
    bench.part(0, b"x" * 700_000, transfer="first", client=other)
    bench.until(lambda: bench.kept == 700_000)
    bench.begin(LIMIT, 2)
    bench.part(0, b"x" * 299_000)
    bench.until(lambda: bench.kept == 999_000)
    bench.part(1, b"x" * 2_000)
    bench.until(lambda: bool(bench.refused))
    assert bench.refused == ["other files of 1 MB are on their way; expected to wait for them"]
    assert bench.kept == 700_000
    other.close()


def test_a_file_of_which_nothing_comes_any_more_makes_room_for_the_next(
    bench: UploadBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transfers, "STALE_AFTER_S", 0.0)
    other = RawClient(bench.server)
    bench.until(lambda: len(bench.server.get_clients()) == 2)
    bench.begin(LIMIT, 2, transfer="stale", client=other)
    bench.until(lambda: bench.server.transfers.get("stale") is not None)
    bench.begin(LIMIT, 2, transfer="new")
    bench.until(lambda: bench.server.transfers.get("new") is not None)
    assert bench.server.transfers.get("stale") is None
    other.close()


def test_nobody_else_hears_of_an_upload_and_nothing_of_it_stays(bench: UploadBench) -> None:
    other = RawClient(bench.server)
    other.hear_all(0.3)
    kept = len(bench.server._websock_server.get_message_buffer().message_from_id)
    bench.begin(6, 2)
    bench.part(0, b"abc")
    bench.part(1, b"def")
    bench.begin(LIMIT + 1, 2, transfer="large")
    bench.until(lambda: bool(bench.taken) and bool(bench.refused))
    other.hear_all(1.0)
    assert [message["type"] for message in other.heard if message["type"].startswith(("FileT", "Notif"))] == []
    assert len(bench.server._websock_server.get_message_buffer().message_from_id) == kept
    bench.client.hear_all(0.3)
    acks = [m["transferred_bytes"] for m in bench.client.heard if m["type"] == "FileTransferPartAck"]
    assert acks == [0, 3, 6, 1]
    other.close()


def test_nobody_can_send_parts_of_the_file_of_another_browser(bench: UploadBench) -> None:
    other = RawClient(bench.server)
    bench.until(lambda: len(bench.server.get_clients()) == 2)
    bench.begin(6, 2)
    bench.until(lambda: bench.server.transfers.get("t") is not None)
    bench.part(0, b"xyz", client=other)
    bench.part(0, b"abc")
    bench.part(0, b"123")
    bench.part(1, b"def")
    bench.until(lambda: bool(bench.taken))
    assert bench.taken == [("hall.csv", b"abcdef")]
    other.close()


def test_a_file_shorter_than_announced_is_dropped(bench: UploadBench) -> None:
    bench.begin(6, 2)
    bench.part(0, b"abc")
    bench.part(1, b"de")
    bench.until(lambda: bool(bench.refused))
    assert bench.refused == ["the upload sends 5 bytes; expected 6, as it announced"]
    assert bench.taken == []


def test_one_browser_sends_one_file_at_a_time(bench: UploadBench) -> None:
    for number in range(20):
        bench.begin(LIMIT, 3, transfer=f"t{number}")
        bench.part(0, b"x" * 300_000, transfer=f"t{number}")
    bench.until(lambda: bench.server.transfers.get("t19") is not None)
    bench.until(lambda: bench.kept == 300_000)
    assert len(bench.server.transfers.open) == 1


def test_files_come_in_through_upload_buttons_only(bench: UploadBench) -> None:
    bench.begin(3, 1, widget=bench.slider)
    bench.part(0, b"abc", widget=bench.slider)
    bench.begin(3, 1, transfer="next")
    bench.part(0, b"abc", transfer="next")
    bench.until(lambda: bool(bench.taken))
    assert bench.slider.value == 0


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


def test_a_name_arrives_without_folders(bench: UploadBench) -> None:
    bench.begin(3, 1, name="..\\..\\etc/hall.csv")
    bench.part(0, b"abc")
    bench.until(lambda: bool(bench.taken))
    assert bench.taken == [("hall.csv", b"abc")]
