"""The command `align`: a project onto the plant's coordinates by surveyed points, with what each is off by."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg


@dataclass(frozen=True, kw_only=True)
class Align:
    """Move and turn a project onto the plant's coordinates by points that a total station measured, with residuals."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    points: Annotated[Positional[Path], arg(metavar="POINTS")]
    """Table of name, x, y in the plant [m, or the unit in its header]; names are those of reflectors, stations, or of
    --on-map."""
    on_map: Annotated[Path | None, arg(metavar="TABLE")] = None
    """Table of name, x, y on the map [m, or the unit in its header] of surveyed points that are neither: corners,
    columns, marks on the floor."""
    out: Annotated[Path, arg(metavar="PROJECT2")]
    """Folder for the aligned project; made when it does not exist."""
    force: bool = False
    """Whether another project in PROJECT2 is overwritten."""

    def run(self) -> None:
        """Align, tell each residual, and write."""
        from commission.errors import UsageError
        from commission.io.plant_points import read_surveyed
        from commission.io.project_copy import refuse_to_replace, save_copy
        from commission.io.project_file import load_project
        from commission.site.editing.alignment import moved_onto
        from commission.site.editing.plant_check import check_points, worst_of
        from commission.site.editing.plant_fit import fit_points, pairs_of
        from commission.site.quantity import DEGREES, MILLIMETRES

        if self.out.resolve() == self.project.resolve():
            raise UsageError(f"--out is the project itself, {self.project}; expected another folder")
        refuse_to_replace(self.out, force=self.force)
        project = load_project(self.project)
        pairs, unknown = pairs_of(
            project, read_surveyed(self.points), read_surveyed(self.on_map) if self.on_map else ()
        )
        found = fit_points(pairs)
        save_copy(moved_onto(project, found.T_plant_map, everything=True), self.out, force=self.force)
        x, y, turn = found.T_plant_map.tolist()
        lines = [f"Moved        {x:.4f}, {y:.4f} m, turned by {DEGREES.text(turn, '.4f')}, by {len(pairs)} points"]
        checks = check_points(found)
        worst = worst_of(checks)
        for check in checks:
            dx, dy = check.residual
            each = f"{MILLIMETRES.number(dx, '+.1f')}, {MILLIMETRES.text(dy, '+.1f')}"
            told = f"{check.pair.name}: {each} ({MILLIMETRES.text(check.off, '.1f')}), 1-sigma {_mm(check.sigma)}"
            without = f"the others miss it by {_mm(check.left_out)}, 1-sigma {_mm(check.left_out_sigma)}"
            lines.append(f"Off          {told}; {without}{'; the worst' if check is worst else ''}")
        lines.append(f"RMS          {MILLIMETRES.text(found.rms, '.1f')}; distances in the plant x {found.scale:.5f}")
        lines += [f"Note         {name} stands out: look at it, or leave it out" for name in found.striking]
        lines += [
            f"Note         no reflector, station or point of --on-map is called {name}: left out" for name in unknown
        ]
        sys.stdout.write("\n".join([*lines, f"Written to   {self.out}"]) + "\n")


def _mm(length: float) -> str:
    """Return a length [m] in millimetres, or that it is not known: too few points."""
    from commission.site.quantity import MILLIMETRES

    return "unknown" if math.isnan(length) else MILLIMETRES.text(length, ".1f")
