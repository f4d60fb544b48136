"""A new project of which nothing was saved yet survives a crash with every edit of its map."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from commission.app.base import actions as page
from commission.app.base import reducer
from commission.app.base.state import NOTHING_SAVED, AppState
from commission.app.editing import actions as editing
from commission.app.editing.editor import Tool
from commission.app.floor_map import actions
from commission.app.floor_map.draft import MapFile
from commission.app.project.project_folder import Keeping
from commission.io.journal_replay import restore
from commission.io.project_file import load_project, open_project
from commission.site.floor_map import FREE, OCCUPIED, FloorMap

ME, REACH = 1, 0.1


def hall() -> FloorMap:
    cells = np.full((200, 300), FREE, np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = (OCCUPIED,) * 4
    return FloorMap(cells, 0.05)


WISHES: tuple[page.Action, ...] = (
    actions.MapMade(ME, MapFile(Path("hall.yaml")), hall()),
    editing.ChooseTool(ME, Tool.WALL),
    editing.ClickFloor(ME, (2.0, 2.0), REACH),
    editing.ClickFloor(ME, (6.0, 4.0), REACH),
    editing.Finish(ME),
    editing.ChooseTool(ME, Tool.ERASE),
    editing.DragFloor(ME, "end", (5.0, 3.0), (7.0, 5.0), REACH),
    editing.ChooseTool(ME, Tool.PLACE),
    editing.ClickFloor(ME, (3.0, 6.0), REACH),
    editing.ChooseTool(ME, Tool.ALIGN),
    editing.ClickFloor(ME, (1.0, 1.0), REACH),
    editing.ClickFloor(ME, (11.0, 1.0), REACH),
    actions.SetPlantPoint(ME, 0, (50.0, 7.0)),
    actions.SetPlantPoint(ME, 1, (50.0, 17.0)),
    actions.SetAligned(ME, everything=True),
    actions.AlignMap(ME),
    editing.ChooseTool(ME, Tool.OBSTACLE),
    editing.DragFloor(ME, "end", (45.0, 10.0), (46.0, 11.0), REACH),
    page.Undo(ME),
    page.Undo(ME),
    page.Redo(ME),
)


def test_every_edit_of_the_map_survives_a_crash_before_the_first_save(tmp_path: Path) -> None:
    folder = tmp_path / "hall"
    opened = open_project(folder)
    keeping = Keeping(opened.folder, opened.project)
    state = reducer.reduce(editing.Join(ME), AppState(opened.project, NOTHING_SAVED, folder=folder)).state
    for wish in WISHES:
        before = state.project
        state = reducer.reduce(wish, state).state
        if state.project is before:
            continue
        keeping.note(state.project, type(wish).__name__)
        # The program is killed here.
        restored = restore(folder, open_project(folder).project)
        assert restored is not None
        assert restored.project == state.project
    assert [path.name for path in folder.iterdir()] == [".commission.journal"]
    # One whole map, and rectangles of it.
    assert (folder / ".commission.journal").stat().st_size < 20_000
    keeping.save(state.project, folder, False)
    assert load_project(folder) == state.project
    assert restore(folder, load_project(folder)) is None
    keeping.close()
