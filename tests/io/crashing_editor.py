"""An editor that is killed: random edits and saves, each told to its parent as soon as it is promised to be safe."""

from __future__ import annotations

import random
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from commission.geometry import spline_kernels
from commission.io.journal import Journal, restore
from commission.io.project_file import load_project
from commission.site.editing import reflectors as edits
from commission.site.editing import routes
from commission.site.floor_map import OCCUPIED
from commission.site.project import Project
from commission.site.reflectors import Reflector

# Compiled (or loaded) once in the server that forks the editors, and not anew in each of them.
spline_kernels.warm_up()


def random_edit(project: Project, number: int, rng: random.Random) -> Project:
    """Edit one part of a project; its name counts the edits."""
    project = replace(project, name=f"edit {number}")
    ids = [r.id for r in project.reflectors.reflectors]
    kind = rng.randrange(4)
    if kind == 0 or not ids:
        added = edits.add(project.reflectors, [[rng.random() * 9, 1.0]], Reflector("R1", 0.0, 0.0))
        return replace(project, reflectors=added.reflectors)
    if kind == 1:
        chosen = rng.sample(ids, min(2, len(ids)))
        return replace(project, reflectors=edits.move(project.reflectors, chosen, (rng.random(), 0.1)))
    if kind == 2 and project.floor_map is not None:
        cells = np.array(project.floor_map.cells)
        cells[rng.randrange(len(cells)), :3] = OCCUPIED
        return replace(project, floor_map=replace(project.floor_map, cells=cells))
    route = routes.new_route(routes.fresh_name(project.routes), [[0, 0], [rng.random() + 1, 2], [4, 4]])
    return replace(project, routes=(*project.routes[-5:], route))


def edit_until_killed(folder: Path, seed: int, told: Connection) -> None:
    """Start like the program does, then edit; after each edit its number is sent."""
    rng = random.Random(seed)
    project = load_project(folder)
    journal = Journal(folder, project)
    restored = restore(folder, project)
    if restored is not None:
        assert not restored.foreign_changes
        project = restored.project
        journal.append(project, "Restore")
    for number in range(int(project.name.split()[-1]) + 1, 1_000_000):
        project = random_edit(project, number, rng)
        journal.append(project, f"Edit {number}")
        told.send(number)
        if rng.random() < 0.1:
            journal.save(project)
