"""Every number that can be typed on the page, one row each: its label, unit and bounds are those that are written here.

No field without its widget, and no widget without a field. Parameters and the virtual world have tables of their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import viser

from commission.app.ambiguity.settings import AmbiguitySettings
from commission.app.base.actions import Action, Report
from commission.app.base.conditions import Conditions
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.panel import Panel, Post
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.base.widget_values import problem_with
from commission.app.coverage.settings import CoverageSettings
from commission.app.editing.actions import (
    ChooseTool,
    MirrorSelected,
    RepeatSelected,
    SelectControlPoint,
    SelectReflectors,
    SetCoordinate,
    SetSegment,
    SetSelected,
)
from commission.app.editing.editor import ControlPoint, PosedKey, PosedKind, editor_of
from commission.app.editing.posed_actions import SelectPosed, SetPosed
from commission.app.editing.selection_panel import SelectionPanel
from commission.app.editing.tool_panel import SnappingPanel
from commission.app.floor_map.actions import SetPlantPoint
from commission.app.floor_map.align_tool import AlignTool, NamedPoint
from commission.app.floor_map.draft import MapDraft, MapFile, MapLoading, MapOptions, Stage
from commission.app.floor_map.floor_map_panel import FloorMapPanel
from commission.app.floor_map.pen import MapPen
from commission.app.floor_map.tool_fields import MapToolFields
from commission.app.floor_map.tools import WallTool
from commission.app.live.actions import SetClock
from commission.app.run.actions import ChooseSource, SetDisturbance, VirtualDrive
from commission.app.tune.actions import SetParameter, SetUncertainty
from commission.errors import CommissionError
from commission.io.dxf import Drawing
from commission.io.image_map import Picture
from commission.site.fields import fields_of, names_of
from commission.site.layout_brief import CandidateOptions, Demands
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag, TagCamera
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle, Vehicle
from tests.app.asking import ME, after, joined, taking
from tests.app.test_shown_inputs import PageBench, another, is_number

DEGREES = 180.0 / math.pi
MM = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One number: what stands beside it, what it means, and what it may be, in the page's unit."""

    label: str
    read: Callable[[AppState], float]
    factor: float = 1.0
    allowed: tuple[float, ...]
    """The outermost numbers that are taken."""
    refused: tuple[float, ...] = ()
    """Numbers just beyond."""


def scanner(name: str, index: int | None = None) -> Callable[[AppState], float]:
    def read(state: AppState) -> float:
        value = getattr(state.project.scanners[0], name)
        return value if index is None else value[index]

    return read


def vehicle(name: str) -> Callable[[AppState], float]:
    return lambda state: getattr(state.project.vehicle, name)


