"""The project itself: what it is called, and where a copy of it is saved."""

from __future__ import annotations

from pathlib import Path

from viser import GuiApi

from commission.app.base import actions
from commission.app.base.panel import Post, posting, write
from commission.site.project import Project


class ProjectFields:
    """A folder of widgets."""

    def __init__(self, gui: GuiApi, post: Post, project: Project) -> None:
        with gui.add_folder("Project", expand_by_default=False):
            self._name = gui.add_text("Name", project.name, hint="As the bar at the top shows it.")
            self._name.on_update(
                posting(post, lambda event: actions.RenameProject(str(event.target.value), event.client_id))
            )
            folder = gui.add_text("Copy into", "", hint="Path of a folder on the computer that serves this page.")
            save = gui.add_button(
                "Save a copy", color="gray", hint="Write the project there; from then on it is kept there."
            )
        save.on_click(
            posting(
                post,
                lambda _event: (
                    actions.Save(Path(folder.value.strip()).expanduser())
                    if folder.value.strip()
                    else actions.Report("no folder was named; expected the path of a folder")
                ),
            )
        )

    def show(self, project: Project) -> None:
        """Follow undo and other browsers."""
        write(self._name, project.name)
