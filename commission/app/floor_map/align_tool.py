"""The tool that moves the floor map onto the plant's coordinate system by points of known coordinates. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from commission.app.base.actions import Camera, ClickFloor, Point, Sender
from commission.app.base.effects import PlaceCamera, Tell
from commission.app.base.reducer import Outcome
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing.editor import editor_of, with_tool
from commission.app.editing.gestures import marked_place
from commission.app.editing.tool import Label, Tool
from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.site.editing.alignment import DOUBTFUL, Alignment, KnownPoint, align, aligned, moved_onto
from commission.site.editing.plant_fit import PlantPair, fit_points, pairs_of
from commission.site.project import Project
from commission.site.quantity import COORDINATE, MILLIMETRES, PERCENT, Quantity, Words

LETTERS = "ABCDEFGHIJKL"
"""Points that are clicked, in their order; a table may have any number of others."""
NEAR = 2.0
"""A click so many times as near to a point as means something moves it."""


@dataclass(frozen=True, slots=True)
class NamedPoint:
    """A point of the map with its coordinates in the plant."""

    at: Point
    """Where it was clicked [m]."""
    plant: Annotated[Point, Quantity(label="x, y", unit="m", bounds=COORDINATE)]
    """Where it lies in the plant's coordinate system; where it was clicked until somebody says otherwise."""
    name: Annotated[str, Words("is")] = ""
    """What you call it, such as: column B4."""
    origin: tuple[float, float, float] | None = None
    """Where the floor map lay when it was clicked: on another one the point means nothing."""


@dataclass(frozen=True, slots=True)
class PlantSurvey:
    """Points that were surveyed in the plant, from a table."""

    rows: tuple[tuple[str, float, float], ...] = ()
    """Name, x and y [m], as pasted."""
    pairs: tuple[PlantPair, ...] = ()
    """Those of them that are reflectors, stations, or clicked points by their names."""


@dataclass(frozen=True, slots=True)
class AlignTool(Tool):
    """Takes points by which the map is moved onto the plant's coordinate system: two, or more to check them by."""

    known: tuple[NamedPoint, ...] = ()
    """Those that were clicked: A, B, ..."""
    everything: bool = False
    """Whether reflectors, routes and stations go with the map."""

    survey: PlantSurvey = PlantSurvey()
    """What a table says of points; nothing where none was pasted."""

    name = "Align"
    stays = True

    def taken_up(self, state: AppState) -> AlignTool:
        """Return the tool with its points, unless the floor map was moved or exchanged since they were clicked."""
        kept = AlignTool(everything=self.everything) if self.is_outdated(state.project) else self
        return kept.paired(state.project)

    def is_outdated(self, project: Project) -> bool:
        """Whether the floor map lies elsewhere than when the points were clicked."""
        return any(point.origin != _origin(project) for point in self.known)

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Take a point: the center of a reflector, a station, a corner of a wall, or the place itself."""
        place = marked_place(state.project, click.place, click.reach)
        begun = AlignTool(everything=self.everything) if self.is_outdated(state.project) else self
        clicked = NamedPoint(place, place, origin=_origin(state.project))
        farther = begun.with_point(clicked, NEAR * click.reach)
        return Outcome(with_tool(state, sender, farther.paired(state.project)))

    def with_point(self, point: NamedPoint, near: float) -> AlignTool:
        """Return the tool after a click: the next point, or one that is near is moved and keeps what was typed for it.

        Parameters
        ----------
        point : that was clicked.
        near : distance up to which a point is moved [m]; the nearest is, too, where all letters are in use.
        """
        old = min(self.known, key=lambda each: math.dist(each.at, point.at), default=None)
        is_full = len(self.known) == len(LETTERS)
        if old is None or not (is_full or math.dist(old.at, point.at) <= near):
            return replace(self, known=(*self.known, point))
        new = replace(old, at=point.at, plant=point.at if old.plant == old.at else old.plant)
        return replace(self, known=tuple(new if each is old else each for each in self.known))

    def without_last(self) -> AlignTool:
        """Return the tool without the point that was clicked last."""
        return replace(self, known=self.known[:-1])

    def without_any(self) -> AlignTool:
        """Return the tool without the points that were clicked."""
        return replace(self, known=())

    def paired(self, project: Project) -> AlignTool:
        """Return the tool with the points of the table found in the project and among the clicked ones, by name."""
        free = [(point.name, *point.at) for point in self.known if point.name]
        rows = self.survey.rows
        return replace(self, survey=PlantSurvey(rows, pairs_of(project, rows, free)[0]))

    @property
    def surveyed(self) -> tuple[PlantPair, ...]:
        """Points of the table that are known on the map, too."""
        return self.survey.pairs

    @property
    def is_checked(self) -> bool:
        """Whether more is known than two clicked points: then all points are fitted, and each is held against it."""
        return bool(self.surveyed) or len(self.known) > 2

    def pairs(self) -> tuple[PlantPair, ...]:
        """Return all points that are known on both sides: of the table, and those clicked whose place was typed."""
        in_table = frozenset(pair.name.casefold() for pair in self.surveyed)
        typed = (
            PlantPair(point.name or letter, point.at, point.plant)
            for letter, point in zip(LETTERS, self.known, strict=False)
            if point.plant != point.at and point.name.casefold() not in in_table
        )
        return (*self.surveyed, *typed)

    def untyped(self) -> tuple[str, ...]:
        """Return what clicked points are called of which nothing says where they lie in the plant."""
        counted = frozenset(pair.name.casefold() for pair in self.pairs())
        named = (point.name or letter for letter, point in zip(LETTERS, self.known, strict=False))
        return tuple(name for name in named if name.casefold() not in counted)

    def alignment(self) -> Alignment | None:
        """Return how the points move the map; none before there are two that say so."""
        if len(self.known) < 2:
            return None
        try:
            a, b = (KnownPoint(point.at, point.plant) for point in self.known)
            return align(a, b)
        except UsageError:
            return None

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say which point comes next."""
        which = LETTERS[len(self.known)] if len(self.known) < len(LETTERS) else ""
        what = "a corner, a column or a reflector of known plant coordinates"
        expected = f"click {which}, {what}" if which else "type coordinates"
        if which and len(self.known) > 1:
            expected = f"type coordinates, or click {which} to check them by"
        return f"Align: {expected} &nbsp; (Esc ends)"

    def sketch(self, state: AppState, browser: int) -> list[FloatArray]:  # noqa: ARG002 - the tool's
        """Return the line from A to B; of more points none, since no line says anything of them."""
        return [np.array(self.marks())] if len(self.known) == 2 else []

    def marks(self) -> tuple[Point, ...]:
        """Return the points."""
        return tuple(point.at for point in self.known)

    def labels(self) -> tuple[Label, ...]:
        """Return what the clicked points are called."""
        named = zip(LETTERS, self.known, strict=False)
        return tuple((f"{letter} {point.name}".strip(), point.at) for letter, point in named)