SCANNER = {
    "mounting[0]": Row(label="Mounted at x [m]", read=scanner("mounting", 0), allowed=(-1.5, 0.25), refused=(2e9,)),
    "mounting[1]": Row(label="Mounted at y [m]", read=scanner("mounting", 1), allowed=(-1.5, 0.25), refused=(2e9,)),
    "mounting[2]": Row(label="Faces [°]", read=scanner("mounting", 2), factor=DEGREES, allowed=(-179.5, 90.25)),
    # The other end is at 165, or -170: a full turn is the most.
    "field_of_view_deg[0]": Row(
        label="First bearing [°]",
        read=scanner("field_of_view_deg", 0),
        allowed=(-195.0, 164.0),
        refused=(-195.1, 165.0),
    ),
    "field_of_view_deg[1]": Row(
        label="Last bearing [°]",
        read=scanner("field_of_view_deg", 1),
        allowed=(-169.0, 190.0),
        refused=(-170.0, 190.1),
    ),
    "resolution_deg": Row(
        label="Resolution [°]", read=scanner("resolution_deg"), allowed=(0.01, 10.0), refused=(0.009, 10.1)
    ),
    "rate": Row(label="Scans per s", read=scanner("rate"), allowed=(0.1, 1000.0), refused=(0.09, 1000.5)),
    "range[0]": Row(label="Range from [m]", read=scanner("range", 0), allowed=(0.0, 1.5), refused=(-0.01, 10_000.0)),
    "range[1]": Row(label="Range to [m]", read=scanner("range", 1), allowed=(1.5, 10_000.0), refused=(0.0, 10_000.5)),
    "range_sigma": Row(
        label="Range 1σ [mm]", read=scanner("range_sigma"), factor=MM, allowed=(0.0, 12.5), refused=(-0.1,)
    ),
    "bearing_sigma_deg": Row(
        label="Bearing 1σ [°]", read=scanner("bearing_sigma_deg"), allowed=(0.0, 0.25), refused=(-0.001,)
    ),
    "beam_width_deg": Row(label="Beam width [°]", read=scanner("beam_width_deg"), allowed=(0.0, 0.5), refused=(-0.01,)),
    "beam_aperture": Row(
        label="Beam aperture [mm]",
        read=scanner("beam_aperture"),
        factor=MM,
        allowed=(0.0, 1000.0),
        refused=(-0.1, 1000.1),
    ),
    "reflector_range": Row(
        label="Reflectors to [m]", read=scanner("reflector_range"), allowed=(0.1, 35.0), refused=(0.0,)
    ),
    "sweep_duration": Row(
        label="Sweep takes [s]", read=scanner("sweep_duration"), allowed=(0.0, 0.01), refused=(-0.001,)
    ),
    "clock_offset": Row(
        label="Clock offset [s]", read=scanner("clock_offset"), allowed=(-10.0, 10.0), refused=(-10.1, 10.1)
    ),
}


def camera(name: str, index: int | None = None) -> Callable[[AppState], float]:
    def read(state: AppState) -> float:
        value = getattr(state.project.tag_camera, name)
        return value if index is None else value[index]

    return read


