"""The folder with which a floor map is loaded, on a real server without a browser: what it shows and what it posts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser

from commission.app.base.actions import Action, Report
from commission.app.base.jobs import Job
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.floor_map import actions
from commission.app.floor_map.align_tool import AlignTool, NamedPoint
from commission.app.floor_map.draft import MapDraft, MapFile, MapLoading, MapOptions, MapTrouble, Stage, WaitingMap
from commission.app.floor_map.draft_fields import MOST_LAYERS, MapDraftFields, facts, layers_by_size
from commission.app.floor_map.draft_layer import INK, PAPER, MapDraftLayer, preview
from commission.app.floor_map.floor_map_panel import FloorMapPanel, MapTroublePanel, said
from commission.app.floor_map.tool_fields import alignment_text
from commission.io.dxf import Drawing, DrawingLayer
from commission.io.image_map import Picture
from commission.io.mesh import Model
from commission.site.project import Project
from tests.app.asking import taking

NASTY = "<img src=x onerror=alert(1)>"
SEGMENTS = np.array([[[0.0, 0.0], [10.0, 0.0]], [[10.0, 0.0], [10.0, 5.0]], [[2.0, 1.0], [3.0, 1.0]]])
LAYERS = (DrawingLayer("TEXT", False, 1), DrawingLayer(NASTY, True, 2))
DRAWING = Drawing(
    path=Path("a.dxf"), unit="mm", layers=LAYERS, segments=SEGMENTS, layer_of=np.array([1, 1, 0], np.int32), warnings=()
)
WHITE = np.full((40, 60), 255, np.uint8)
DRAFTS = {
    "drawing": MapDraft(file=MapFile(Path(f"{NASTY}.dxf")), read=DRAWING),
    "model": MapDraft(file=MapFile(Path("a.stl")), read=Model(Path("a.stl"), np.arange(9.0).reshape(1, 3, 3))),
    "picture": MapDraft(file=MapFile(Path("a.png")), read=Picture(WHITE, WHITE), stage=Stage(0.1, 0.0, 4.0)),
}


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_server("127.0.0.1", 0)
    yield started
    started.stop()


def change(widget: Any, value: Any) -> None:
    """Let a widget say that a person changed it, as viser does."""
    widget._impl.value = value
    for callback in widget._impl.update_cb:
        callback(SimpleNamespace(client=SimpleNamespace(client_id=1), client_id=1, target=widget))


def labelled(server: viser.ViserServer, label: str) -> Any:
    """The visible widget of this label."""
    found = [
        w for w in server.gui._gui_input_handle_from_uuid.values() if getattr(w, "label", "") == label and w.visible
    ]
    assert len(found) == 1, (label, found)
    return found[0]


@pytest.mark.parametrize("kind", sorted(DRAFTS))
def test_each_kind_of_file_shows_its_own_inputs(server: viser.ViserServer, kind: str) -> None:
    posted: list[Action] = []
    fields = MapDraftFields(server.gui, taking(posted))
    every = {
        "drawing": ("Unit", "Cell [mm]"),
        "model": ("Unit", "Upward", "Cut at [m]", "Cell [mm]"),
        "picture": ("Walls from [%]", "Walls are", "A to B [m]", "A to B is", "A is at [m]"),
    }
    fields.show(DRAFTS[kind])
    visible = {getattr(w, "label", "") for w in server.gui._gui_input_handle_from_uuid.values() if w.visible}
    assert set(every[kind]) <= visible
    assert not visible & (set().union(*every.values()) - set(every[kind]))
    fields.show(None)
    assert not any(
        w.visible for w in server.gui._gui_input_handle_from_uuid.values() if w.label in set().union(*every.values())
    )


def test_inputs_post_si_units_and_nonsense_is_told(server: viser.ViserServer) -> None:
    posted: list[Action] = []
    fields = MapDraftFields(server.gui, taking(posted))
    fields.show(DRAFTS["model"])
    change(labelled(server, "Cell [mm]"), 25.0)
    change(labelled(server, "Cut at [m]"), "0.2, 1.8")
    change(labelled(server, "Cut at [m]"), "low")
    change(labelled(server, "Unit"), "ft")
    assert posted[0] == actions.SetMapOption("resolution", 0.025)
    assert posted[1] == actions.SetMapOption("heights", (0.2, 1.8))
    assert posted[2] == Report("heights are 'low'; expected numbers like 0.2 1.8")
    assert isinstance(posted[3], actions.SetReading) and posted[3].reading.unit == "ft"
    fields.show(DRAFTS["picture"])
    change(labelled(server, "A to B is"), "y axis")
    assert posted[-1] == actions.SetMapOption("direction", np.pi / 2)


def test_layers_are_chosen_one_by_one_by_their_plain_names(server: viser.ViserServer) -> None:
    posted: list[Action] = []
    fields = MapDraftFields(server.gui, taking(posted))
    fields.show(DRAFTS["drawing"])
    assert [layer.name for layer in layers_by_size(DRAWING)] == [NASTY, "TEXT"]
    lines = fields._rows._buttons
    assert [line.label for line in lines] == [f"✓ {NASTY}  2", "· TEXT  1"]
    change(lines[1], True)
    assert posted[-1] == actions.SetMapOption("layers", tuple(sorted((NASTY, "TEXT"))))
    fields.show(replace(DRAFTS["drawing"], options=MapOptions(layers=("TEXT",))))
    assert [line.label for line in lines] == [f"· {NASTY}  2", "✓ TEXT  1"]


def test_a_layer_among_hundreds_is_found_by_a_part_of_its_name(server: viser.ViserServer) -> None:
    posted: list[Action] = []
    fields = MapDraftFields(server.gui, taking(posted))
    hatches = (DrawingLayer(f"HATCH {n}", True, 1000 - n) for n in range(200))
    layers = (*hatches, DrawingLayer("A-Wall", False, 3))
    drawing = Drawing(
        path=Path("a.dxf"),
        unit="mm",
        layers=layers,
        segments=SEGMENTS,
        layer_of=np.array([200, 200, 0], np.int32),
        warnings=(),
    )
    fields.show(MapDraft(file=MapFile(Path("a.dxf")), read=drawing))
    assert sum(line.visible for line in fields._rows._buttons) == MOST_LAYERS
    assert "of 201 layers" in fields._rest.content
    change(labelled(server, "Find"), "wall")
    fields.refresh()
    assert [line.label for line in fields._rows._buttons if line.visible] == ["· A-Wall  3"]
    change(fields._rows._buttons[0], True)
    visible = tuple(layer.name for layer in layers[:200])
    assert posted[-1] == actions.SetMapOption("layers", tuple(sorted((*visible, "A-Wall"))))
    change(labelled(server, "Find"), "door")
    fields.refresh()
    assert "no layer" in fields._rest.content


def test_names_of_files_are_shown_as_text() -> None:
    waiting = WaitingMap(MapFile(Path(f"{NASTY}.yaml")), NASTY)
    text = said(MapLoading(waiting=waiting, notes=(NASTY,)))
    assert "<img" not in text
    # In the words, and as what the page's script knows them by.
    assert text.count("&lt;img") == 5
    assert all("<img" not in value for _, value in facts(DRAFTS["drawing"]))
    named = AlignTool(known=(NamedPoint((0.0, 0.0), (0.0, 0.0), NASTY), NamedPoint((9.0, 0.0), (9.0, 0.0))))
    assert "<img" not in alignment_text(named)


def test_why_a_file_is_no_floor_map_is_shown_as_text_and_to_the_browser_that_asked(server: viser.ViserServer) -> None:
    mine, other = (MapTroublePanel(server.gui, number) for number in (1, 2))
    state = AppState(project=Project(name="x"), saved=Project(name="x")).joined(1).joined(2)
    view = view_of(state.with_browser(1, MapTrouble(NASTY)), jobs=(), waiting=())
    for panel in (mine, other):
        panel.draw_slowly(view)
    assert "<img" not in mine._said.content
    assert "&lt;img" in mine._said.content
    assert mine._said.visible
    assert other._said.content == ""
    assert not other._said.visible


def test_facts_tell_how_large_a_file_makes_the_hall() -> None:
    assert dict(facts(DRAFTS["drawing"]))["Measures"] == "10.0 x 5.0 m"
    assert dict(facts(DRAFTS["model"]))["Height"] == "2.00 to 8.00 m"
    placed = replace(DRAFTS["picture"], pixels=((0.0, 20.0), (50.0, 20.0)), options=MapOptions(distance=10.0))
    assert dict(facts(placed))["Measures"] == "12.0 x 8.0 m"
    assert dict(facts(DRAFTS["picture"]))["Points"].startswith("click the first one")


def test_the_difference_of_distances_is_told_in_millimetres_with_what_is_allowed() -> None:
    def text(plant: float) -> str:
        a, b = NamedPoint((0.0, 0.0), (0.0, 0.0)), NamedPoint((10.0, 0.0), (plant, 0.0))
        return alignment_text(AlignTool(known=(a, b)))

    assert "+5 mm (0.05 %)" in text(10.005)
    assert "More than 0.2 %" in text(10.05)
    assert "More than 2 %" in text(10.5)


def test_progress_and_cancel_appear_while_a_file_is_read(server: viser.ViserServer) -> None:
    posted: list[Action] = []
    panel = FloorMapPanel(server.gui, taking(posted), Project())
    state = AppState(project=Project(), saved=Project())
    panel.draw(
        view_of(
            state,
            jobs=(Job(number=1, name="Coverage", fraction=0.2), Job(number=2, name="Reading hall.dxf", fraction=0.4)),
        )
    )
    assert (panel._bar.visible, panel._bar.value, panel._cancel.visible) == (True, 40.0, True)
    change(panel._cancel, True)
    assert posted == [actions.StopMapJob()]
    panel.draw(view_of(state, jobs=(Job(number=1, name="Coverage", fraction=0.2),)))
    assert (panel._bar.visible, panel._cancel.visible) == (False, False)


def test_a_typed_path_is_opened_and_an_empty_one_told(server: viser.ViserServer) -> None:
    posted: list[Action] = []
    FloorMapPanel(server.gui, taking(posted), Project())
    change(labelled(server, "Open"), True)
    change(labelled(server, "Map file"), " /halls/3.yaml ")
    change(labelled(server, "Open"), True)
    assert isinstance(posted[0], Report)
    assert posted[-1] == actions.OpenMap(MapFile(Path("/halls/3.yaml")))


def test_an_image_is_shown_as_the_walls_that_it_would_become(server: viser.ViserServer) -> None:
    gray = np.full((40, 60), 255, np.uint8)
    gray[0] = 100
    picture = Picture(gray, gray)
    # viser draws the first row lowest; the image's first row is its top.
    assert (preview(picture, 0.5, light_walls=False)[-1] == INK).all()
    assert (preview(picture, 0.3, light_walls=False)[-1] == PAPER).all()
    layer = MapDraftLayer(server.scene)
    draft = replace(DRAFTS["picture"], pixels=((30.0, 20.0),))
    state = AppState(project=Project(), saved=Project()).with_part(MapLoading(draft=draft))
    layer.draw(view_of(state))
    assert {node.name for node in layer.nodes()} == {"/draft/image", "/draft/points", "/draft/line", "/draft/A"}
    np.testing.assert_allclose(layer.nodes()[0].position[:2], (3.0, 2.0))
    layer.draw(view_of(AppState(project=Project(), saved=Project())))
    assert layer.nodes() == ()
