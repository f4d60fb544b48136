"""Marks that have a name, a place and a heading, stations and tags: how one kind differs from the other. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from commission.app.base.actions import Point
from commission.app.editing.editor import Editor, PosedKey, PosedKind
from commission.site.editing.named import STATIONS, TAGS, Named
from commission.site.editing.stations import aligned, on_route
from commission.site.project import Project
from commission.site.stations import Station
from commission.site.tags import Tag

PosedMark = Station | Tag
T = TypeVar("T", Station, Tag)


@dataclass(frozen=True, slots=True, kw_only=True)
class Posed(Generic[T]):
    """One kind of such marks."""

    named: Named[T]
    """How its marks are told apart."""
    field: str
    """Field of `Project` that holds them."""
    first: Callable[[str], T]
    """The first one, by its name, like nothing before it."""
    prefix: str
    """What precedes a name where it has to be clear what it names."""
    words: Mapping[str, str]
    """What the fields are called in an undo step, where not by their names."""
    placed: Callable[[Project, T, float], T]
    """A new mark as what is within reach [m] attracts it."""
    moved: Callable[[Project, T, float], T]
    """One that was moved, likewise."""

    def all_of(self, project: Project) -> tuple[T, ...]:
        """Return those of a project."""
        found: tuple[T, ...] = getattr(project, self.field)
        return found

    def called(self, item: T) -> str:
        """Return what a mark is called in a sentence: `tag T1`."""
        return self.prefix + self.named.key_of(item)

    def fresh(self, project: Project, place: Point) -> T:
        """Return a new one like the last: with a name that none has, at a place [m], map frame."""
        there = self.all_of(project)
        name = self.named.fresh(there)
        like = replace(there[-1], **{self.named.key: name}) if there else self.first(name)
        return replace(like, x=place[0], y=place[1])


def _as_it_is(_project: Project, item: T, _reach: float) -> T:
    return item


def _along_a_route(project: Project, station: Station, reach: float) -> Station:
    """Put a new station onto the nearest route within reach [m], looking along it."""
    pose = on_route(project.routes, (station.x, station.y), reach)
    if pose is None:
        return station
    x, y, heading = (float(value) for value in pose)
    return replace(station, x=x, y=y, heading=heading)


def _onto_a_route(project: Project, station: Station, reach: float) -> Station:
    """Put a station onto the nearest route within reach [m]; across its way it keeps its heading."""
    pose = on_route(project.routes, (station.x, station.y), reach)
    return station if pose is None else aligned(station, pose)


KINDS: Mapping[PosedKind, Posed[Any]] = {
    PosedKind.STATION: Posed(
        named=STATIONS,
        field="stations",
        first=lambda name: Station(name=name, x=0.0, y=0.0),
        prefix="",
        words={"x": "place", "y": "place", "required_accuracy": "accuracy"},
        placed=_along_a_route,
        moved=_onto_a_route,
    ),
    PosedKind.TAG: Posed(
        named=TAGS,
        field="tags",
        first=lambda name: Tag(id=name, x=0.0, y=0.0),
        prefix="tag ",
        words={"x": "place", "y": "place", "sigma": "1σ of the place", "heading_sigma": "1σ of the heading"},
        placed=_as_it_is,
        moved=_as_it_is,
    ),
}
"""Where two overlap on the floor, a click means the one whose kind comes first."""


def mark_of(project: Project, key: PosedKey | None) -> PosedMark | None:
    """Return a station or a tag; None where that is nothing, or it is gone.

    Parameters
    ----------
    project : has them.
    key : which one; None: nothing.
    """
    if key is None:
        return None
    kind = KINDS[key.kind]
    return next((item for item in kind.all_of(project) if kind.named.key_of(item) == key.name), None)


def marks_of(project: Project, editor: Editor) -> tuple[PosedMark, ...]:
    """Return all stations or tags that are selected, the first one first; those that are gone are left out.

    Parameters
    ----------
    project : has them.
    editor : of a browser.
    """
    if editor.posed is None:
        return ()
    kind = editor.posed.kind
    found = (mark_of(project, PosedKey(kind, name)) for name in (editor.posed.name, *editor.further))
    return tuple(mark for mark in found if mark is not None)