CAMERA = {
    "mounting[0]": Row(label="Camera at x [m]", read=camera("mounting", 0), allowed=(-100, 100), refused=(100.1,)),
    "mounting[1]": Row(label="Camera at y [m]", read=camera("mounting", 1), allowed=(-100, 100), refused=(-100.1,)),
    "mounting[2]": Row(label="Camera faces [°]", read=camera("mounting", 2), factor=DEGREES, allowed=(-179.5, 90.25)),
    "field_of_view_deg": Row(
        label="Camera sees [°]", read=camera("field_of_view_deg"), allowed=(1.0, 360.0), refused=(0.9, 360.1)
    ),
    "range[0]": Row(label="Tags seen from [m]", read=camera("range", 0), allowed=(0.0, 1.5), refused=(-0.01, 5.0)),
    "range[1]": Row(label="Tags seen to [m]", read=camera("range", 1), allowed=(0.15, 35.0), refused=(0.0, 0.1)),
    "rate": Row(label="Frames per s", read=camera("rate"), allowed=(0.1, 1000.0), refused=(0.09, 1000.5)),
    "position_sigma": Row(
        label="Seen place 1σ [mm]", read=camera("position_sigma"), factor=MM, allowed=(0.0, 12.5), refused=(-0.1,)
    ),
    "heading_sigma": Row(
        label="Seen heading 1σ [°]",
        read=camera("heading_sigma"),
        factor=DEGREES,
        allowed=(0.0, 1.25),
        refused=(-0.1,),
    ),
}
VEHICLES: dict[str, tuple[Vehicle, Row]] = {
    "vehicle.wheel_separation": (
        DifferentialVehicle(),
        Row(label="Wheel separation [m]", read=vehicle("wheel_separation"), allowed=(0.001, 1.25), refused=(0.0,)),
    ),
    "vehicle.wheelbase": (
        TricycleVehicle(),
        Row(label="Wheelbase [m]", read=vehicle("wheelbase"), allowed=(-1.25, 0.5), refused=(0.0,)),
    ),
    "vehicle.max_steering_deg": (
        TricycleVehicle(),
        Row(label="Steering to [°]", read=vehicle("max_steering_deg"), allowed=(1.0, 90.0), refused=(0.9, 90.1)),
    ),
    "vehicle.wheel_radius": (
        OmnidirectionalVehicle(),
        Row(label="Wheel radius [m]", read=vehicle("wheel_radius"), allowed=(0.001, 0.25), refused=(0.0,)),
    ),
    "vehicle.center_distance": (
        OmnidirectionalVehicle(),
        Row(label="Wheel distance [m]", read=vehicle("center_distance"), allowed=(0.001, 0.75), refused=(0.0,)),
    ),
    "vehicle.height": (
        OmnidirectionalVehicle(),
        Row(label="Height [m]", read=vehicle("height"), allowed=(0.25, 2.5), refused=(2e9,)),
    ),
}
UNSEEN: frozenset[str] = frozenset({"name"})
"""Numbers of a scanner that stand in the project's file alone."""
ROWS: dict[str, Row] = {f"scanners[0].{name}": row for name, row in SCANNER.items() if name not in UNSEEN}
ROWS |= {f"tag_camera.{name}": row for name, row in CAMERA.items()}
ROWS |= {
    "given_heading": Row(
        label="Given [°]",
        read=lambda s: s.part(CoverageSettings).given_heading,
        factor=DEGREES,
        allowed=(-360.0, 360.0),
        refused=(-360.5, 360.5),
    ),
    "on_odometry": Row(
        label="Odometry [m]",
        read=lambda s: s.part(CoverageSettings).on_odometry,
        allowed=(0.1, 100.0),
        refused=(0.05, 100.1),
    ),
    "blocked_per_m": Row(
        label="People [%/m]",
        read=lambda s: s.part(Conditions).blocked_per_m,
        factor=100.0,
        allowed=(0.0, 50.0),
        refused=(-0.1, 50.1),
    ),
    "min_beams": Row(
        label="Beams at least", read=lambda s: s.part(Conditions).min_beams, allowed=(1, 20), refused=(0, 21)
    ),
    "opacity": Row(
        label="Opacity [%]",
        read=lambda s: s.part(FloorPicture).opacity,
        factor=100.0,
        allowed=(10.0, 100.0),
        refused=(5.0, 105.0),
    ),
    "tolerance": Row(
        label="Tolerance [mm]",
        read=lambda s: s.part(AmbiguitySettings).tolerance,
        factor=MM,
        allowed=(5.0, 2000.0),
        refused=(4.5, 2000.5),
    ),
    "demands.visible": Row(
        label="Visible, at least",
        read=lambda s: s.project.layout.demands.visible,
        allowed=(1, 20),
        refused=(0, 21),
    ),
    # The supervisor's until another is typed, which is what the widget's start is held against.
    "demands.position_limit": Row(
        label="2σ x, y [mm]",
        read=lambda s: s.project.layout.demands.position_limit or s.project.parameters.supervisor.position_limit,
        factor=MM,
        allowed=(1.0, 10_000.0),
        refused=(0.5, 10_000.5),
    ),
    "demands.heading_limit": Row(
        label="2σ heading [°]",
        read=lambda s: s.project.layout.demands.heading_limit or s.project.parameters.supervisor.heading_limit,
        factor=DEGREES,
        allowed=(0.01, 90.0),
        refused=(0.005, 90.5),
    ),
    "demands.leeway": Row(
        label="Leeway [%]",
        read=lambda s: s.project.layout.demands.leeway,
        factor=100.0,
        allowed=(0.0, 100.0),
        refused=(-0.5, 100.5),
    ),
    "demands.spacing": Row(
        label="Apart [m]", read=lambda s: s.project.layout.demands.spacing, allowed=(0.0, 100.0), refused=(-0.05, 100.1)
    ),
    "demands.pairs_differ": Row(
        label="Pairs differ by [m]",
        read=lambda s: s.project.layout.demands.pairs_differ,
        allowed=(0.0, 10.0),
        refused=(-0.05, 10.1),
    ),
    "demands.wall_reach": Row(
        label="Spread: within [m]",
        read=lambda s: s.project.layout.demands.wall_reach,
        allowed=(0.0, 1000.0),
        refused=(-0.5, 1000.5),
    ),
    "candidates.spacing": Row(
        label="Try every [m]",
        read=lambda s: s.project.layout.candidates.spacing,
        allowed=(0.1, 20.0),
        refused=(0.05, 20.1),
    ),
    "candidates.radius": Row(
        label="Radius [mm]",
        read=lambda s: s.project.layout.candidates.radius,
        factor=MM,
        allowed=(5.0, 500.0),
        refused=(4.5, 500.5),
    ),
    "candidates.height": Row(
        label="Height [m]",
        read=lambda s: s.project.layout.candidates.height,
        allowed=(0.0, 10.0),
        refused=(-0.01, 10.1),
    ),
    "candidates.clearance": Row(
        label="Clear of routes [m]",
        read=lambda s: s.project.layout.candidates.clearance,
        allowed=(0.0, 10.0),
        refused=(-0.05, 10.1),
    ),
}
ELSEWHERE = {
    # One of a few factors, in a list.
    "ellipse_factor",
    # Lists, typed as a line of text, drawn on the floor, or in the project's file alone.
    *("vehicle.outline", "vehicle.wheel_angles_deg"),
    *("scanners[0].blind_sectors_deg", "scanners[0].detection_rates", "scanners[0].sweep_direction"),
    # May be that of the filter, so that they are typed as a text.
    *("scanners[0].detection_range_sigma", "scanners[0].detection_bearing_sigma_deg"),
    *("demands.unambiguous_spots", "candidates.keep_out", "candidates.gap", "candidates.length"),
}
"""Numbers of the same values whose widget is no number."""


