"""Directions of plates that wait for a yes or no: found from the walls, each browser's own; nothing has changed yet."""

from __future__ import annotations

from dataclasses import dataclass

from commission.site.editing.facing import Faced
from commission.site.project import Project


@dataclass(frozen=True, slots=True, eq=False)
class Facing:
    """What one browser looks at before it accepts it."""

    found: Faced | None = None
    """The plates; none: nothing waits."""
    project: Project | None = None
    """What they were found in."""

    def of(self, project: Project) -> Faced | None:
        """Return what waits; nothing once reflectors or walls are others than those that it was found for."""
        before = self.project
        if before is None or before.reflectors is not project.reflectors or before.floor_map is not project.floor_map:
            return None
        return self.found
