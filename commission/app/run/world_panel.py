"""Inputs of what is true in a virtual drive: faults, noise of the wheels, constant errors; made from their fields.

People are asked for beside the drive itself. Shiny objects, tilted stretches and errors of single scanners are lists,
which the project's file holds.
"""

from __future__ import annotations

from typing import Any

from viser import GuiApi

from commission.app.base.inputs import Inputs
from commission.app.base.panel import BasePanel, Post
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.run.actions import SetDisturbance
from commission.site.disturbances import Disturbances
from commission.site.fields import fields_of, get_field, names_of
from commission.site.quantity import Group

ELSEWHERE = ("people",)
"""Fields whose widget is in another panel."""


class WorldPanel(BasePanel):
    """A widget for each number of the disturbances, groups in folders of their own; the drive is made again.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    state : the page's state at first.
    """

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        disturbances, fields = state.project.disturbances, fields_of(Disturbances)
        self._inputs = Inputs(gui, post, SetDisturbance, value_of)
        gui.add_html(
            "<div class='c-note' style='padding:2px 6px'>Acts on the virtual drive: it is simulated again.</div>"
        )
        for name in names_of(Disturbances):
            if name not in ELSEWHERE and not isinstance(fields[name].descriptions[0], Group):
                self._inputs.field(name, disturbances, f"(disturbances.{name})")
        for name, info in fields.items():
            if info.descriptions and isinstance(info.descriptions[0], Group):
                with gui.add_folder(info.label, expand_by_default=False):
                    for inner in names_of(info.kind):
                        self._inputs.field(f"{name}.{inner}", disturbances, f"(disturbances.{name}.{inner})")

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project."""
        self._inputs.follow(view.state)


def value_of(state: AppState, name: str) -> Any:
    """Return a value of the virtual world by its dotted name in the disturbances."""
    return get_field(state.project.disturbances, name)
