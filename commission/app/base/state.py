"""The state of the page as one frozen value: the project with its undo steps, the browsers, and parts of features.

It knows no feature: each keeps its own frozen value here, found by its type. No widget, no estimator.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol, runtime_checkable

from commission.app.base.actions import PROGRAM, Sender
from commission.app.base.parts import Part, Parts, part_of
from commission.app.base.reach import EVERYWHERE, Reach
from commission.errors import UsageError
from commission.site.editing.packed_map import PackedMap
from commission.site.project import Project

MAGNIFICATIONS = (1.0, 3.0, 10.0, 30.0)
"""Factors at which ellipses can be drawn."""


NOTHING_SAVED = Project(name="")
"""What is on disk of a new project: it differs from any, so that there is something to save."""

UNDO_STEPS = 10_000
"""Undo steps that are kept: nobody goes back farther, and memory stays bounded. Projects share what did not change."""
FAULTS_KEPT = 20
"""Lines of what went wrong that are listed."""
MAP_BYTES = 200_000_000
"""Bytes of cells that the undo steps hold as they are, and as many the redo steps; older maps are packed."""
MERGE_WITHIN_S = 1.0
WINDOWS_KEPT = 32
"""Windows that have gone of which is kept what comes back with them."""


@dataclass(frozen=True, slots=True)
class Holding:
    """Whether one browser has hold of a slider: what it changes until it lets go is one step, however long it takes."""

    held: bool = False
    """Whether it has."""


@dataclass(frozen=True, slots=True)
class BrowserWindow:
    """Which window of a browser a connection is of: a reload, or a lost connection, makes another connection of it."""

    name: str = ""
    """As it has named itself; empty: it has not yet."""


@runtime_checkable
class Lasting(Protocol):
    """What a feature keeps for a browser, and has again when the same window comes back."""

    def brought_back(self, state: AppState) -> object:
        """Return what still holds of it in the state to which the window has come back."""
        ...


@dataclass(frozen=True, slots=True)
class Step:
    """A project that undo or redo brings back."""

    project: Project
    """The project; without its floor map where that is packed."""
    name: str = ""
    """What is taken back or made again by that, as its button says."""
    browser: int | None = None
    """Number of the browser that did it; none: the program itself."""
    packed: PackedMap | None = None
    """Its floor map, where that is packed."""

    @property
    def whole(self) -> Project:
        """The project with its floor map."""
        return self.project if self.packed is None else replace(self.project, floor_map=self.packed.unpacked())


@dataclass(frozen=True, slots=True)
class LastEdit:
    """What the newest undo step changed, who did it and when: what follows quickly belongs to it."""

    key: str
    """Names the thing that was changed: `group.name` of a parameter."""
    sender: Sender = PROGRAM
    """Who, and when."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AppState:
    """Everything that the page shows and that no background work computes."""

    project: Project
    """As edited now."""
    saved: Project
    """As on disk."""
    folder: Path | None = None
    """Where the project is written to; none: it is bundled with the program and stays as it is."""
    read_only: str = ""
    """Why the project cannot be edited, in one line; empty: it can."""
    reach: Reach = EVERYWHERE
    """Where browsers may read and write."""
    greeting: str = ""
    """What each browser is told when it comes: what was restored after a crash, until it is saved."""
    undo: tuple[Step, ...] = ()
    """Earlier projects, the newest last."""
    redo: tuple[Step, ...] = ()
    """Projects that were taken back, the newest last."""
    last_edit: LastEdit | None = None
    """The edit that a quick next one of the same thing is merged with."""
    hidden: frozenset[str] = frozenset()
    """Names of layers that are not drawn."""
    magnify: float = 1.0
    """Factor at which ellipses are drawn."""
    faults: tuple[str, ...] = ()
    """What went wrong, the newest last."""
    parts: Parts = field(default_factory=dict[type, object])
    """What features keep for all browsers together."""
    browsers: Mapping[int, Parts] = field(default_factory=dict[int, Parts])
    """What features keep for each connected browser, by its number."""
    away: Mapping[str, Parts] = field(default_factory=dict[str, Parts])
    """What comes back with windows that have gone, by their names; the one that went last is the last."""

    @property
    def is_changed(self) -> bool:
        """Whether there is something to save."""
        return self.project is not self.saved and self.project != self.saved

    def part(self, kind: type[Part]) -> Part:
        """Return what a feature keeps; its default where it has kept nothing yet."""
        return part_of(self.parts, kind)

    def with_part(self, part: object) -> AppState:
        """Return the state with one part exchanged."""
        return replace(self, parts={**self.parts, type(part): part})

    def with_faults(self, *texts: str) -> AppState:
        """Return the state with more lines in the list of what went wrong; the oldest fall out of a long one."""
        return replace(self, faults=(*self.faults, *texts)[-FAULTS_KEPT:])

    def of_browser(self, browser: int | None, kind: type[Part]) -> Part:
        """Return what a feature keeps for a browser; its default where that is nothing, or the browser is not there."""
        return part_of({} if browser is None else self.browsers.get(browser, {}), kind)

    def with_browser(self, browser: int | None, part: object) -> AppState:
        """Return the state with one part of a browser exchanged; one that has left, or never came, gets none."""
        if browser is None or browser not in self.browsers:
            return self
        return replace(self, browsers={**self.browsers, browser: {**self.browsers[browser], type(part): part}})

    def joined(self, browser: int) -> AppState:
        """Return the state with one more browser, which begins with the defaults."""
        return replace(self, browsers={**self.browsers, browser: {}})

    def left(self, browser: int) -> AppState:
        """Return the state without a browser; what comes back with its window is laid aside."""
        parts = self.browsers.get(browser, {})
        lasting, name = {kind: part for kind, part in parts.items() if isinstance(part, Lasting)}, _window(parts)
        there = {number: its for number, its in self.browsers.items() if number != browser}
        away = self.away
        if name and lasting and name not in map(_window, there.values()):
            others = [(each, its) for each, its in away.items() if each != name]
            away = dict([*others, (name, lasting)][-WINDOWS_KEPT:])
        return replace(self, browsers=there, away=away)

    def named(self, browser: int, name: str) -> AppState:
        """Return the state in which a browser is a window, with what that window had, unless it has begun anew.

        Parameters
        ----------
        browser : number of the connection.
        name : of the window; the connection that it had before may not be known to have gone yet.
        """
        now = self.browsers.get(browser)
        if now is None or BrowserWindow(name) in now.values():
            return self
        living = (parts for parts in reversed(tuple(self.browsers.values())) if _window(parts) == name)
        had = next(living, self.away.get(name, {}))
        back = {kind: part.brought_back(self) for kind, part in had.items() if isinstance(part, Lasting)}
        away = {each: parts for each, parts in self.away.items() if each != name}
        return replace(
            self, browsers={**self.browsers, browser: {**back, **now, BrowserWindow: BrowserWindow(name)}}, away=away
        )


