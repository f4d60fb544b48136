"""The command `problems`: what is wrong with a site, and plates of unknown direction turned away from their walls."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from commission.errors import UsageError


@dataclass(frozen=True, kw_only=True)
class Problems:
    """Tell what is wrong with a site: reflectors, routes, stations, scanners and the floor map, errors first."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    face_from_walls: bool = False
    """Whether plates of unknown direction that hang on a wall are turned away from it, in the project of --out."""
    out: Annotated[Path | None, arg(metavar="PROJECT2")] = None
    """Folder for the project with these directions; made when it does not exist. None: only with --face-from-walls."""
    force: bool = False
    """Whether a project that is in PROJECT2 already is replaced."""

    def run(self) -> None:
        """Check and tell; with --face-from-walls of what was written."""
        from commission.io.project_copy import refuse_to_replace, save_copy
        from commission.io.project_file import load_project
        from commission.site.editing.facing import faced_from_walls, said_of
        from commission.studies.problems import ProblemsInput, errors_first, problems
        from commission.studies.sight import SightInput, sight

        if self.face_from_walls is (self.out is None):
            raise UsageError("expected --face-from-walls and --out PROJECT2 together, or none of them")
        if self.out is not None:
            if self.out.resolve() == self.project.resolve():
                raise UsageError(f"--out is the project itself, {self.out}; expected another folder")
            refuse_to_replace(self.out, force=self.force)
        project, lines = load_project(self.project), list[str]()
        if self.out is not None:
            if project.floor_map is None:
                raise UsageError(f"{self.project} has no floor map to take directions from; expected one")
            faced = faced_from_walls(project.reflectors, project.floor_map)
            project = dataclasses.replace(project, reflectors=faced.reflectors)
            kept = save_copy(project, self.out, force=self.force)
            lines.append(f"Plates       {said_of(faced)}")
            if kept is not None:
                lines.append(f"Note         unsaved edits of the project that was there are kept in {kept}")
            lines.append(f"Written to   {self.out}")
        found = errors_first((*problems(ProblemsInput.of(project)).problems, *sight(SightInput.of(project)).problems))
        lines += [f"{each.severity.value.capitalize():12} {each.text}" for each in found]
        sys.stdout.write("\n".join(lines or ["Problems     none"]) + "\n")
