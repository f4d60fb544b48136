"""Which paths a browser may name, once other computers are let in."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from commission.app.base import reach
from commission.app.base.actions import PROGRAM, Sender
from commission.app.base.reach import EVERYWHERE, Reach, typed_path
from commission.errors import UsageError

GUEST = Sender(3)


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """A project's folder beside secrets and shared recordings."""
    for name in ("hall/drive", "shared/drive", "secret", "hallway"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("hall/table.csv", "shared/drive/odometry.csv", "secret/key", "hallway/key"):
        (tmp_path / name).write_text("x")
    return tmp_path / "hall"


def test_who_sits_at_this_computer_may_name_any_file(hall: Path) -> None:
    for path in (hall.parent / "secret/key", Path("~/x"), Path("/etc/passwd")):
        assert EVERYWHERE.checked(path, GUEST) == path


def test_what_the_program_was_started_with_is_not_questioned(hall: Path) -> None:
    recording = hall.parent / "secret"
    assert Reach.within([hall]).checked(recording, PROGRAM) == recording


def test_files_of_the_project_and_of_shared_folders_may_be_read_and_written(hall: Path) -> None:
    shared = Reach.within([hall, hall.parent / "shared"])
    for name in ("hall", "hall/table.csv", "hall/new/copy", "shared/drive", "shared/drive/odometry.csv"):
        assert shared.checked(hall.parent / name, GUEST) == hall.parent / name


@pytest.mark.parametrize(
    "name",
    ["", "secret", "secret/key", "nothing/there", "hallway/key", "hall/../secret/key", "hall/drive/../../secret"],
)
def test_nothing_else_can_be_named_and_nobody_learns_whether_it_exists(hall: Path, name: str) -> None:
    path = hall.parent / name
    with pytest.raises(UsageError) as refused:
        Reach.within([hall, hall.parent / "shared"]).checked(path, GUEST)
    assert str(refused.value) == (
        f"{path}: is out of reach; expected a path in the folders that are shared: {hall}, {hall.parent / 'shared'}"
    )


def test_links_that_lead_out_of_reach_are_refused(hall: Path) -> None:
    inside = Reach.within([hall])
    (hall / "to_secret").symlink_to(hall.parent / "secret")
    (hall / "to_key").symlink_to("../secret/key")
    (hall / "to_table").symlink_to("table.csv")
    (hall / "to_itself").symlink_to("to_itself")
    assert inside.checked(hall / "to_table", GUEST) == hall / "table.csv"
    for name in ("to_secret", "to_secret/key", "to_secret/new", "to_key", "to_secret/../secret/key"):
        with pytest.raises(UsageError, match="out of reach"):
            inside.checked(hall / name, GUEST)
    with pytest.raises(UsageError):
        inside.checked(hall / "to_itself", GUEST)


@pytest.mark.parametrize("name", ["odometry.csv", "deep/down/scans.npz"])
def test_a_folder_with_such_a_link_in_it_is_refused(hall: Path, name: str) -> None:
    inside = Reach.within([hall])
    drive = hall / "drive"
    (drive / name).parent.mkdir(parents=True, exist_ok=True)
    (drive / "table.csv").symlink_to(hall / "table.csv")
    assert inside.checked(drive, GUEST) == drive
    (drive / name).symlink_to(hall.parent / "secret/key")
    with pytest.raises(UsageError, match="out of reach"):
        inside.checked(drive, GUEST)


def test_a_folder_that_is_itself_a_link_is_shared_where_it_leads(hall: Path) -> None:
    link = hall.parent / "link"
    link.symlink_to(hall)
    assert Reach.within([link]).checked(link / "table.csv", GUEST) == hall / "table.csv"
    assert Reach.within([link]).checked(hall / "table.csv", GUEST) == hall / "table.csv"


def test_a_home_cannot_be_reached_by_its_sign(hall: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who reads the path would make a home of ~ only after it has been checked."""
    monkeypatch.chdir(hall)
    monkeypatch.setenv("HOME", str(hall.parent / "secret"))
    (hall / "~").mkdir()
    with pytest.raises(UsageError, match="out of reach"):
        Reach.within([hall]).checked(Path("~/key"), GUEST)
    monkeypatch.setenv("HOME", str(hall))
    assert Reach.within([hall]).checked(Path("~/table.csv"), GUEST) == hall / "table.csv"


def test_a_path_from_where_the_program_was_started_counts_from_there(
    hall: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(hall)
    assert Reach.within([hall]).checked(Path("table.csv"), GUEST) == hall / "table.csv"
    monkeypatch.chdir(hall.parent)
    with pytest.raises(UsageError):
        Reach.within([hall]).checked(Path("secret/key"), GUEST)


def test_a_bundled_project_shares_nothing_unless_something_is_named(hall: Path) -> None:
    with pytest.raises(UsageError, match="folders that are shared: none"):
        Reach.within([None]).checked(hall / "table.csv", GUEST)
    assert Reach.within([None, hall]).checked(hall / "table.csv", GUEST) == hall / "table.csv"


def test_a_file_cannot_be_shared_as_a_folder(hall: Path) -> None:
    with pytest.raises(UsageError, match=r"table\.csv: is no folder"):
        Reach.within([hall / "table.csv"])
    assert Reach.within([hall / "not yet"]).folders == (hall / "not yet",)


def test_what_is_no_path_is_refused_in_one_line(hall: Path) -> None:
    with pytest.raises(UsageError, match="is no path"):
        Reach.within([hall]).checked(Path("a\0b"), GUEST)


def test_a_folder_with_more_files_than_any_recording_is_not_gone_through(
    hall: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reach, "MOST_LOOKED_AT", 2)
    for number in range(3):
        (hall / "drive" / str(number)).write_text("")
    with pytest.raises(UsageError, match="holds more than 2 files"):
        Reach.within([hall]).checked(hall / "drive", GUEST)


def test_a_typed_path_may_begin_at_home_and_have_spaces_around_it() -> None:
    assert typed_path("  ~/halls/a b ") == Path(os.path.expanduser("~")) / "halls/a b"
    assert typed_path("~nobody-of-this-name/x") == Path("~nobody-of-this-name/x")
