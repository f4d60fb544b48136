"""What an import would change, compared with the project as it is now. Pure: from values to values."""

from __future__ import annotations

from dataclasses import dataclass, replace

from commission.app.exchange.pending import Pending
from commission.io.edges import RouteImport
from commission.io.imk import ReflectorImport
from commission.io.project_archive import ProjectImport
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
    "scanner": "scanner",
    "parameters": "parameters of the localizer",
    "disturbances": "disturbances of virtual drives",
}
"""Parts of a project that are replaced as a whole."""


@dataclass(frozen=True, slots=True)
class Preview:
    """Differences, part by part; a part that the file does not speak of is None and stays."""

    reflectors: ReflectorDiff | None = None
    """Of the reflector map."""
    locked: tuple[str, ...] = ()
    """Ids of reflectors that would change or go, and stay because they are locked."""
    routes: NamedDiff[Route] | None = None
    """Of the routes."""
    stations: NamedDiff[Station] | None = None
    """Of the stations."""
    others: tuple[str, ...] = ()
    """Other parts of the project that are replaced as a whole, in the words of the page."""

    @property
    def parts(self) -> tuple[ReflectorDiff | NamedDiff[Route] | NamedDiff[Station], ...]:
        """Those that the file speaks of."""
        return tuple(part for part in (self.reflectors, self.routes, self.stations) if part is not None)

    def changes(self, *, remove: bool) -> bool:
        """Whether accepting would change anything."""
        found = any(part.added or part.changed or (remove and part.removed) for part in self.parts)
        return found or bool(self.others)


def preview(project: Project, pending: Pending) -> Preview:
    """Compare what was read with a project."""
    match pending.imported:
        case ReflectorImport(reflectors, _, fields):
            return _reflectors(project, reflectors, fields)
        case RouteImport() as imported:
            return _network(project, imported)
        case ProjectImport(other):
            found = _reflectors(project, other.reflectors, None)
            replaced = tuple(text for part, text in PARTS.items() if getattr(other, part) != getattr(project, part))
            return replace(
                found,
                routes=network_diff.difference(project.routes, other.routes),
                stations=network_diff.difference(project.stations, other.stations),
                others=replaced,
            )


def accepted(project: Project, pending: Pending) -> Project:
    """Return the project with what was read; it is the same object when nothing changes."""
    found, remove = preview(project, pending), pending.remove
    if not found.changes(remove=remove):
        return project
    reflectors, routes, stations = project.reflectors, project.routes, project.stations
    if found.reflectors is not None:
        reflectors = reflector_diff.merged(reflectors, found.reflectors, remove=remove)
    if found.routes is not None:
        routes = network_diff.merged(routes, found.routes, remove=remove)
    if found.stations is not None:
        stations = network_diff.merged(stations, found.stations, remove=remove)
    base = pending.imported.project if isinstance(pending.imported, ProjectImport) else project
    return replace(base, reflectors=reflectors, routes=routes, stations=stations)


def _reflectors(project: Project, after: ReflectorMap, fields: tuple[str, ...] | None) -> Preview:
    diff = reflector_diff.difference(project.reflectors, after, fields=fields)
    locked = {r.id for r in project.reflectors.reflectors if r.locked}
    touched = (*(change.before.id for change in diff.changed), *(r.id for r in diff.removed))
    free = replace(
        diff,
        changed=tuple(change for change in diff.changed if change.before.id not in locked),
        removed=tuple(r for r in diff.removed if r.id not in locked),
    )
    return Preview(free, tuple(name for name in touched if name in locked))


def _network(project: Project, imported: RouteImport) -> Preview:
    routes = network_diff.difference(project.routes, imported.routes)
    # An order has no stations: it says nothing about those of the project.
    if not imported.layouts:
        return Preview(routes=routes)
    stations = network_diff.keeping_accuracy(project.stations, imported.stations)
    return Preview(routes=routes, stations=network_diff.difference(project.stations, stations))
