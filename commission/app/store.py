"""The state of the page as one frozen value: the project with its undo steps, and what the run is asked to do.

No widget and no estimator: the state of the run itself lives in `session`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from commission.app.actions import Source
from commission.app.editing.editor import Editor
from commission.app.mapping.draft import MapLoading
from commission.app.plan.settings import PlanSettings
from commission.site.project import Project

SPEEDS = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Factors that the play clock offers."""

MAGNIFICATIONS = (1.0, 3.0, 10.0, 30.0)
"""Factors at which ellipses can be drawn."""


NOTHING_SAVED = Project(name="")
"""What is on disk of a new project: it differs from any, so that there is something to save."""

UNDO_STEPS = 10_000
"""Undo steps that are kept: nobody goes back farther, and memory stays bounded. Projects share what did not change."""
MERGE_WITHIN_S = 1.0


@dataclass(frozen=True, slots=True)
class Step:
    """A project that undo or redo brings back."""

    project: Project
    """The project."""
    name: str = ""
    """What is taken back or made again by that, as its button says."""
    client: int | None = None
    """Number of the browser that did it; none: nobody in particular."""


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
    return replace(
        state, project=project, undo=undo, redo=(), last_edit=LastEdit(edit.key, edit.at) if edit.key else None
    )
