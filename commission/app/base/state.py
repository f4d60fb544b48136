"""The state of the page as one frozen value: the project with its undo steps, and what the run is asked to do.

No widget and no estimator: the state of the run itself lives in `session`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from commission.app.base.actions import Source
from commission.app.editing.editor import Editor
from commission.app.floor_map.draft import MapLoading
from commission.app.placement.suggestion import LayoutWish
from commission.app.plan.settings import PlanSettings
from commission.site.editing.packed_map import PackedMap
from commission.site.project import Project

SPEEDS = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Factors that the play clock offers."""

MAGNIFICATIONS = (1.0, 3.0, 10.0, 30.0)
"""Factors at which ellipses can be drawn."""


NOTHING_SAVED = Project(name="")
"""What is on disk of a new project: it differs from any, so that there is something to save."""

UNDO_STEPS = 10_000
"""Undo steps that are kept: nobody goes back farther, and memory stays bounded. Projects share what did not change."""
MAP_BYTES = 200_000_000
"""Bytes of cells that the undo steps hold as they are, and as many the redo steps; older maps are packed."""
MERGE_WITHIN_S = 1.0


@dataclass(frozen=True, slots=True)
class Step:
    """A project that undo or redo brings back."""

    project: Project
    """The project; without its floor map where that is packed."""
    name: str = ""
    """What is taken back or made again by that, as its button says."""
    client: int | None = None
    """Number of the browser that did it; none: nobody in particular."""
    packed: PackedMap | None = None
    """Its floor map, where that is packed."""

    @property
    def whole(self) -> Project:
        """The project with its floor map."""
        return self.project if self.packed is None else replace(self.project, floor_map=self.packed.unpacked())


@dataclass(frozen=True, slots=True)
class LastEdit:
    """What the newest undo step changed, and when: what follows quickly belongs to it."""

    key: str
    """Names the thing that was changed: `group.name` of a parameter."""
    at: float
    """When [s, any monotonic clock]."""


@dataclass(frozen=True, slots=True)
class AppState:
    """Everything the page shows that is not the run's own."""

    project: Project
    """As edited now."""
    saved: Project
    """As on disk."""
    folder: Path | None = None
    """Where the project is written to; none: it is bundled with the program and stays as it is."""
    saved_at: str = ""
    """Time of day of the last save; empty: not saved in this session."""
    foreign: tuple[str, ...] = ()
    """Files of the project that somebody else has changed since they were read or saved."""
    greeting: str = ""
    """What each browser is told when it comes: what was restored after a crash, until it is saved."""
    undo: tuple[Step, ...] = ()
    """Earlier projects, the newest last."""
    redo: tuple[Step, ...] = ()
    """Projects that were taken back, the newest last."""
    last_edit: LastEdit | None = None
    """The edit that a quick next one of the same thing is merged with."""
    editors: Mapping[int, Editor] = field(default_factory=dict)
    """How each connected browser edits, by its number; never changed in place."""
    source: Source | None = None
    """What drives."""
    playing: bool = False
    """Whether the play clock runs."""
    speed: float = 1.0
    """Factor of the play clock against real time."""
    repeat: bool = False
    """Whether the drive starts again at its end."""
    covered: bool = False
    """Whether every reflector is covered."""
    hidden: frozenset[str] = frozenset()
    """Names of layers that are not drawn."""
    magnify: float = 1.0
    """Factor at which ellipses are drawn."""
    plan: PlanSettings = field(default_factory=PlanSettings)
    """What the step Plan shows."""
    layout: LayoutWish = field(default_factory=LayoutWish)
    """Whether a suggested layout is wanted."""
    mapping: MapLoading = field(default_factory=MapLoading)
    """The floor map that is being loaded."""
    problems: tuple[str, ...] = field(default=())
    """What went wrong, the newest last."""

    @property
    def is_changed(self) -> bool:
        """Whether there is something to save."""
        return self.project is not self.saved and self.project != self.saved

    def editor(self, client: int) -> Editor:
        """Return how a browser edits; one that is not known yet selects."""
        return self.editors.get(client, Editor())

    def with_editor(self, client: int, editor: Editor) -> AppState:
        """Return the state with one browser's editor exchanged."""
        return replace(self, editors={**self.editors, client: editor})


@dataclass(frozen=True, slots=True)
class Edit:
    """What an edit is called, who made it, and what it may be merged with."""

    name: str
    """As the undo button says: `move R3`."""
    client: int | None = None
    """Number of the browser that made it; none: nobody in particular."""
    key: str = ""
    """Names the thing that was changed; edits of one thing in quick succession are one step. Empty: never merged."""
    at: float = 0.0
    """When [s, any monotonic clock]."""


def edited(state: AppState, project: Project, edit: Edit) -> AppState:
    """Return the state after an edit: one more undo step, unless it belongs to the newest one."""
    last = state.last_edit
    merged = bool(edit.key) and last is not None and last.key == edit.key and edit.at - last.at <= MERGE_WITHIN_S
    step = Step(state.project, edit.name, edit.client)
    undo = state.undo if merged and state.undo else (*state.undo, step)[-UNDO_STEPS:]
    if project.floor_map is not state.project.floor_map:
        undo = with_maps_packed(undo)
    return replace(
        state, project=project, undo=undo, redo=(), last_edit=LastEdit(edit.key, edit.at) if edit.key else None
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
