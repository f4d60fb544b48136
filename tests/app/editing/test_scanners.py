"""Scanners come, go and get names on the page: each is one undo step."""

from pathlib import Path

import numpy as np
import pytest

from commission.app.base import actions as page
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.app.editing.typed_lists import list_text, list_value
from commission.app.run.vehicle_layer import fan
from commission.errors import ProjectError, UsageError
from commission.site.scanner import Scanner
from tests.app.asking import ME, after, by, joined
from tests.app.sites import room
from tests.browser.serving import Served
from tests.two_scanners import with_two


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


def test_a_new_name_leaves_the_fields_in_which_somebody_may_be_typing(tmp_path: Path) -> None:
    served = Served(with_two(room()), tmp_path)
    try:
        handles = served.server.gui._gui_input_handle_from_uuid

        def called(*labels: str) -> set[str]:
            """Identifiers of the widgets that are called so."""
            return {uuid for uuid, widget in tuple(handles.items()) if getattr(widget, "label", "") in labels}

        before, there = set(handles), called("Remove rear right", "rear right by hand [ms]")
        assert len(there) == 2
        served.runtime.post(by(ME, actions.SetEquipment("scanners[1].name", "dock")))
        served.until(lambda: called("Remove dock", "dock by hand [ms]") == there)
        assert before <= set(handles), "none was made anew"
        served.runtime.post(by(ME, actions.RemoveScanner("dock")))
        served.until(lambda: not called("Remove dock") and called("By hand [ms]"))
        assert served.state.faults == ()
    finally:
        served.close()


def test_a_scanner_is_removed_but_never_the_last(state: AppState) -> None:
    two = after(state, by(ME, actions.AddScanner())).state
    one = after(two, by(ME, actions.RemoveScanner("scanner"))).state
    assert names(one) == ["scanner 2"]
    with pytest.raises(UsageError, match="'scanner 2' is the only scanner"):
        after(one, by(ME, actions.RemoveScanner("scanner 2")))


def test_blind_sectors_are_typed_in_degrees_and_an_empty_line_removes_them(state: AppState) -> None:
    name = "scanners[0].blind_sectors_deg"
    typed = list_value("blind_sectors_deg", "-120 -90.5, 60 75")
    blind = after(state, by(ME, actions.SetEquipment(name, typed))).state
    assert blind.project.scanners[0].blind_sectors_deg == ((-120.0, -90.5), (60.0, 75.0))
    assert list_text(typed) == "-120 -90.5, 60 75"
    cleared = after(blind, by(ME, actions.SetEquipment(name, list_value("blind_sectors_deg", "  ")))).state
    assert cleared.project.scanners[0].blind_sectors_deg == ()
    assert list_text(()) == ""
    with pytest.raises(ValueError, match=r"expected sectors that do not overlap"):
        after(state, by(ME, actions.SetEquipment(name, ((0.0, 20.0), (10.0, 30.0)))))


@pytest.mark.parametrize("text", ["10", "10 20 30", "a b", "10 20,"])
def test_what_is_no_sector_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(ValueError, match="expected first and last bearing of each sector like -135 -120, 60 75"):
        list_value("blind_sectors_deg", text)


def test_detection_rates_are_typed_as_distances_with_their_shares_in_one_undo_step(state: AppState) -> None:
    typed = list_value("detection_rates", "5 0.8, 15 0.12")
    rated = after(state, by(ME, actions.SetEquipment("scanners[0].detection_rates", typed))).state
    assert rated.project.scanners[0].detection_rates == ((5.0, 0.8), (15.0, 0.12))
    assert list_text(typed) == "5 0.8, 15 0.12"
    assert after(rated, by(ME, page.Undo())).state.project.scanners[0].detection_rates == ()
    assert list_value("detection_rates", " ") == ()
    with pytest.raises(ValueError, match=r"expected distance \[m\] and share of scans like 5 0.8, 15 0.12"):
        list_value("detection_rates", "5")
    with pytest.raises(ValueError, match="expected distances that ascend"):
        after(state, by(ME, actions.SetEquipment("scanners[0].detection_rates", ((5.0, 0.8), (4.0, 0.9)))))


def test_the_field_of_view_is_drawn_with_a_gap_for_each_blind_sector() -> None:
    scanner = Scanner(field_of_view_deg=(-100.0, 100.0), blind_sectors_deg=((20.0, 40.0),))
    strokes = fan(scanner, 2.0)
    middles = strokes.mean(axis=1)
    bearings = np.degrees(np.arctan2(middles[:, 1], middles[:, 0]))
    on_arc = np.hypot(middles[:, 0], middles[:, 1]) > 1.9
    assert not ((bearings[on_arc] > 20.0) & (bearings[on_arc] < 40.0)).any()
    assert sorted(bearings[~on_arc].round(6).tolist()) == [-100.0, 20.0, 40.0, 100.0]
    turn = Scanner(field_of_view_deg=(-180.0, 180.0), blind_sectors_deg=((20.0, 40.0),))
    ends = fan(turn, 2.0).mean(axis=1)
    edges = ends[np.hypot(ends[:, 0], ends[:, 1]) < 1.5]
    assert sorted(np.degrees(np.arctan2(edges[:, 1], edges[:, 0])).round(6).tolist()) == [20.0, 40.0]
