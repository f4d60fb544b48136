"""Scanners come, go and get names on the page: each is one undo step."""

from pathlib import Path

import numpy as np
import pytest

from commission.app.base import actions as page
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.errors import ProjectError, UsageError
from tests.app.asking import ME, after, by, joined
from tests.app.sites import room


@pytest.fixture
def state() -> AppState:
    project = room()
    return joined(AppState(project=project, saved=project, folder=Path("hall")))


def names(state: AppState) -> list[str]:
    return [scanner.name for scanner in state.project.scanners]


def test_a_scanner_is_added_on_the_opposite_corner_and_taken_back_in_one_step(state: AppState) -> None:
    mounted = by(ME, actions.SetEquipment("scanners[0].mounting[0]", 0.4))
    turned = by(ME, actions.SetEquipment("scanners[0].mounting[2]", 0.5))
    added = after(state, mounted, turned, by(ME, actions.AddScanner())).state
    assert names(added) == ["scanner", "scanner 2"]
    assert added.project.scanners[1].mounting == pytest.approx(np.array([-0.4, 0.0, 0.5 - np.pi]))
    assert names(after(added, by(ME, page.Undo())).state) == ["scanner"]


def test_a_scanner_is_renamed_and_no_name_is_given_twice(state: AppState) -> None:
    two = after(state, by(ME, actions.AddScanner())).state
    renamed = after(two, by(ME, actions.SetEquipment("scanners[1].name", "rear right"))).state
    assert names(renamed) == ["scanner", "rear right"]
    with pytest.raises(ProjectError, match="scanner name 'Scanner' is used twice"):
        after(renamed, by(ME, actions.SetEquipment("scanners[1].name", "Scanner")))


def test_a_scanner_is_removed_but_never_the_last(state: AppState) -> None:
    two = after(state, by(ME, actions.AddScanner())).state
    one = after(two, by(ME, actions.RemoveScanner("scanner"))).state
    assert names(one) == ["scanner 2"]
    with pytest.raises(UsageError, match="'scanner 2' is the only scanner"):
        after(one, by(ME, actions.RemoveScanner("scanner 2")))
