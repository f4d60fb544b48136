"""What an import would change, compared with the project as it is now. Pure: from values to values."""

from __future__ import annotations

from dataclasses import dataclass, replace

from commission.io.imk import ReflectorImport
from commission.io.imports import Imported
from commission.io.project_archive import ProjectImport
from commission.io.route_edges import RouteImport
from commission.site import network_diff, reflector_diff
from commission.site.network_diff import NamedDiff
from commission.site.project import Project
from commission.site.reflector_diff import ReflectorDiff
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route
from commission.site.stations import Station

PARTS = {
    "name": "name of the project",
    "floor_map": "floor map",
    "vehicle": "vehicle",
    "scanners": "scanners",
    "parameters": "parameters of the localizer",
    "uncertainty": "uncertainty of map, mounting, range and clock",
    "disturbances": "disturbances of virtual drives",
    "layout": "demands on a suggested layout",
}
"""Parts of a project that are replaced as a whole, in the words of the page."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Preview:
    """Differences, part by part; a part that the file does not speak of is None and stays."""

    project: Project
    """What the file is compared with."""
    base: Project
    """The same, with what is replaced as a whole."""
    reflectors: ReflectorDiff | None = None
    """Of the reflector map."""
    locked: tuple[str, ...] = ()
    """Ids of reflectors that would change or go, and stay because they are locked."""
    routes: NamedDiff[Route] | None = None
    """Of the routes."""
    stations: NamedDiff[Station] | None = None
    """Of the stations."""
    others: tuple[str, ...] = ()
    """What is replaced as a whole, in the words of the page."""

    def changes(self, *, remove: bool) -> bool:
        """Whether accepting would change anything."""
        parts = (part for part in (self.reflectors, self.routes, self.stations) if part is not None)
        return bool(self.others) or any(part.added or part.changed or (remove and part.removed) for part in parts)

    def accepted(self, *, remove: bool) -> Project:
        """Return the project with what was read; it is the same object when nothing changes.

        Parameters
        ----------
        remove : whether what is not in the file goes.
        """
        if not self.changes(remove=remove):
            return self.project
        reflectors, routes, stations = self.project.reflectors, self.project.routes, self.project.stations
        if self.reflectors is not None:
            reflectors = reflector_diff.merged(reflectors, self.reflectors, remove=remove)
        if self.routes is not None:
            routes = network_diff.merged(routes, self.routes, remove=remove)
        if self.stations is not None:
            stations = network_diff.merged(stations, self.stations, remove=remove)
        return replace(self.base, reflectors=reflectors, routes=routes, stations=stations)


def compare(project: Project, imported: Imported) -> Preview:
    """Compare what was read with a project."""
    same = Preview(project=project, base=project)
    match imported:
        case ReflectorImport(reflectors, _, fields):
            return _with_reflectors(same, reflectors, fields)
        case RouteImport():
            # An order has no stations: it says nothing about those of the project.
            return _with_network(same, imported.routes, imported.stations if imported.layouts else None)
        case ProjectImport(other):
            others = tuple(text for part, text in PARTS.items() if getattr(other, part) != getattr(project, part))
            whole = _with_reflectors(replace(same, base=other, others=others), other.reflectors, None)
            found = _with_network(whole, other.routes, None)
            return replace(found, stations=network_diff.difference(project.stations, other.stations))


def _with_reflectors(found: Preview, after: ReflectorMap, fields: tuple[str, ...] | None) -> Preview:
    before = found.project.reflectors
    diff = reflector_diff.difference(before, after, fields=fields)
    locked = {r.id for r in before.reflectors if r.locked}
    touched = (*(change.before.id for change in diff.changed), *(r.id for r in diff.removed))
    free = replace(
        diff,
        changed=tuple(change for change in diff.changed if change.before.id not in locked),
        removed=tuple(r for r in diff.removed if r.id not in locked),
    )
    return replace(found, reflectors=free, locked=tuple(name for name in touched if name in locked))


def _with_network(found: Preview, routes: tuple[Route, ...], stations: tuple[Station, ...] | None) -> Preview:
    """Compare routes, and stations of a format that carries no required accuracy."""
    found = replace(found, routes=network_diff.difference(found.project.routes, routes))
    if stations is None:
        return found
    accurate = network_diff.with_required_accuracy(found.project.stations, stations)
    return replace(found, stations=network_diff.difference(found.project.stations, accurate))
