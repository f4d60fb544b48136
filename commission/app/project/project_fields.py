"""The project itself: what it is called, and where a copy of it is saved."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import actions
from commission.app.base.inputs import show, write_html
from commission.app.base.panel import BasePanel, Post, escaped, posting, write
from commission.app.base.reach import typed_path
from commission.app.base.view import PageView
from commission.app.project.actions import AskToReplace, KeepOther, RenameProject, Save
from commission.app.project.state import FilesState
from commission.site.project import Project


class ProjectFields(BasePanel):
    """Name of the project, and a copy of it."""

    def __init__(self, gui: GuiApi, post: Post, project: Project) -> None:
        self._shown: Project | None = None
        self._name = gui.add_text("Name", project.name, hint="As the bar at the top shows it.")
        self._name.on_update(posting(post, lambda event: RenameProject(str(event.target.value))))
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

        self._question = gui.add_html("", visible=False)
        self._answers = (
            gui.add_button("Replace it", color="red", hint="Write the copy over what lies there.", visible=False),
            gui.add_button("Keep it", color="gray", hint="Write nothing.", visible=False),
        )
        self._asked: AskToReplace | None = None
        replace, keep = self._answers
        replace.on_click(posting(post, lambda _event: self._replace()))
        keep.on_click(posting(post, lambda _event: KeepOther()))

    def _replace(self) -> actions.Action:
        return KeepOther() if self._asked is None else Save(self._asked.folder, overwrite=True)

    def draw_slowly(self, view: PageView) -> None:
        """Follow undo and other browsers, but not while a name is typed."""
        project = view.state.project
        if project is not self._shown:
            self._shown = project
            write(self._name, project.name)
        self._asked = asked = view.state.part(FilesState).question
        text = "" if asked is None else f"{escaped(asked.folder)} holds {escaped(asked.holds)}. Replace it?"
        write_html(self._question, text and f"<div class='c-note' style='padding:2px 6px'>{text}</div>")
        for answer in self._answers:
            show(answer, visible=asked is not None)