@pytest.fixture
def bench(project: Project) -> Iterator[PageBench]:
    server = start_server("127.0.0.1", 0)
    seen = replace(project.scanners[0], field_of_view_deg=(-170.0, 165.0))
    yield PageBench(server, replace(project, scanners=(seen,)))
    server.stop()


def name_of(action: Action) -> str:
    """Which number an action sets."""
    return (
        getattr(action, "name", "") or getattr(action, "field", "") or type(action).__name__.removeprefix("Set").lower()
    )


def named_widgets(bench: PageBench) -> Iterator[tuple[Action, Any]]:
    """What each number posts, with its widget; without parameters, the virtual world and clocks by hand."""
    for widget in bench.widgets:
        if is_number(widget) and widget._impl.update_cb:
            (posted,) = bench.change(widget, another(widget))
            if not isinstance(posted, SetParameter | SetUncertainty | SetDisturbance | SetClock | Report):
                yield posted, widget


def holds(bench: PageBench, widget: Any, row: Row, state: AppState) -> None:
    """What a row says of its widget."""
    assert widget.label == row.label
    assert widget.value == pytest.approx(row.factor * float(row.read(state)), rel=5.1e-6)
    for number in row.allowed:
        assert problem_with(widget, type(widget.value)(number)) is None, number
        (posted,) = bench.change(widget, number)
        changed = after(state, posted).state
        assert float(row.read(changed)) == pytest.approx(number / row.factor, rel=1e-9, abs=1e-12)
        bench.draw(changed)
        assert widget.value == pytest.approx(number, rel=2e-6)
        bench.draw(state)
    for number in row.refused:
        if problem_with(widget, type(widget.value)(number)) is not None:
            continue
        (posted,) = bench.change(widget, number)
        if not isinstance(posted, Report):
            with pytest.raises((ValueError, CommissionError)):
                after(state, posted)


@pytest.mark.parametrize("name", ROWS)
def test_a_number_is_shown_taken_and_bounded_as_its_row_says(bench: PageBench, name: str) -> None:
    (widget,) = [widget for posted, widget in named_widgets(bench) if name_of(posted) == name]
    holds(bench, widget, ROWS[name], bench.state)


@pytest.mark.parametrize("name", VEHICLES)
def test_a_number_of_a_vehicle_is_shown_taken_and_bounded_as_its_row_says(bench: PageBench, name: str) -> None:
    vehicle, row = VEHICLES[name]
    state = replace(bench.state, project=replace(bench.state.project, vehicle=vehicle))
    bench.draw(state)
    (widget,) = [widget for posted, widget in named_widgets(bench) if widget.visible and name_of(posted) == name]
    holds(bench, widget, row, state)