def _window(parts: Parts) -> str:
    """Name of the window whose parts these are; empty: it has none."""
    return part_of(parts, BrowserWindow).name


@dataclass(frozen=True, slots=True)
class Edit:
    """What an edit is called, who made it, and what it may be merged with."""

    name: str
    """As the undo button says: `move R3`."""
    sender: Sender = PROGRAM
    """Who made it, and when."""
    key: str = ""
    """Names the thing that was changed; one browser's edits of one thing in quick succession are one step. Empty:
    never merged."""


def edited(state: AppState, project: Project, edit: Edit) -> AppState:
    """Return the state after an edit: one more undo step, unless it belongs to the newest one.

    Parameters
    ----------
    state : before the edit.
    project : as edited.
    edit : its name, who made it, and what it goes on with.

    Raises
    ------
    UsageError
        the project is read-only.
    """
    refuse_read_only(state)
    step = Step(state.project, edit.name, edit.sender.browser)
    undo = state.undo if _is_merged(state, edit) else (*state.undo, step)[-UNDO_STEPS:]
    if project.floor_map is not state.project.floor_map:
        undo = with_maps_packed(undo)
    last_edit = LastEdit(edit.key, edit.sender) if edit.key else None
    return replace(state, project=project, undo=undo, redo=(), last_edit=last_edit)


def refuse_read_only(state: AppState) -> None:
    """Raise UsageError where the project cannot be edited."""
    if state.read_only:
        raise UsageError(f"this page shows the project read-only: {state.read_only}")


def _is_merged(state: AppState, edit: Edit) -> bool:
    """Whether an edit goes on with the newest undo step."""
    last, sender = state.last_edit, edit.sender
    return (
        last is not None
        and bool(edit.key and state.undo)
        and (last.key, last.sender.browser) == (edit.key, sender.browser)
        and (state.of_browser(sender.browser, Holding).held or sender.at - last.sender.at <= MERGE_WITHIN_S)
    )


def with_maps_packed(steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """Return the steps with the floor maps of the older ones packed, as far as they hold more than MAP_BYTES.

    Each edit of a map makes another array of cells, 8 MB for 200 x 100 m; steps between share theirs.
    """
    left, counted = MAP_BYTES, set[int]()
    packed: dict[int, PackedMap] = {}
    changed: dict[int, Step] = {}
    for index in range(len(steps) - 1, -1, -1):
        project = steps[index].project
        floor_map = project.floor_map
        if floor_map is None:
            continue
        if id(floor_map.cells) not in counted:
            counted.add(id(floor_map.cells))
            left -= floor_map.cells.nbytes
        # The newest is never packed: it is gone back to at once, and shares its cells with what is shown.
        if left < 0 and index < len(steps) - 1:
            if id(floor_map) not in packed:
                packed[id(floor_map)] = PackedMap.of(floor_map)
            changed[index] = replace(
                steps[index], project=replace(project, floor_map=None), packed=packed[id(floor_map)]
            )
    return tuple(changed.get(index, step) for index, step in enumerate(steps)) if changed else steps