def _origin(project: Project) -> tuple[float, float, float] | None:
    """Return where the floor map lies; none where there is none."""
    if project.floor_map is None:
        return None
    x, y, turned = map(float, project.floor_map.origin)
    return x, y, turned


def _by_all(state: AppState, sender: Sender, tool: AlignTool) -> Outcome:
    """Return what follows from a fit of all points; with a table, which may name what stands on the map, all moves."""
    pairs = tool.pairs()
    found = fit_points(pairs)
    project = moved_onto(state.project, found.T_plant_map, everything=bool(tool.surveyed) or tool.everything)
    after = edited(with_tool(state, sender, None), project, Edit(f"align to {len(pairs)} points", sender))
    text = (
        f"aligned to {len(pairs)} points: RMS {MILLIMETRES.text(found.rms, '.1f')}, at most "
        f"{MILLIMETRES.text(float(found.offs.max()), '.1f')}; a drive that was loaded before is in the old coordinates"
    )
    return Outcome(after, (Tell(text, failed=False), PlaceCamera(Camera.FIT, everywhere=True)))


def align_tool_of(state: AppState, sender: Sender) -> AlignTool:
    """Return the tool that a browser aligns by; raises UsageError when it uses another one."""
    tool = editor_of(state, sender.browser).tool
    if not isinstance(tool, AlignTool):
        raise UsageError("nothing is being aligned; expected the tool Align")
    return tool


def align_map(state: AppState, sender: Sender) -> Outcome:
    """Return what follows from moving and turning the map: one undo step, and everybody sees it whole."""
    tool = align_tool_of(state, sender)
    if tool.is_outdated(state.project):
        raise UsageError("the floor map was moved or exchanged since the points were clicked; expected them anew")
    if tool.is_checked:
        return _by_all(state, sender, tool)
    if len(tool.known) < 2:
        raise UsageError(f"{len(tool.known)} points were clicked; expected A and B")
    a, b = (KnownPoint(point.at, point.plant) for point in tool.known)
    found = align(a, b)
    project = aligned(state.project, found, everything=tool.everything)
    names = " and ".join(point.name or letter for letter, point in zip(LETTERS, tool.known, strict=False))
    after = edited(with_tool(state, sender, None), project, Edit(f"align to {names}", sender))
    text = f"aligned to {names}, each {MILLIMETRES.text(abs(0.5 * found.residual))} off"
    if found.share > DOUBTFUL:
        text += f"; that is {PERCENT.text(found.share, '.1f')} of their distance: look at the points and their numbers"
    if tool.everything:
        text += "; a drive that was loaded before is in the old coordinates: start it again"
    told = Tell(text, failed=found.share > DOUBTFUL)
    return Outcome(after, (told, PlaceCamera(Camera.FIT, everywhere=True)))