@pytest.mark.parametrize(
    ("label", "field", "factor"),
    [
        ("Detection 1σ [mm]", "detection_range_sigma", MM),
        ("Detection 1σ [°]", "detection_bearing_sigma_deg", 1.0),
    ],
)
def test_noise_of_detections_is_typed_in_its_unit_or_that_of_the_filter(
    bench: PageBench, label: str, field: str, factor: float
) -> None:
    (widget,) = [each for each in bench.widgets if getattr(each, "label", "") == label]
    assert widget.value == "as the filter"
    read = scanner(field)
    for text, number in (("0.25", 0.25), (" 35,5 ", 35.5)):
        (posted,) = bench.change(widget, text)
        changed = after(bench.state, posted).state
        assert read(changed) == pytest.approx(number / factor)
        bench.draw(changed)
        assert widget.value == f"{number:g}"
        for none in ("", "as the filter"):
            (posted,) = bench.change(widget, none)
            assert read(after(changed, posted).state) is None
        bench.draw(bench.state)
    for text in ("0", "-1", "wide", "nan"):
        (posted,) = bench.change(widget, text)
        if not isinstance(posted, Report):
            with pytest.raises((ValueError, CommissionError)):
                after(bench.state, posted)


def test_the_way_of_a_sweep_is_chosen_by_its_name(bench: PageBench) -> None:
    (widget,) = [widget for widget in bench.widgets if getattr(widget, "label", "") == "Sweep direction"]
    assert widget.value == "counter-clockwise"
    (posted,) = bench.change(widget, "clockwise")
    changed = after(bench.state, posted).state
    assert changed.project.scanners[0].sweep_direction == -1
    bench.draw(changed)
    assert widget.value == "clockwise"


def numbers(cls: type, prefix: str = "") -> set[str]:
    """All numbers that are described in a value."""
    infos = fields_of(cls)
    return {prefix + name for name in names_of(cls) if infos[name.partition("[")[0]].quantity is not None}


def test_no_field_is_without_its_widget_and_no_widget_without_a_field(bench: PageBench) -> None:
    shown = [name_of(posted) for posted, _ in named_widgets(bench)]
    assert sorted(shown) == sorted([*ROWS, *VEHICLES])
    described = numbers(Scanner, "scanners[0].") | numbers(TagCamera, "tag_camera.")
    described |= numbers(Demands, "demands.") | numbers(CandidateOptions, "candidates.")
    for kind in (DifferentialVehicle, TricycleVehicle, OmnidirectionalVehicle):
        described |= numbers(kind, "vehicle.")
    for kind in (CoverageSettings, Conditions, FloorPicture, AmbiguitySettings):
        described |= numbers(kind)
    seen = {name for name in described if name.removeprefix("scanners[0].") not in UNSEEN}
    assert seen == set(ROWS) | set(VEHICLES) | {name for name in ELSEWHERE if name in seen}
    assert described >= ELSEWHERE


POST = Reflector(id="P", x=1.25, y=2.5, radius=0.0415, height=1.8, sigma=0.0035)
MARK = Tag(id="M", x=1.75, y=4.5, heading=0.6, sigma=0.0025, heading_sigma=0.0035)
DOCK = Station(name="Dock", x=3.25, y=5.5, heading=-0.7, required_accuracy=0.043)
WHITE = np.full((40, 60), 255, np.uint8)
DRAWN = Path("a.dxf")


def reflector(name: str) -> Callable[[AppState], float]:
    return lambda state: getattr(state.project.reflectors.reflectors[0], name)


def station(name: str) -> Callable[[AppState], float]:
    return lambda state: getattr(state.project.stations[0], name)


def mark(name: str) -> Callable[[AppState], float]:
    return lambda state: getattr(state.project.tags[0], name)


def option(name: str) -> Callable[[AppState], float]:
    def read(state: AppState) -> float:
        draft = state.part(MapLoading).draft
        assert draft is not None
        return getattr(draft.options, name)

    return read


