"""Inputs of the selected tag, as part of the selection's panel."""

from __future__ import annotations

from typing import Any

from viser import GuiApi

from commission.app.base.inputs import Inputs, show
from commission.app.base.panel import Post, posting
from commission.app.base.state import AppState
from commission.app.editing import tag_actions as actions
from commission.app.editing.editor import editor_of
from commission.app.editing.tag_gestures import tag_of
from commission.site.fields import get_field, names_of
from commission.site.tags import Tag


class TagFields:
    """Id, pose, how well it is surveyed, and a button."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser, self._shown = browser, ""
        self._inputs = Inputs(gui, post, actions.SetTag, self._read)
        self._folder = gui.add_folder("Tag", visible=False)
        with self._folder:
            example = Tag(id="T1", x=0.0, y=0.0)
            for name in names_of(Tag):
                self._inputs.field(name, example)
            delete = gui.add_button("Delete the tag", color="gray")
            delete.on_click(posting(post, lambda _event: actions.DeleteTag()))

    def _read(self, state: AppState, name: str) -> Any:
        """Return a value of the selected tag; None without one."""
        tag = tag_of(state.project, editor_of(state, self._browser))
        return None if tag is None else get_field(tag, name)

    def show(self, state: AppState) -> None:
        """Show the selected tag."""
        tag = tag_of(state.project, editor_of(state, self._browser))
        show(self._folder, visible=tag is not None)
        if tag is not None and tag.id != self._shown:
            self._inputs.forget()
        self._shown = "" if tag is None else tag.id
        self._inputs.follow(state)
