"""Inputs of the camera that sees tags; they are there where the site has tags."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.inputs import Inputs, show
from commission.app.base.panel import BasePanel, Post
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.site.fields import get_field, names_of
from commission.site.project import Project
from commission.site.tags import TagCamera


class CameraFields(BasePanel):
    """The folder of the camera."""

    def __init__(self, gui: GuiApi, post: Post, project: Project) -> None:
        self._shown: Project | None = None
        self._inputs = Inputs(gui, post, actions.SetEquipment, lambda state, name: get_field(state.project, name))
        self._folder = gui.add_folder("Tag camera", expand_by_default=False, visible=bool(project.tags))
        with self._folder:
            for name in names_of(TagCamera):
                self._inputs.field(f"tag_camera.{name}", project)

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project."""
        project = view.state.project
        if project is self._shown:
            return
        self._shown = project
        show(self._folder, visible=bool(project.tags))
        self._inputs.follow(view.state)