def coordinate(axis: int) -> Callable[[AppState], float]:
    return lambda state: state.project.routes[0].segments[0].control_points[1][axis]


@dataclass(frozen=True, slots=True, kw_only=True)
class Own:
    """A panel that each browser has for itself, and when its numbers are seen."""

    make: Callable[[Any, Post], Panel]
    asked: tuple[Action, ...] = ()
    draft: MapDraft | None = None
    rows: Mapping[str, Row]


def selection(gui: Any, post: Post) -> Panel:
    return SelectionPanel(gui, post, ME)


FAR = {"allowed": (-1e7, 1e7), "refused": (-1.1e7, 1.1e7)}
OWN = {
    "reflector": Own(
        make=selection,
        asked=(SelectReflectors(("P",)),),
        rows={
            "x": Row(label="x [m]", read=reflector("x"), **FAR),
            "y": Row(label="y [m]", read=reflector("y"), **FAR),
            "height": Row(label="Height [m]", read=reflector("height"), allowed=(0.0, 2.5), refused=(2e9,)),
            "sigma": Row(
                label="Survey 1σ [mm]", read=reflector("sigma"), factor=MM, allowed=(0.0, 5.5), refused=(-0.1,)
            ),
        },
    ),
    "station": Own(
        make=selection,
        asked=(SelectPosed(PosedKey(PosedKind.STATION, "Dock")),),
        rows={
            "x": Row(label="x [m]", read=station("x"), **FAR),
            "y": Row(label="y [m]", read=station("y"), **FAR),
            "heading": Row(label="Heading [°]", read=station("heading"), factor=DEGREES, allowed=(-179.5, 90.25)),
            "required_accuracy": Row(
                label="Within [mm]",
                read=station("required_accuracy"),
                factor=MM,
                allowed=(1.0, 10_000.0),
                refused=(0.9, 10_000.1),
            ),
        },
    ),
    "tag": Own(
        make=selection,
        asked=(SelectPosed(PosedKey(PosedKind.TAG, "M")),),
        rows={
            "x": Row(label="x [m]", read=mark("x"), **FAR),
            "y": Row(label="y [m]", read=mark("y"), **FAR),
            "heading": Row(label="Tag heading [°]", read=mark("heading"), factor=DEGREES, allowed=(-179.5, 90.25)),
            "sigma": Row(label="Placed 1σ [mm]", read=mark("sigma"), factor=MM, allowed=(0.0, 5.5), refused=(-0.1,)),
            "heading_sigma": Row(
                label="Facing 1σ [°]",
                read=mark("heading_sigma"),
                factor=DEGREES,
                allowed=(0.0, 1.25),
                refused=(-0.1,),
            ),
        },
    ),
    "route": Own(
        make=selection,
        asked=(SelectControlPoint(ControlPoint("There and back", 0, 1)),),
        rows={
            "place[0]": Row(label="x [m]", read=coordinate(0), allowed=(-250.0, 250.0), refused=(-1.1e7, 1.1e7)),
            "place[1]": Row(label="y [m]", read=coordinate(1), allowed=(-250.0, 250.0), refused=(-1.1e7, 1.1e7)),
            "speed": Row(
                label="Speed [m/s]",
                read=lambda s: s.project.routes[0].speed_of(s.project.routes[0].segments[0]),
                allowed=(0.001, 100.0),
                refused=(0.0005, 100.1),
            ),
        },
    ),
    "snapping": Own(
        make=lambda gui, post: SnappingPanel(gui, post, ME),
        rows={
            "grid": Row(
                label="Grid [m]",
                read=lambda s: editor_of(s, ME).snapping.grid,
                allowed=(0.0, 100.0),
                refused=(-0.01, 100.1),
            )
        },
    ),
    "pen": Own(
        make=lambda gui, post: MapToolFields(gui, post, ME),
        asked=(ChooseTool(WallTool()),),
        rows={
            "thickness": Row(
                label="Thickness [mm]",
                read=lambda s: s.of_browser(ME, MapPen).thickness,
                factor=MM,
                allowed=(1.0, 10_000.0),
                refused=(0.5, 10_001.0),
            )
        },
    ),
    "drawing": Own(
        make=FloorMapPanel,
        draft=MapDraft(
            file=MapFile(DRAWN),
            read=Drawing(
                path=DRAWN,
                unit="mm",
                layers=(),
                segments=np.zeros((1, 2, 2)),
                layer_of=np.zeros(1, np.int32),
                warnings=(),
            ),
        ),
        rows={
            "resolution": Row(
                label="Cell [mm]", read=option("resolution"), factor=MM, allowed=(1.0, 1000.0), refused=(0.5, 1001.0)
            )
        },
    ),
    "picture": Own(
        make=FloorMapPanel,
        draft=MapDraft(
            file=MapFile(DRAWN),
            read=Picture(WHITE, WHITE),
            stage=Stage(0.1, 0.0, 4.0),
            options=MapOptions(direction=0.5),
        ),
        rows={
            "distance": Row(label="A to B [m]", read=option("distance"), allowed=(0.001, 250.0), refused=(0.0,)),
            "direction": Row(
                label="Heading [°]", read=option("direction"), factor=DEGREES, allowed=(-179.5, 45.25), refused=()
            ),
            "threshold": Row(
                label="Walls from [%]",
                read=option("threshold"),
                factor=100.0,
                allowed=(0.0, 100.0),
                refused=(-1.0, 101.0),
            ),
        },
    ),
}


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_server("127.0.0.1", 0)
    yield started
    started.stop()


