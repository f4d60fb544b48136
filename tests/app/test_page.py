"""Handlers of the page on a real server, without a browser: what a person's click posts, and what is drawn."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser

from commission.app.base.actions import Action, Sender, Undo
from commission.app.base.field_widget import held, meant
from commission.app.base.jobs import Job
from commission.app.base.panel import clock, escaped, posting
from commission.app.base.reducer import reduce
from commission.app.base.server import start_server
from commission.app.base.state import AppState, LastEdit
from commission.app.base.view import view_of
from commission.app.editing.scanner_fields import source_html
from commission.app.editing.tool_panel import ToolButtons
from commission.app.floor_map.tool_fields import MapToolButtons
from commission.app.page import Page
from commission.app.project.site_panel import rows as site_rows
from commission.app.project.top_bar import title
from commission.app.run.actions import Seek
from commission.app.run.association_panel import AssociationPanel
from commission.app.run.badge import badge_text
from commission.app.run.now_panel import rows
from commission.app.run.playback import Playback
from commission.app.run.run_panel import NO_ROUTE, RunPanel
from commission.app.run.vehicle_layer import VehicleLayer
from commission.app.run.view import RunView
from commission.app.tune.tune_panel import TunePanel
from commission.localization.estimate import Mode, Status
from commission.site.fields import FieldInfo, field_info, fields_of, get_field, walk_fields, with_field
from commission.site.parameters import Parameters
from commission.site.presets import SCANNERS, ScannerPreset
from commission.site.project import Project
from commission.site.uncertainty import Uncertainty
from commission.studies.run import RunResult
from tests.app.asking import FEATURES, taking

NASTY = "<script>alert('hall')</script>"


@pytest.fixture
def server():
    server = start_server("127.0.0.1", 0)
    yield server
    server.stop()


@pytest.fixture
def run(result: RunResult) -> RunView:
    """The run three seconds after its start."""
    playback = Playback(result)
    playback.seek(3.0)
    return playback.view(covered=False)


def change(widget: Any, value: Any, client: object | None) -> None:
    """Let a widget say that it was changed, as viser does when a browser (or the server itself) changes it."""
    widget._impl.value = value
    for callback in widget._impl.update_cb:
        callback(SimpleNamespace(client=client, client_id=None, target=widget))


def test_no_key_stands_for_two_commands(
    server: viser.ViserServer, project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys: dict[tuple[object, object], list[str]] = {}
    add_command = viser.GuiApi.add_command

    def noted(gui: viser.GuiApi, label: str, **options: Any) -> viser.CommandHandle:
        if options.get("hotkey") is not None:
            keys.setdefault((options["hotkey"], options.get("modifier")), []).append(label)
        return add_command(gui, label, **options)

    monkeypatch.setattr(viser.GuiApi, "add_command", noted)
    state = AppState(project=project, saved=project)
    Page(server, lambda _action: None, state, FEATURES)
    # What each browser has of its own.
    ToolButtons(server.gui, lambda _action: None, 1)
    MapToolButtons(server.gui, lambda _action: None, 1)
    AssociationPanel(server.gui, lambda _action: None, 1)
    assert len(keys) > 18
    assert {key: labels for key, labels in keys.items() if len(labels) > 1} == {}


def test_the_whole_page_is_built_and_draws_a_run(server: viser.ViserServer, project: Project, run: RunView) -> None:
    state = AppState(project=project, saved=project)
    page = Page(server, lambda _action: None, state, FEATURES)
    page.show_site(state)
    page.draw(view_of(state, run), slowly=True)
    hidden = replace(state, hidden=frozenset({"Scan"}))
    page.draw(view_of(hidden, run), slowly=True)


def test_the_page_stands_before_any_run_exists(server: viser.ViserServer) -> None:
    state = AppState(project=Project(), saved=Project())
    page = Page(server, lambda _action: None, state, FEATURES)
    page.show_site(state)
    page.draw(view_of(state), slowly=True)


def test_a_person_posts_and_the_server_itself_does_not() -> None:
    posted: list[Action] = []
    callback: Any = posting(taking(posted), lambda event: Seek(event.target.value))
    widget = SimpleNamespace(uuid="seek")
    callback(SimpleNamespace(client=None, target=SimpleNamespace(value=1.0, _impl=widget)))
    assert posted == []
    callback(SimpleNamespace(client=SimpleNamespace(client_id=1), target=SimpleNamespace(value=2.0, _impl=widget)))
    assert posted == [Seek(2.0)]


def hinted(info: FieldInfo, key: str) -> str:
    """What is said of the field, what may be entered, and its name in files."""
    bounds = "" if info.quantity is None else info.quantity.bounds.words(info.quantity.shown_unit, info.quantity.scale)
    bounds = "" if bounds == "a finite number" else bounds
    if info.quantity is not None and info.quantity.slider is not None:
        low, high = info.quantity.slider
        unit = info.quantity.shown_unit
        bounds = f"{low:g} to {high:g}{'' if unit == '°' else ' '}{unit}".strip()
    hint = info.hint
    for option in info.options:
        hint = hint.replace(f"`{option}`", option.replace("_", " "))
    return f"{hint} {bounds[:1].upper()}{bounds[1:]}. ({key})" if bounds else f"{hint} ({key})"


def test_every_parameter_has_exactly_one_widget_with_its_label_its_unit_and_its_hint(
    server: viser.ViserServer, project: Project
) -> None:
    added: list[Any] = []
    for name in ("add_slider", "add_checkbox", "add_dropdown", "add_number", "add_text"):
        real = getattr(server.gui, name)
        setattr(server.gui, name, lambda *args, real=real, **keys: added.append(real(*args, **keys)) or added[-1])
    panel = TunePanel(server.gui, lambda _action: None, AppState(project=project, saved=project))
    described = dict(walk_fields(Parameters))
    assert sorted(panel._widgets) == sorted(described)
    parameters = {id(widget) for widget in panel._widgets.values()}
    constants = [widget for widget in added if id(widget) not in parameters]
    assert len(added) == len(parameters) + len(constants)
    for widget, (name, info) in zip(constants, fields_of(Uncertainty).items(), strict=True):
        assert widget.hint == hinted(info, f"uncertainty.{name}")
        assert info.quantity is not None
        assert widget.label == info.quantity.title
    for key, info in described.items():
        widget = panel._widgets[key]
        assert widget.hint == hinted(info, key)
        assert widget.label == (info.quantity.title if info.quantity else info.label)


def test_every_constant_is_posted_in_si_and_set_as_one_undo_step(server: viser.ViserServer, project: Project) -> None:
    posted: list[Any] = []
    state = AppState(project=project, saved=project)
    panel = TunePanel(server.gui, taking(posted), state)
    for (widget, _), name, shown, value in zip(
        panel._constants._widgets,
        ("survey", "mounting_position", "mounting_heading", "range_bias", "clock"),
        (4.0, 7.0, 0.5, 8.0, 12.0),
        (0.004, 0.007, math.radians(0.5), 0.008, 0.012),
        strict=True,
    ):
        change(widget, shown, client=SimpleNamespace(client_id=1))
        assert (posted[-1].name, posted[-1].value) == (name, pytest.approx(value, rel=1e-9))
        changed = reduce(posted[-1], state, Sender(1, 0.0)).state
        assert getattr(changed.project.uncertainty, name) == pytest.approx(value, rel=1e-9)
        assert reduce(Undo(), changed, Sender(1, 1.0)).state.project == project


def test_every_slider_posts_its_parameter_in_si(server: viser.ViserServer, project: Project) -> None:
    posted: list[Any] = []
    panel = TunePanel(server.gui, taking(posted), AppState(project=project, saved=project))
    for key, widget in panel._widgets.items():
        change(widget, widget.value, client=SimpleNamespace(client_id=1))
        assert posted[-1].key == key
        value = get_field(project.parameters, key)
        # The page shows six digits.
        assert posted[-1].value == (pytest.approx(value, rel=1e-5) if isinstance(value, float) else value)
        with_field(project.parameters, key, posted[-1].value)
    assert len(posted) == len(panel._widgets) == len(dict(walk_fields(Parameters)))


def test_sliders_follow_undo_but_not_their_own_drag(server: viser.ViserServer, project: Project) -> None:
    key = "supervisor.position_limit"
    panel = TunePanel(server.gui, lambda _action: None, AppState(project=project, saved=project))
    edited = replace(project, parameters=with_field(project.parameters, key, 0.2))
    change(panel._widgets[key], 200.0, client=SimpleNamespace(client_id=1))
    panel.draw_slowly(view_of(AppState(project=edited, saved=project, last_edit=LastEdit(key))))
    assert panel._widgets[key].value == 200.0
    panel.draw_slowly(view_of(AppState(project=project, saved=project)))
    assert panel._widgets[key].value == 100.0


@pytest.mark.parametrize("key", sorted(name for name, info in walk_fields(Parameters) if info.quantity))
def test_what_the_page_shows_means_the_same_parameter(project: Project, key: str) -> None:
    info, value = field_info(project.parameters, key), get_field(project.parameters, key)
    again = meant(info, held(info, value))
    assert type(again) is type(value)
    assert again == pytest.approx(value, rel=1e-5)


def test_names_from_files_are_never_read_as_html(project: Project) -> None:
    state = AppState(project=replace(project, name=NASTY), saved=project)
    assert "<script" not in title(state)
    assert "&lt;script" in title(state)
    assert "<script" not in escaped(NASTY)


def test_the_badge_says_operational_fail_or_that_nothing_runs(run: RunView, project: Project) -> None:
    state = AppState(project=project, saved=project)
    assert badge_text(view_of(state))[0] == "NO RUN"
    assert badge_text(view_of(state, run))[0] == "OPERATIONAL"
    word, beside, _ = badge_text(view_of(state, replace(run, mode=Mode.FAIL)))
    assert word.startswith("FAIL")
    assert "mm" in beside and "°" in beside


def test_what_is_being_prepared_is_said_where_the_badge_is(project: Project) -> None:
    view = view_of(
        AppState(project=project, saved=project),
        jobs=(Job(number=1, name="Compiling", fraction=0.4, message="<rays>"),),
    )
    assert badge_text(view)[:2] == ("PREPARING", "Compiling: &lt;rays&gt; 40%")


def test_every_number_of_the_newest_cycle_is_shown(run: RunView, project: Project) -> None:
    newest, result = run.newest, run.result
    assert (run.lived, result.times[newest]) == (31, pytest.approx(3.0))
    estimate = result.columns.estimate(newest)
    sigmas = 2.0 * np.sqrt(np.diag(estimate.posterior.covariance))
    largest = 2.0 * math.sqrt(np.linalg.svd(estimate.posterior.covariance[:2, :2])[1].max())
    # Ten scans of the last second, this one included.
    recent = [result.columns.estimate(cycle) for cycle in range(newest - 9, newest + 1)]
    x, y, heading = estimate.posterior.mean
    assert dict(rows(run)) == {
        "Mode": "operational",
        "Fail episodes so far": "0",
        "Position x, y": f"{x:.3f}, {y:.3f} m",
        "Heading": f"{math.degrees(heading):.2f}°",
        "2σ position / limit": f"{1000.0 * largest:.1f} / 100 mm",
        "2σ along x, along y": f"{1000.0 * sigmas[0]:.1f}, {1000.0 * sigmas[1]:.1f} mm",
        "2σ heading / limit": f"{math.degrees(sigmas[2]):.2f} / 3.0°",
        "Inliers": str(estimate.count(Status.INLIER)),
        "Outliers: beams, gate": "0, 0",
        "Largest NIS / gate": f"{estimate.d2.max():.2f} / 5.99",
        "NIS of all / expected, 1 s": f"{np.concatenate([each.d2 for each in recent]).mean():.2f} / 2",
        "Rejected, 1 s": "0.0 %",
        "Cycle time": f"{result.microseconds_per_cycle:.1f} µs, mean of the drive",
        "Position error": f"{1000.0 * math.hypot(*result.errors[newest, :2]):.1f} mm",
        "True wheels": "along 10.0 mm/√m, across 3.0 mm/√m, heading 0.34 °/√m, turning 0.57 °/√rad, "
        "along, in time 0.5 mm/√s, heading, in time 0.01 °/√s",
        "True scanner": "as the project says",
        "True reflectors": "where the map says",
    }


def test_times_are_shown_as_minutes_and_hours() -> None:
    assert clock(125.4) == "02:05"
    assert clock(3725.0) == "1:02:05"


def test_a_route_that_was_drawn_can_be_driven(server: viser.ViserServer, project: Project) -> None:
    bare = AppState(project=replace(project, routes=()), saved=project)
    panel = RunPanel(server.gui, lambda _action: None, bare)
    (offered,) = (w for w in server.gui._gui_input_handle_from_uuid.values() if getattr(w, "label", "") == "Route")
    assert (offered.options, offered.disabled) == (NO_ROUTE, True)
    panel.draw_slowly(view_of(AppState(project=project, saved=project)))
    assert (offered.options, offered.disabled) == (("There and back",), False)


def test_before_a_run_the_vehicle_waits_at_the_start_of_the_first_route_with_its_field_of_view(
    server: viser.ViserServer, project: Project
) -> None:
    layer = VehicleLayer(server.scene)
    half = replace(
        project, scanners=(replace(project.scanners[0], mounting=[0.4, 0.1, 0.0], field_of_view_deg=(-90.0, 90.0)),)
    )
    layer.show_site(half)
    assert layer._frame.visible
    assert tuple(layer._frame.position[:2]) == (2.0, 2.0)
    # The outer fan reaches as far as reflectors are told apart, from the scanner and not behind it.
    strokes = layer._far.points[:, :, :2] - np.array([0.4, 0.1])
    assert np.hypot(*strokes.reshape(-1, 2).T).max() == pytest.approx(project.scanners[0].reflector_range, rel=1e-6)
    assert strokes[..., 0].min() == pytest.approx(0.0, abs=1e-5)
    layer.show_site(replace(half, routes=()))
    assert not layer._frame.visible


def test_each_scanner_is_drawn_where_it_is_mounted_and_told_with_the_site(
    server: viser.ViserServer, project: Project
) -> None:
    front = replace(project.scanners[0], name="front left", mounting=[0.4, 0.1, 0.5], field_of_view_deg=(-90.0, 90.0))
    rear = replace(front, name="rear right", mounting=[-0.4, -0.1, -2.5], resolution_deg=1.0)
    layer = VehicleLayer(server.scene)
    layer.show_site(replace(project, scanners=(front, rear)))
    assert [tuple(frame.position[:2]) for frame in layer._scanners] == [(0.4, 0.1), (-0.4, -0.1)]
    assert all(frame in layer.nodes() for frame in layer._scanners)
    layer.show_site(replace(project, scanners=(rear,)))
    assert [tuple(frame.position[:2]) for frame in layer._scanners] == [(-0.4, -0.1)]
    told = dict(site_rows(replace(project, scanners=(front, rear))))
    assert told["Scanner front left"] == f"{front.beam_count} beams, -90 to 90°"
    assert told["Scanner rear right"] == "181 beams, -90 to 90°"
    assert "Scanner" in dict(site_rows(project))


@pytest.mark.parametrize("preset", SCANNERS, ids=lambda preset: preset.name)
def test_the_page_says_which_figures_of_a_preset_are_the_makers_and_which_are_ours(preset: ScannerPreset) -> None:
    text = source_html(preset)
    assert escaped(preset.source) in text
    ours = text.split("Ours, without a source; measure it: ")[1]
    assert "bearing 1σ" in ours
    assert "resolution" not in ours
    assert source_html(None) == ""
