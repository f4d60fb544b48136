"""Nothing older than a second is lost when the program is killed; `tests.tools.attack_files` kills hundreds."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.app.project.killed_page import kill_pages


@pytest.mark.parametrize(("kills", "storm"), [(3, False), (6, True)], ids=["at human pace", "in a storm"])
def test_a_killed_page_loses_no_edit_that_is_older_than_a_second(tmp_path: Path, kills: int, storm: bool) -> None:
    toll = kill_pages(tmp_path, kills, 1, storm=storm)
    assert toll.kills == kills
    assert toll.edits >= kills
    assert all(age < 1.0 for age in toll.lost_ages), toll
