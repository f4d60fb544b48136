"""The preview of an import in words: counts, and lists that stay short. Everything from files is escaped here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from commission.app.base.panel import escaped
from commission.app.exchange.preview import Preview
from commission.geometry.angles import wrap_scalar
from commission.site.fields import field_info, get_field
from commission.site.network_diff import course_shift, length_of
from commission.site.quantity import DEGREES, MILLIMETRES, counted_text
from commission.site.reflector_diff import ReflectorChange
from commission.site.reflectors import UNKNOWN, Reflector
from commission.site.routes import Route
from commission.site.stations import Station

LIST_LIMIT = 12
"""Lines of one list; the rest is counted."""
NOTES_LIMIT = 40
"""Lines of notes: each names another kind of trouble."""
TEXT_LIMIT = 160
"""Characters of one line."""

T = TypeVar("T")


def reflector_line(reflector: Reflector) -> str:
    """Return a reflector as one line of a list."""
    radius = UNKNOWN if reflector.radius is None else MILLIMETRES.text(reflector.radius)
    return f"{reflector.id}: {reflector.x:.3f}, {reflector.y:.3f} m, r {radius}"


def reflector_changes(change: ReflectorChange) -> str:
    """Say which values change: `R1: x 1.250 → 1.275 m`."""
    said = [_value_change(name, change) for name in change.fields]
    if change.moved >= 0.0005:
        said.append(f"moves {MILLIMETRES.text(change.moved)}")
    return f"{change.before.id}: {', '.join(said)}"


def _number_change(name: str, before: object, after: object) -> str:
    """Say how a number changes, with the unit and digits of its field."""
    quantity = field_info(before, name).quantity
    old, new = get_field(before, name), get_field(after, name)
    if quantity is not None and (old is None or new is None):
        old, new = (quantity.none if value is None else quantity.text(value) for value in (old, new))
        return f"{name} {old} → {new}"
    text = "" if quantity is None else quantity.change_text(old, new)
    return f"{name} {text or 'by less than the last digit'}"


def _value_change(name: str, change: ReflectorChange) -> str:
    if field_info(change.before, name).quantity is not None:
        return _number_change(name, change.before, change.after)
    before, after = get_field(change.before, name), get_field(change.after, name)
    if isinstance(before, bool):
        before, after = ("yes" if value else "no" for value in (before, after))
    return f"{name} {before or '(none)'} → {after or '(none)'}"


def route_line(route: Route) -> str:
    """Return a route as one line of a list."""
    return f"{route.name}: {length_of(route):.1f} m, {route.speed:g} m/s"


def route_changes(before: Route, after: Route) -> str:
    """Say what differs between two routes: number of curves, length, course, direction, speed."""
    said: list[str] = []
    if len(before.segments) != len(after.segments):
        said.append(f"{len(before.segments)} → {counted_text(len(after.segments), 'segment')}")
    lengths = f"{length_of(before):.2f}", f"{length_of(after):.2f}"
    if lengths[0] != lengths[1]:
        said.append(f"length {lengths[0]} → {lengths[1]} m")
    pairs = list(zip(before.segments, after.segments, strict=False))
    shift = max(course_shift(old, new) for old, new in pairs)
    if shift > 0.0:
        is_seen = MILLIMETRES.text(shift) != MILLIMETRES.text(0.0)
        said.append(f"course moves by {f'up to {MILLIMETRES.text(shift)}' if is_seen else 'less than 1 mm'}")
    turned = sum(old.direction is not new.direction for old, new in pairs)
    if turned:
        said.append(f"{counted_text(turned, 'segment changes', 'segments change')} between forward and reverse")
    speeds = {(before.speed_of(old), after.speed_of(new)) for old, new in pairs}
    said += [f"speed {old:g} → {new:g} m/s" for old, new in sorted(speeds) if old != new][:3]
    return f"{after.name}: {', '.join(said) or 'written otherwise, driven the same'}"


def station_line(station: Station) -> str:
    """Return a station as one line of a list."""
    return f"{station.name}: {station.x:.3f}, {station.y:.3f} m, {DEGREES.text(station.heading, '.1f')}"


def station_changes(before: Station, after: Station) -> str:
    """Say what differs between two stations."""
    said = [_number_change(name, before, after) for name in ("x", "y") if getattr(before, name) != getattr(after, name)]
    if wrap_scalar(after.heading - before.heading) != 0.0:
        said.append(_number_change("heading", before, after))
    return f"{after.name}: {', '.join(said) or 'written otherwise'}"


def counts(preview: Preview, *, remove: bool) -> str:
    """Say in one line for each part how much is added, changed, removed: `Reflectors: 3 added, 1 changed`."""
    lines: list[str] = []
    names = ("Reflectors", "Routes", "Stations")
    for name, part in zip(names, (preview.reflectors, preview.routes, preview.stations), strict=True):
        if part is not None:
            absent = f"{len(part.removed)} {'removed' if remove else 'not in the file'}"
            said = f"{len(part.added)} added, {len(part.changed)} changed, {absent}, {part.unchanged} as before"
            lines.append(f"<b>{name}</b>: {said}")
    return "<br>".join(lines)


def details(preview: Preview, *, remove: bool) -> str:
    """List what is added, changed and removed, as html."""
    gone = "Removed" if remove else "Not in the file, kept"
    html = as_list("Replaced", preview.others, str)
    if preview.reflectors is not None:
        diff = preview.reflectors
        html += as_list("Added", diff.added, reflector_line)
        html += as_list("Changed", diff.changed, reflector_changes)
        html += as_list(gone, diff.removed, reflector_line)
        html += as_list("Locked, left as they are", preview.locked, str)
    if preview.routes is not None:
        html += as_list("Routes added", preview.routes.added, route_line)
        html += as_list("Routes changed", preview.routes.changed, lambda c: route_changes(c.before, c.after))
        html += as_list(f"Routes {gone[0].lower()}{gone[1:]}", preview.routes.removed, route_line)
    if preview.stations is not None:
        html += as_list("Stations added", preview.stations.added, station_line)
        html += as_list("Stations changed", preview.stations.changed, lambda c: station_changes(c.before, c.after))
        html += as_list(f"Stations {gone[0].lower()}{gone[1:]}", preview.stations.removed, station_line)
    return html


def notes(warnings: Sequence[str], title: str = "Notes") -> str:
    """List what a reader or a writer had to say, as html."""
    return as_list(title, warnings, str, NOTES_LIMIT)


def as_list(title: str, values: Sequence[T], line: Callable[[T], str], limit: int = LIST_LIMIT) -> str:
    """Return a list with its title as html, empty for no values: the first lines, and how many more there are.

    Parameters
    ----------
    title : plain text above it.
    values : of any kind.
    line : plain text of a value.
    limit : most values that are told.
    """
    if not values:
        return ""
    shown = [escaped(shortened(line(value))) for value in values[:limit]]
    if len(values) > limit:
        shown.append(f"and {len(values) - limit} more")
    lines = "".join(f"<li>{text}</li>" for text in shown)
    return f"<div class='c-note' style='margin-top:5px'>{escaped(title)}</div><ul class='c-list'>{lines}</ul>"


def shortened(text: str) -> str:
    """Return text on one line, cut where it would crowd the panel."""
    text = " ".join(text.split())
    return text if len(text) <= TEXT_LIMIT else f"{text[: TEXT_LIMIT - 1]}…"
