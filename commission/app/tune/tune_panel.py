"""Every tunable of the localizer, and how well constants are known: a widget for each, from its field.

The page shows degrees, millimetres and percent; actions carry SI and radians.
"""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiInputHandle

from commission.app.base.field_widget import Tail, add_widget, held, meant, write_held, write_saved
from commission.app.base.inputs import Inputs
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.tune.actions import ResetParameters, SetParameter, SetUncertainty
from commission.site.fields import FieldInfo, fields_of, get_field, names_of
from commission.site.parameters import Parameters
from commission.site.uncertainty import Uncertainty

FIRST = ("association", "detector", "supervisor")
"""Groups that are tuned first; the others follow in their own order."""
FOLDED = ("odometry",)
"""Groups that begin folded."""


class TunePanel(BasePanel):
    """Widgets of all parameters, and a button that resets them.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    state : the page's state at first.
    """

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        self._gui, self._post = gui, post
        self._widgets: dict[str, GuiInputHandle[Any]] = {}
        self._infos: dict[str, FieldInfo] = {}
        self._tails: dict[str, Tail] = {}
        self._saved: Parameters | None = None
        self._shown: Parameters | None = None
        self._held: dict[str, Any] = {}
        groups = fields_of(Parameters)
        for name in (*FIRST, *(name for name in groups if name not in FIRST)):
            with gui.add_folder(groups[name].label, expand_by_default=name not in FOLDED):
                self._add_group(name, getattr(state.project.parameters, name))
        self._constants = Inputs(gui, post, SetUncertainty, _constant)
        with gui.add_folder("Constants known to"):
            for name in names_of(Uncertainty):
                self._constants.field(name, state.project.uncertainty, f"(uncertainty.{name})")
        reset = gui.add_button("Reset to saved", color="gray", hint="Back to the parameters of project.yaml.")
        reset.on_click(posting(post, lambda _event: ResetParameters()))

    def _add_group(self, group: str, values: object) -> None:
        """Add a widget for each field of a group of parameters."""
        # Switches first: what they switch off follows.
        infos = sorted(fields_of(type(values)).values(), key=lambda info: info.name != "enabled")
        for info in infos:
            key = f"{group}.{info.name}"
            widget = add_widget(self._gui, info, getattr(values, info.name), f"({key})")
            widget.on_update(
                posting(
                    self._post,
                    lambda event, key=key, info=info: SetParameter(key, meant(info, event.target.value)),
                )
            )
            self._widgets[key], self._infos[key] = widget, info
            if info.quantity is not None and info.quantity.is_tail:
                self._tails[key] = Tail(self._gui, info.quantity, widget)

    def draw_slowly(self, view: PageView) -> None:
        """Follow undo, redo and reset; while somebody moves a slider, leave it alone."""
        self._mark(view.state.saved.parameters)
        if view.state.last_edit is None:
            self.show(view.state.project.parameters)
            self._constants.follow(view.state)

    def _mark(self, saved: Parameters) -> None:
        """Put a tick on each slider where the saved project has it."""
        if saved is self._saved:
            return
        self._saved = saved
        for key, widget in self._widgets.items():
            content = held(self._infos[key], get_field(saved, key))
            if key in self._tails:
                self._tails[key].write_saved(content)
            else:
                write_saved(widget, content)

    def show(self, parameters: Parameters) -> None:
        """Set every widget."""
        is_same = parameters is self._shown
        if not is_same:
            self._shown = parameters
            self._held = {key: held(info, get_field(parameters, key)) for key, info in self._infos.items()}
        for key, widget in self._widgets.items():
            # What was refused is in a widget and not in the parameters.
            if not is_same or widget.value != self._held[key]:
                write_held(widget, self._held[key])


def _constant(state: AppState, name: str) -> Any:
    """Return the 1-sigma of a constant of the project."""
    return get_field(state.project.uncertainty, name)