class PanelBench(PageBench):
    """One panel of one browser, as `PageBench` is all those of everybody."""

    def __init__(self, server: viser.ViserServer, project: Project, own: Own) -> None:
        self.server, self.posted = server, []
        before = joined(AppState(project=project, saved=project))
        self.panel = own.make(server.gui, taking(self.posted))
        self.draw(before)
        asked = after(before, *own.asked).state
        self.state = asked if own.draft is None else asked.with_part(MapLoading(draft=own.draft))
        self.draw(self.state)

    def draw(self, state: AppState) -> None:
        """Draw a state."""
        self.panel.draw_slowly(view_of(state))


@pytest.mark.parametrize(("what", "name"), [(what, name) for what, own in OWN.items() for name in own.rows])
def test_a_number_of_ones_own_is_shown_taken_and_bounded_as_its_row_says(
    server: viser.ViserServer, project: Project, what: str, name: str
) -> None:
    own = OWN[what]
    make = partial(FloorMapPanel, project=project) if own.make is FloorMapPanel else own.make
    site = replace(project, reflectors=ReflectorMap((POST,)), stations=(DOCK,), tags=(MARK,))
    bench = PanelBench(server, site, replace(own, make=make))
    found = [(name_of(posted), widget) for posted, widget in named_widgets(bench) if widget.visible]
    is_of_selection = what in ("reflector", "station", "tag", "route")
    inside = {"reflector": SetSelected, "station": SetPosed, "tag": SetPosed, "route": SetCoordinate | SetSegment}

    def is_inside(posted: Action) -> bool:
        return isinstance(posted, inside[what]) and getattr(posted, "kind", what) == what

    widgets = {
        found_name: widget
        for found_name, widget in found
        if not is_of_selection or is_inside(bench.change(widget, another(widget))[0])
    }
    # No field without its widget, and no widget without a field.
    assert set(widgets) == set(own.rows)
    holds(bench, widgets[name], own.rows[name], bench.state)


def test_a_radius_is_typed_in_its_unit_within_its_bounds_or_unknown(
    server: viser.ViserServer, project: Project
) -> None:
    bench = PanelBench(server, replace(project, reflectors=ReflectorMap((POST,))), OWN["reflector"])
    (widget,) = [each for each in bench.widgets if getattr(each, "label", "") == "Radius [mm]"]
    assert widget.value == "41.5"
    for text, radius in (("0.1", 0.0001), ("1000", 1.0), (" 35.5 ", 0.0355), ("unknown", None), ("", None)):
        (posted,) = bench.change(widget, text)
        assert after(bench.state, posted).state.project.reflectors.reflectors[0].radius == (
            radius and pytest.approx(radius)
        )
    for text in ("0", "1000.1", "wide", "nan"):
        (posted,) = bench.change(widget, text)
        if not isinstance(posted, Report):
            with pytest.raises((ValueError, CommissionError)):
                after(bench.state, posted)


