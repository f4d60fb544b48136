"""A page that is killed while somebody edits: how old the edits are that it loses.

The real owner thread with journal, lock and save, without a browser. Each edit is told to the parent just before it is
asked for; both read one clock, so that the age of a lost edit is measured from the moment of the click.
"""

from __future__ import annotations

import multiprocessing
import pickle
import random
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from commission.app.base.actions import Action, Envelope, Join, Sender
from commission.app.base.effects import Effect
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.base.view import PageView
from commission.app.launch import FEATURES
from commission.app.project.actions import Save
from commission.app.project.state import FilesState
from commission.app.runtime import Runtime
from commission.io.journal_replay import restore
from commission.io.project_file import load_project, save_project
from commission.site.fields import in_file
from commission.site.floor_map import FREE, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from tests.io.crashing_editor import random_edit

ME = 1
PACE_S = (0.05, 1.5)
"""Time between two edits of a person [s]."""
LIFE_S = (0.2, 4.0)
"""Time until a page that a person edits is killed [s]."""
STORM_LIFE_S = (0.05, 1.0)
SAVED_SHARE = 0.25
STARTED_WITHIN_S = 120.0
"""Time in which a page is there, on a busy computer [s]."""


@dataclass(frozen=True, slots=True)
class Become(Action):
    """Any edit of the project."""

    project: Project
    name: str


@reduce.register
def become(action: Become, state: AppState, sender: Sender) -> Outcome:
    return Outcome(edited(state, action.project, Edit(action.name, sender)))


class NoPage:
    """Draws nothing."""

    def show_site(self, state: AppState) -> None:
        pass

    def draw(self, view: PageView, *, slowly: bool) -> None:
        pass

    def carry_out(self, effect: Effect, sender: Sender) -> None:
        pass

    def connected(self, browser: int) -> None:
        pass

    def disconnected(self, browser: int) -> None:
        pass


def edit_a_page_until_killed(folder: Path, seed: int, storm: bool, told: Connection) -> None:
    """Open the page as the program does, and edit: what is told is the time of the click and the project after it."""
    rng = random.Random(seed)
    loaded = load_project(folder)
    state = AppState(project=loaded, saved=loaded, folder=folder)
    runtime = Runtime(state, [each for each in FEATURES if each.name in ("base", "project", "editing", "floor_map")])
    runtime.start(NoPage())
    ask(runtime, Join())
    while ME not in runtime.state.browsers:
        time.sleep(0.001)
    assert not runtime.state.read_only
    assert not runtime.state.part(FilesState).foreign
    project = runtime.state.project
    told.send((time.monotonic(), project))
    for number in range(int(project.name.split()[-1]) + 1, 1_000_000):
        if not storm:
            time.sleep(rng.uniform(*PACE_S))
        project = random_edit(project, number, rng)
        told.send((time.monotonic(), project))
        ask(runtime, Become(project, f"edit {number}"))
        if rng.random() < SAVED_SHARE:
            ask(runtime, Save())
        while storm and runtime.state.project is not project:
            time.sleep(0.0001)


def ask(runtime: Runtime, action: Action) -> None:
    runtime.post(Envelope(action, Sender(ME, time.monotonic())))


@dataclass
class Toll:
    """What some kills have cost."""

    kills: int = 0
    edits: int = 0
    """Edits that were asked for."""
    lost_ages: list[float] = field(default_factory=list)
    """Age of each edit that was lost, when its page was killed [s]."""

    def add(self, other: Toll) -> None:
        """Count those of another one, too."""
        self.kills += other.kills
        self.edits += other.edits
        self.lost_ages += other.lost_ages

    def __str__(self) -> str:
        """Say it on one line."""
        oldest = f", the oldest {1e3 * max(self.lost_ages):.1f} ms old" if self.lost_ages else ""
        return f"{self.kills} kills, {self.edits} edits, {len(self.lost_ages)} lost{oldest}"


def kill_pages(folder: Path, kills: int, seed: int, *, storm: bool) -> Toll:
    """Edit one project and kill the program that does it, so often; fail where what is restored was never made."""
    project = Project(
        name="edit 0",
        floor_map=FloorMap(np.full((20, 30), FREE, np.int8), 0.1),
        reflectors=ReflectorMap((Reflector(id="A", x=1.0, y=1.0),)),
    )
    save_project(project, folder)
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    rng, toll = random.Random(seed), Toll(kills)
    for number in range(kills):
        receiver, sender = context.Pipe(duplex=False)
        arguments = (folder, 1000 * seed + number, storm, sender)
        child = context.Process(target=edit_a_page_until_killed, args=arguments)
        child.start()
        sender.close()
        assert receiver.poll(STARTED_WITHIN_S)
        end = time.monotonic() + rng.uniform(*(STORM_LIFE_S if storm else LIFE_S))
        asked = list(heard(receiver, end))
        child.kill()
        killed_at = time.monotonic()
        child.join()
        asked += heard(receiver, killed_at + 1.0)
        toll.edits += len(asked) - 1
        # The page began with all that was restored before.
        assert asked[0][1] == project, "a page began with another project than was restored"
        project = found_in(folder)
        places = [place for place, (_, made) in enumerate(asked) if made.name == project.name]
        assert places, f"{project.name} was never made"
        made = asked[places[0]][1]
        # What was saved is rounded as files are.
        assert project in (made, in_file(made)), f"{project.name} was restored, but is not as it was made"
        toll.lost_ages += [killed_at - at for at, _ in asked[places[0] + 1 :]]
    return toll


def found_in(folder: Path) -> Project:
    """What the next start would show."""
    found = load_project(folder)
    restored = restore(folder, found)
    if restored is None:
        return found
    assert not restored.damage, restored.damage
    assert not restored.foreign_changes
    return restored.project


def heard(receiver: Connection, end: float) -> Iterator[tuple[float, Project]]:
    """What a page tells until a time, or until it is gone."""
    try:
        while receiver.poll(max(0.0, end - time.monotonic())):
            yield receiver.recv()
    except (EOFError, OSError, pickle.UnpicklingError):
        # Killed in the middle of a word.
        return
