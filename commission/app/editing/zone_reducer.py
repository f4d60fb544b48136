"""What actions about zones mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import dataclass, replace

from commission.app.base.actions import Sender
from commission.app.base.effects import FlyTo
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import zone_actions as actions
from commission.errors import UsageError
from commission.site.editing.named import ZONES
from commission.site.fields import in_file, with_field
from commission.site.layout_brief import low_high
from commission.site.quantity import counted_text
from commission.site.zones import ObservationKind, Zone

WORDS = {"outline": "corners"}
"""What the fields of a zone are called in an undo step, where not by their names."""


@dataclass(frozen=True, slots=True)
class ShownZone:
    """Which zone a browser shows in its list."""

    name: str = ""
    """Its name; a zone that is gone is the first one."""
    further: tuple[str, ...] = ()
    """Names of what is selected besides it."""


def shown_zone(state: AppState, browser: int | None) -> Zone | None:
    """Return the zone that a browser shows; None where there is none.

    Parameters
    ----------
    state : of the page.
    browser : which one.
    """
    zones, name = state.project.zones, state.of_browser(browser, ShownZone).name
    return next((zone for zone in zones if zone.name == name), zones[0] if zones else None)


def zones_of(state: AppState, browser: int | None) -> tuple[str, ...]:
    """Names of all zones that a browser has selected; those that are gone are left out.

    Parameters
    ----------
    state : of the page.
    browser : which one.
    """
    shown, names = state.of_browser(browser, ShownZone), [zone.name for zone in state.project.zones]
    return tuple(name for name in (shown.name, *shown.further) if name in names)


def _shown(state: AppState, sender: Sender, called: str = "") -> Zone:
    """Return the zone that is called so, else the one that is shown."""
    zone = shown_zone(state.with_browser(sender.browser, ShownZone(called)) if called else state, sender.browser)
    if zone is None:
        raise UsageError("the project has no zone; expected one")
    if called not in ("", zone.name):
        raise UsageError(f"no zone is called {called!r}")
    return zone


def _with_zones(state: AppState, zones: tuple[Zone, ...], edit: Edit, name: str) -> Outcome:
    """Return what follows from other zones: one undo step, and one of them is shown."""
    if zones == state.project.zones:
        return Outcome(state)
    after = edited(state, replace(state.project, zones=zones), edit)
    return Outcome(after.with_browser(edit.sender.browser, ShownZone(name)))


def _with_zone(state: AppState, zone: Zone, changed: Zone, edit: Edit) -> Outcome:
    return _with_zones(state, ZONES.put(state.project.zones, changed, zone.name), edit, changed.name)


@reduce.register
def add_zone(action: actions.AddZone, state: AppState, sender: Sender) -> Outcome:
    zones = state.project.zones
    name = ZONES.fresh(zones)
    (left, low), (right, high) = low_high(action.area)
    if left == right or low == high:
        return Outcome(state)
    zone = in_file(Zone(name=name, outline=((left, low), (right, low), (right, high), (left, high))))
    return _with_zones(state, ZONES.put(zones, zone), Edit(f"draw {name}", sender), name)


@reduce.register
def show_zone(action: actions.ShowZone, state: AppState, sender: Sender) -> Outcome:
    after = state.with_browser(sender.browser, ShownZone(action.name))
    zone = shown_zone(after, sender.browser)
    if zone is None:
        return Outcome(after)
    xs, ys = zip(*zone.outline, strict=True)
    return Outcome(after, (FlyTo((0.5 * (min(xs) + max(xs)), 0.5 * (min(ys) + max(ys)))),))


@reduce.register
def set_zone(action: actions.SetZone, state: AppState, sender: Sender) -> Outcome:
    zone = _shown(state, sender, action.of)
    changed = with_field(zone, action.field, action.value, "field of a zone")
    what = f"set {WORDS.get(action.field, action.field)} of {zone.name}"
    edit = Edit(f"rename {zone.name}" if action.field == "name" else what, sender)
    return _with_zone(state, zone, changed, edit)


@reduce.register
def count_kind(action: actions.CountKind, state: AppState, sender: Sender) -> Outcome:
    zone = _shown(state, sender, action.of)
    kinds = tuple(kind for kind in ObservationKind if (action.counts if kind == action.kind else kind in zone.kinds))
    verb = "use" if action.counts else "leave out"
    return _with_zone(state, zone, replace(zone, kinds=kinds), Edit(f"{verb} {action.kind} in {zone.name}", sender))


@reduce.register
def delete_zone(_action: actions.DeleteZone, state: AppState, sender: Sender) -> Outcome:
    zone, chosen = _shown(state, sender), zones_of(state, sender.browser)
    gone = chosen if len(chosen) > 1 else (zone.name,)
    left = tuple(each for each in state.project.zones if each.name not in gone)
    what = zone.name if len(gone) == 1 else counted_text(len(gone), "zone")
    return _with_zones(state, left, Edit(f"delete {what}", sender), "")
