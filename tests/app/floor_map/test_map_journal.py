"""A new project of which nothing was saved yet survives a crash with every edit of its map."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from commission.app.base import actions as page
from commission.app.base.actions import PROGRAM, ClickFloor, DragFloor
from commission.app.base.state import NOTHING_SAVED, AppState
from commission.app.editing import actions as editing
from commission.app.editing.site_tools import PlaceTool
from commission.app.floor_map import actions
from commission.app.floor_map.align_tool import AlignTool
from commission.app.floor_map.draft import MapFile
from commission.app.floor_map.tools import EraseTool, ObstacleTool, WallTool
from commission.app.project.project_folder import ProjectFolder
from commission.io.journal_replay import restore
from commission.io.project_file import load_project, open_project
from commission.site.fields import in_file
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from tests.app.asking import after, joined
from tests.app.owning import Owner

REACH = 0.1


def hall() -> FloorMap:
    cells = np.full((200, 300), FREE, np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = (OCCUPIED,) * 4
    return FloorMap(cells, 0.05)


WISHES: tuple[page.Action, ...] = (
    actions.MapMade(MapFile(Path("hall.yaml")), hall()),
    editing.ChooseTool(WallTool()),
    ClickFloor((2.0, 2.0), REACH),
    ClickFloor((6.0, 4.0), REACH),
    editing.Finish(),
    editing.ChooseTool(EraseTool()),
    DragFloor(phase="end", start=(5.0, 3.0), now=(7.0, 5.0), reach=REACH),
    editing.ChooseTool(PlaceTool()),
    ClickFloor((3.0, 6.0), REACH),
    editing.ChooseTool(AlignTool()),
    ClickFloor((1.0, 1.0), REACH),
    ClickFloor((11.0, 1.0), REACH),
    actions.SetPlantPoint(0, (50.0, 7.0)),
    actions.SetPlantPoint(1, (50.0, 17.0)),
    actions.SetAligned(everything=True),
    actions.AlignMap(),
    editing.ChooseTool(ObstacleTool()),
    DragFloor(phase="end", start=(45.0, 10.0), now=(46.0, 11.0), reach=REACH),
    page.Undo(),
    page.Undo(),
    page.Redo(),
)


def test_every_edit_of_the_map_survives_a_crash_before_the_first_save(tmp_path: Path) -> None:
    folder = tmp_path / "hall"
    opened = open_project(folder)
    state = joined(AppState(project=opened.project, saved=NOTHING_SAVED, folder=folder))
    files = Owner(ProjectFolder, state).service
    for wish in WISHES:
        before = state.project
        state = after(state, wish).state
        if state.project is before:
            continue
        files.note(state.project, type(wish).__name__)
        # The program is killed here.
        restored = restore(folder, open_project(folder).project)
        assert restored is not None
        assert restored.project == state.project
    assert sorted(path.name for path in folder.iterdir()) == [".commission.journal", ".commission.lock"]
    # One whole map, and rectangles of it.
    assert (folder / ".commission.journal").stat().st_size < 20_000
    files.save(state.project, folder, overwrite=False, sender=PROGRAM)
    files.wait(60.0)
    assert load_project(folder) == in_file(state.project)
    assert restore(folder, load_project(folder)) is None
    files.close()
