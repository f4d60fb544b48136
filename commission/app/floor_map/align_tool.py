"""The tool that moves the floor map onto the plant's coordinate system by two points of known coordinates. Pure."""

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
from commission.site.editing.plant_fit import PlantPair, fit_points
from commission.site.quantity import COORDINATE, MILLIMETRES, PERCENT, Quantity, Words

LETTERS = "AB"


@dataclass(frozen=True, slots=True)
class NamedPoint:
    """A point of the map with its coordinates in the plant."""

    at: Point
    """Where it was clicked [m]."""
    plant: Annotated[Point, Quantity(label="x, y", unit="m", bounds=COORDINATE)]
    """Where it lies in the plant's coordinate system; where it was clicked until somebody says otherwise."""
    name: Annotated[str, Words("is")] = ""
    """What you call it, such as: column B4."""


@dataclass(frozen=True, slots=True)
class AlignTool(Tool):
    """Takes two points by which the map is moved onto the plant's coordinate system."""

    known: tuple[NamedPoint, ...] = ()
    """At most two: A and B."""
    everything: bool = False
    """Whether reflectors, routes and stations go with the map."""

    surveyed: tuple[PlantPair, ...] = ()
    """Reflectors and stations that were surveyed in the plant; where there are any, they count and A and B do not."""

    name = "Align"

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Take a point: the center of a reflector, a station, a corner of a wall, or the place itself."""
        return Outcome(with_tool(state, sender, self.with_point(marked_place(state.project, click.place, click.reach))))

    def with_point(self, place: Point) -> AlignTool:
        """Return the tool after a click: A, then B, then the nearer one is moved and keeps what was typed for it."""
        if len(self.known) < 2:
            return replace(self, known=(*self.known, NamedPoint(place, place)))
        nearer = min((0, 1), key=lambda index: math.dist(self.known[index].at, place))
        old = self.known[nearer]
        new = replace(old, at=place, plant=place if old.plant == old.at else old.plant)
        return replace(self, known=tuple(new if point is old else point for point in self.known))

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
        which = LETTERS[len(self.known)] if len(self.known) < 2 else ""
        expected = f"click {which}, a corner or a reflector of known plant coordinates" if which else "type coordinates"
        return f"Align: {expected} &nbsp; (Esc ends)"

    def sketch(self, state: AppState, browser: int) -> list[FloatArray]:  # noqa: ARG002 - the tool's
        """Return the line from A to B."""
        return [np.array(self.marks())] if len(self.known) > 1 else []

    def marks(self) -> tuple[Point, ...]:
        """Return the points."""
        return tuple(point.at for point in self.known)

    def labels(self) -> tuple[Label, ...]:
        """Return A and B."""
        return tuple((letter, point.at) for letter, point in zip(LETTERS, self.known, strict=False))


def _by_surveyed(state: AppState, sender: Sender, pairs: tuple[PlantPair, ...]) -> Outcome:
    """Return what follows from moving everything by surveyed points, which go along with the map."""
    found = fit_points(pairs)
    project = moved_onto(state.project, found.T_plant_map, everything=True)
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
    if tool.surveyed:
        return _by_surveyed(state, sender, tool.surveyed)
    if len(tool.known) < 2:
        raise UsageError(f"{len(tool.known)} points were clicked; expected A and B")
    a, b = (KnownPoint(point.at, point.plant) for point in tool.known)
    found = align(a, b)
    project = aligned(state.project, found, everything=tool.everything)
    names = " and ".join(point.name or letter for letter, point in zip(LETTERS, tool.known, strict=True))
    after = edited(with_tool(state, sender, None), project, Edit(f"align to {names}", sender))
    text = f"aligned to {names}, each {MILLIMETRES.text(abs(0.5 * found.residual))} off"
    if found.share > DOUBTFUL:
        text += f"; that is {PERCENT.text(found.share, '.1f')} of their distance: look at the points and their numbers"
    if tool.everything:
        text += "; a drive that was loaded before is in the old coordinates: start it again"
    told = Tell(text, failed=found.share > DOUBTFUL)
    return Outcome(after, (told, PlaceCamera(Camera.FIT, everywhere=True)))
