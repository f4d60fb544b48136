"""What actions about stations mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

import math
from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import FlyTo
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import station_actions as actions
from commission.app.editing.editor import editor_of
from commission.app.editing.station_gestures import station_of
from commission.errors import UsageError
from commission.site.editing import stations as edits
from commission.site.editing.named import STATIONS
from commission.site.fields import with_field
from commission.site.stations import Station

WORDS = {"x": "place", "y": "place", "heading": "heading", "required_accuracy": "accuracy"}
"""What the fields of a station are called in an undo step."""


def _selected(state: AppState, sender: Sender) -> Station:
    """Return the station that a browser has selected; raises UsageError for none."""
    station = station_of(state.project, editor_of(state, sender.browser))
    if station is None:
        raise UsageError("no station is selected; expected one")
    return station


def _with_stations(state: AppState, stations: tuple[Station, ...], edit: Edit, selected: str) -> Outcome:
    """Return what follows from other stations: one undo step, and one of them is selected."""
    if stations == state.project.stations:
        return Outcome(state)
    after = edited(state, replace(state.project, stations=stations), edit)
    browser = edit.sender.browser
    return Outcome(after.with_browser(browser, editor_of(after, browser).selecting(station=selected)))


@reduce.register
def select_station(action: actions.SelectStation, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser).selecting(station=action.name)
    selecting, station = state.with_browser(sender.browser, editor), station_of(state.project, editor)
    if not action.fly or station is None:
        return Outcome(selecting)
    return Outcome(selecting, (FlyTo((station.x, station.y)),))


@reduce.register
def place_station(action: actions.PlaceStation, state: AppState, sender: Sender) -> Outcome:
    stations = state.project.stations
    name = STATIONS.fresh(stations)
    x, y = action.place
    placed = replace(stations[-1], name=name, x=x, y=y) if stations else Station(name=name, x=x, y=y)
    pose = edits.on_route(state.project.routes, action.place, action.reach)
    if pose is not None:
        x, y, heading = (float(value) for value in pose)
        placed = replace(placed, x=x, y=y, heading=heading)
    return _with_stations(state, STATIONS.put(stations, placed), Edit(f"place {name}", sender), name)


@reduce.register
def move_station(action: actions.MoveStation, state: AppState, sender: Sender) -> Outcome:
    station = _selected(state, sender)
    verb = "turn" if action.place == (station.x, station.y) else "move"
    moved = replace(station, x=action.place[0], y=action.place[1], heading=action.heading)
    stations = STATIONS.put(state.project.stations, moved, station.name)
    return _with_stations(state, stations, Edit(f"{verb} {station.name}", sender), station.name)


@reduce.register
def set_station(action: actions.SetStation, state: AppState, sender: Sender) -> Outcome:
    station = _selected(state, sender)
    changed = with_field(station, action.field, action.value, "field of a station")
    what = f"rename {station.name}" if action.field == "name" else f"set {WORDS[action.field]} of {station.name}"
    key = "" if action.field == "name" else f"{station.name}:{action.field}"
    stations = STATIONS.put(state.project.stations, changed, station.name)
    return _with_stations(state, stations, Edit(what, sender, key), changed.name)


@reduce.register
def align_station(_action: actions.AlignStation, state: AppState, sender: Sender) -> Outcome:
    station = _selected(state, sender)
    pose = edits.on_route(state.project.routes, (station.x, station.y), math.inf)
    if pose is None:
        raise UsageError("the project has no route to put the station on; expected one")
    stations = STATIONS.put(state.project.stations, edits.aligned(station, pose), station.name)
    return _with_stations(state, stations, Edit(f"align {station.name}", sender), station.name)


@reduce.register
def delete_station(_action: actions.DeleteStation, state: AppState, sender: Sender) -> Outcome:
    station = _selected(state, sender)
    stations = STATIONS.remove(state.project.stations, station.name)
    return _with_stations(state, stations, Edit(f"delete {station.name}", sender), "")