def typed(bench: PageBench, values: Mapping[str, Any]) -> None:
    """Type into widgets that post nothing."""
    for label, value in values.items():
        (widget,) = [each for each in bench.widgets if getattr(each, "label", "") == label and not each._impl.update_cb]
        assert problem_with(widget, value) is None
        widget._impl.value = value


def refused(bench: PageBench, values: Mapping[str, Any]) -> None:
    """None of these can be typed."""
    for label, value in values.items():
        (widget,) = [each for each in bench.widgets if getattr(each, "label", "") == label and not each._impl.update_cb]
        assert problem_with(widget, value) is not None, label


def pressed(bench: PageBench, label: str) -> Action:
    """What a button posts."""
    (button,) = [each for each in bench.widgets if getattr(each, "label", "") == label]
    (posted,) = bench.change(button, True)
    return posted


def test_seed_and_people_of_a_drive_are_those_that_were_typed(bench: PageBench) -> None:
    typed(bench, {"Seed": 2**53, "People": 500})
    assert pressed(bench, "Drive") == ChooseSource(VirtualDrive("There and back", 2**53, 500))
    typed(bench, {"Seed": 0, "People": 0})
    assert pressed(bench, "Drive") == ChooseSource(VirtualDrive("There and back", 0, 0))
    refused(bench, {"Seed": -1, "People": -1})
    refused(bench, {"People": 501})
    typed(bench, {"Seed": 2**53 + 2})
    assert isinstance(pressed(bench, "Drive"), Report)


def test_copies_and_a_mirror_are_made_as_was_typed(server: viser.ViserServer, project: Project) -> None:
    bench = PanelBench(server, replace(project, reflectors=ReflectorMap((POST,))), OWN["reflector"])
    typed(bench, {"Step x [m]": 1.5, "Step y [m]": -0.25, "Copies": 4})
    assert pressed(bench, "Repeat") == RepeatSelected((1.5, -0.25), 4)
    refused(bench, {"Step x [m]": 1.1e7, "Copies": 0})
    refused(bench, {"Copies": 1001})
    typed(bench, {"Line at [m]": -3.5})
    (mirror,) = [each for each in bench.widgets if "Mirrored copy" in (getattr(each, "options", None) or ())]
    (posted,) = bench.change(mirror, "Mirrored copy")
    assert posted == MirrorSelected((-3.5, 0.0), math.pi / 2, copy=True)


def test_a_place_is_shown_and_taken_with_both_its_numbers_in_metres(
    server: viser.ViserServer, project: Project
) -> None:
    own = replace(OWN["picture"], make=partial(FloorMapPanel, project=project))
    bench = PanelBench(server, project, own)
    (place,) = [each for each in bench.widgets if getattr(each, "label", "") == "A is at [m]"]
    (posted,) = bench.change(place, (1.5, -2.25))
    changed = after(bench.state, posted).state
    assert changed.part(MapLoading).draft.options.first_in_map == (1.5, -2.25)
    bench.draw(changed)
    assert place.value == (1.5, -2.25)
    (posted,) = bench.change(place, (1.1e7, 0.0))
    assert isinstance(posted, Report)
    tool = AlignTool(known=(NamedPoint((1.0, 2.0), (101.5, 202.5), "B4"), NamedPoint((4.0, 2.0), (104.5, 202.5))))
    other = start_server("127.0.0.1", 0)
    try:
        bench = PanelBench(other, project, replace(OWN["pen"], asked=(ChooseTool(tool),)))
        (plant,) = [each for each in bench.widgets if getattr(each, "label", "") == "A x, y [m]"]
        assert plant.value == (101.5, 202.5)
        (posted,) = bench.change(plant, (-7.25, 8.5))
        assert posted == SetPlantPoint(0, (-7.25, 8.5), "B4")
    finally:
        other.stop()
