"""The state of the page as one frozen value: the project with its undo steps, and what the run is asked to do.

No widget and no estimator: the state of the run itself lives in `session`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from commission.app.actions import Source
from commission.site.project import Project

SPEEDS = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Factors that the play clock offers."""

MAGNIFICATIONS = (1.0, 3.0, 10.0, 30.0)
"""Factors at which ellipses can be drawn."""


@dataclass(frozen=True, slots=True)
class LastEdit:
    """Which parameter the newest undo step changed, and when: what follows quickly belongs to it."""

    key: str
    """`group.name`."""
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
    undo: tuple[Project, ...] = ()
    """Earlier projects, the newest last."""
    redo: tuple[Project, ...] = ()
    """Projects that were taken back, the newest last."""
    last_edit: LastEdit | None = None
    """The edit that a quick next one of the same parameter is merged with."""
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
    problems: tuple[str, ...] = field(default=())
    """What went wrong, the newest last."""

    @property
    def is_changed(self) -> bool:
        """Whether there is something to save."""
        return self.project is not self.saved and self.project.parameters != self.saved.parameters
