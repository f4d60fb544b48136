"""The project itself: what it is called, and where a copy of it is saved."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import actions, theme
from commission.app.base.panel import BasePanel, Post, posting, write
from commission.app.base.reach import typed_path
from commission.app.base.view import PageView
from commission.app.project.actions import RenameProject, Save
from commission.site.project import Project


class ProjectFields(BasePanel):
    """Name of the project, and a copy of it."""

    def __init__(self, gui: GuiApi, post: Post, project: Project) -> None:
        self._shown: Project | None = None
        self._name = gui.add_text("Name", project.name, hint="As the bar at the top shows it.")
        self._name.on_update(posting(post, lambda event: RenameProject(str(event.target.value))))
        gui.add_html(theme.path_mark("folder"))
        folder = gui.add_text("Copy into", "", hint="Path of a folder on the computer that serves this page.")
        save = gui.add_button(
            "Save a copy", color="gray", hint="Write the project there; from then on it is kept there."
        )
        save.on_click(
            posting(
                post,
                lambda _event: (
                    Save(typed_path(folder.value))
                    if folder.value.strip()
                    else actions.Report("no folder was named; expected the path of a folder")
                ),
            )
        )

    def draw_slowly(self, view: PageView) -> None:
        """Follow undo and other browsers, but not while a name is typed."""
        project = view.state.project
        if project is not self._shown:
            self._shown = project
            write(self._name, project.name)
