"""An editor that is killed: random edits and saves, each told to its parent before it is made and once it is safe."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from commission.geometry import spline_kernels
from commission.io.journal import Journal
from commission.io.journal_replay import restore
from commission.io.project_file import load_project
from commission.site.editing import reflectors as edits
from commission.site.editing import routes
from commission.site.editing.named import ROUTES, STATIONS
from commission.site.floor_map import FREE, OCCUPIED
from commission.site.presets import SCANNERS, with_preset
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind
from commission.site.routes import Direction
from commission.site.stations import Station
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle

# Compiled (or loaded) once in the server that forks the editors, and not anew in each of them.
spline_kernels.warm_up()

SAVED_SHARE = 0.25
"""Share of the edits after which the project is saved: that takes longer than an edit, so many kills fall into it."""
MOST = 12
"""Things of a kind that a project keeps: the oldest ones go."""


def random_edit(project: Project, number: int, rng: random.Random) -> Project:
    """Edit one part of a project; its name counts the edits."""
    return rng.choice(EDITS)(replace(project, name=f"edit {number}"), rng)


def _reflectors(project: Project, rng: random.Random) -> Project:
    """Add, move, delete, mirror, lock or describe reflectors."""
    reflectors, ids = project.reflectors, [r.id for r in project.reflectors.reflectors]
    if not ids or rng.random() < 0.4:
        like = Reflector(id="R1", x=0.0, y=0.0, kind=rng.choice(list(ReflectorKind)))
        return replace(project, reflectors=edits.add(reflectors, [[rng.random() * 9, 1.0]], like).reflectors)
    chosen = rng.sample(ids, min(2, len(ids)))
    changed = rng.choice(
        (
            lambda: edits.move(reflectors, chosen, (rng.random(), 0.1)),
            lambda: edits.delete(reflectors, chosen) if len(ids) > MOST else reflectors,
            lambda: edits.mirror(reflectors, chosen, edits.Axis(1.0, 1.0, rng.random())),
            lambda: edits.set_locked(reflectors, chosen, rng.random() < 0.3),
            lambda: edits.set_value(
                edits.set_value(reflectors, chosen, "note", f"<{rng.random()}>; ä"), chosen, "height", rng.random()
            ),
        )
    )
    return replace(project, reflectors=changed())


def _routes(project: Project, rng: random.Random) -> Project:
    """Draw a route, or bend, reverse and slow down the last one."""
    if not project.routes or rng.random() < 0.4:
        route = routes.new_route(ROUTES.fresh(project.routes), [[0, 0], [rng.random() + 1, 2], [4, 4]])
        return replace(project, routes=(*project.routes[-MOST:], route))
    route = project.routes[-1]
    changed = routes.move_point(route, 0, 1, (rng.random(), rng.random()))
    changed = routes.set_value(changed, 0, "direction", rng.choice(list(Direction)))
    return replace(
        project,
        routes=ROUTES.put(project.routes, routes.set_value(changed, 0, "speed", rng.random() + 0.1), route.name),
    )


def _stations(project: Project, rng: random.Random) -> Project:
    """Put a station, or take the first one away."""
    kept = project.stations[-MOST:]
    if kept and rng.random() < 0.3:
        return replace(project, stations=STATIONS.remove(kept, kept[0].name))
    station = Station(
        name=STATIONS.fresh(kept),
        x=rng.random(),
        y=rng.random(),
        heading=rng.random(),
        required_accuracy=0.01 + rng.random(),
    )
    return replace(project, stations=STATIONS.put(kept, station))


def _equipment(project: Project, rng: random.Random) -> Project:
    """Use another vehicle or another scanner."""
    if rng.random() < 0.5:
        return replace(project, scanners=(with_preset(project.scanners[0], rng.choice(SCANNERS).name),))
    kinds = (DifferentialVehicle, TricycleVehicle, OmnidirectionalVehicle)
    return replace(project, vehicle=rng.choice(kinds)(height=0.1 + rng.random()))


def _parameters(project: Project, rng: random.Random) -> Project:
    """Change a tunable."""
    parameters = project.parameters
    association = replace(parameters.association, gate_probability=0.5 + 0.4 * rng.random())
    return replace(project, parameters=replace(parameters, association=association))


def _floor_map(project: Project, rng: random.Random) -> Project:
    """Draw or erase a wall."""
    if project.floor_map is None:
        return project
    cells = np.array(project.floor_map.cells)
    cells[rng.randrange(len(cells)), :3] = rng.choice((OCCUPIED, FREE))
    return replace(project, floor_map=replace(project.floor_map, cells=cells))


EDITS: tuple[Callable[[Project, random.Random], Project], ...] = (
    _reflectors,
    _reflectors,
    _routes,
    _stations,
    _equipment,
    _parameters,
    _floor_map,
)


def edit_until_killed(folder: Path, seed: int, told: Connection) -> None:
    """Start like the program does, then edit: each project is sent before its edit is made, `None` once it is safe."""
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
        told.send(project)
        journal.append(project, f"Edit {number}")
        told.send(None)
        if rng.random() < SAVED_SHARE:
            journal.save(project)
