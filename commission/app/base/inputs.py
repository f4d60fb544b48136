"""Inputs that post one setting each and follow it, the progress of a job with its cancel button, and changing text."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

from viser import GuiApi, GuiButtonHandle, GuiInputHandle, GuiSliderHandle

from commission.app.base import theme
from commission.app.base.actions import Action, LookAgain
from commission.app.base.field_widget import add_widget, held, meant, write_held, write_saved
from commission.app.base.panel import Post, escaped, posting, write
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.base.viser_private import take_back_refusals, write_anew
from commission.site.fields import FieldInfo, field_info, get_field
from commission.site.project import Project
from commission.site.quantity import PERCENT

Setting: TypeAlias = bool | int | float | str | None
Read: TypeAlias = Callable[[AppState, str], Any]
Make: TypeAlias = Callable[[str, Setting], Action]


NOT_NOW = " – not now: "
"""Stands between what a button does and why it cannot be pressed."""


class Inputs:
    """Widgets of named settings; what a person changes is posted, what the state says is shown.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    make : from a setting's name and its new value (SI) to the action.
    read : a setting's value (SI) in a state.
    """

    def __init__(self, gui: GuiApi, post: Post, make: Make, read: Read) -> None:
        self._gui, self._post, self._make, self._read = gui, post, make, read
        self._widgets: list[tuple[GuiInputHandle[Any], Callable[[AppState], Any]]] = []
        self._marked: Project | None = None
        self._state: AppState | None = None
        self._settings: set[int] = set()
        self._followed: dict[int, object] = {}
        self._is_anew = False

    def connect(
        self,
        name: str,
        widget: GuiInputHandle[Any],
        meant: Callable[[Any], Any],
        shown: Callable[[AppState], Any],
    ) -> None:
        """Connect a widget.

        Parameters
        ----------
        name : of the setting.
        widget : shows it.
        meant : from what the widget shows to the setting's value, SI.
        shown : from a state to what the widget shows; None: it has nothing to show and stays as it is.
        """
        index = len(self._widgets)

        def asked(event: Any) -> Action:
            try:
                return self._make(name, meant(event.target.value))
            except ValueError:
                # What was refused does not stay in the widget.
                self._followed.pop(index, None)
                self._state = None
                raise

        widget.on_update(posting(self._post, asked))
        self._widgets.append((widget, shown))

    def field(self, name: str, of: object, note: str = "") -> GuiInputHandle[Any]:
        """Add the widget of a field, made from what is said beside it.

        Parameters
        ----------
        name : the field's dotted name, as `of` has it and as `make` and `read` take it.
        of : a value that has the field; the widget begins with what it has.
        note : what stands behind the hint.
        """
        info = field_info(of, name)
        widget = add_widget(self._gui, info, get_field(of, name), note)
        self._settings.add(len(self._widgets))
        self.connect(
            name,
            widget,
            lambda content: meant(info, content),
            lambda state: self._shown(info, self._read(state, name)),
        )
        return widget

    @staticmethod
    def _shown(info: FieldInfo, value: Any) -> Any:
        """Return what a widget shows for a value; None: nothing, unless there is a word for it."""
        has_word = info.quantity is not None and bool(info.quantity.none)
        return None if value is None and not has_word else held(info, value)

    def choice(self, name: str, of: object, names: Mapping[Any, str]) -> GuiInputHandle[Any]:
        """Add a list of what a field may be, each called by a name.

        Parameters
        ----------
        name : the field's dotted name, as `of` has it and as `make` and `read` take it.
        of : a value that has the field; the list begins with what it has.
        names : what each possible value is called, in the list's order.
        """
        info, first = field_info(of, name), get_field(of, name)
        meant = {text: value for value, text in names.items()}
        widget = self._gui.add_dropdown(info.label, tuple(meant), initial_value=names[first], hint=info.hint)
        self._settings.add(len(self._widgets))
        self.connect(name, widget, lambda text: meant[text], lambda state: names.get(self._read(state, name)))
        return widget

    def follow(self, state: AppState) -> None:
        """Set widgets to what the state says, each where that has changed: what is being typed is not yet in it."""
        is_same, self._state = state is self._state, state
        if self._is_anew:
            take_back_refusals(self._gui, (widget for widget, _ in self._widgets))
        for index, (widget, shown) in enumerate(self._widgets):
            if is_same and index in self._settings:
                continue
            value = shown(state)
            if value is not None and (index not in self._followed or self._followed[index] != value):
                self._followed[index] = value
                # What was refused is here, and what held before it on the page.
                is_here = self._is_anew and widget.value == value
                write_held(widget, value)
                if is_here:
                    write_anew(self._gui, widget)
        self._is_anew = False
        if state.saved is not self._marked:
            self._marked = state.saved
            as_saved = replace(state, project=state.saved)
            for widget, shown in self._widgets:
                if isinstance(widget, GuiSliderHandle):
                    write_saved(widget, shown(as_saved))

    def forget(self) -> None:
        """Write every widget anew when it follows next, whatever stands in it: it is another thing's from now on."""
        self._followed.clear()
        self._state = None
        self._is_anew = True


def add_find(gui: GuiApi, post: Post, hint: str) -> GuiInputHandle[str]:
    """Add a text that is sought in a list with every key.

    Parameters
    ----------
    gui, post : where it is made, what takes the action that draws the list again.
    hint : what it is part of.
    """
    gui.add_html(theme.LIVE)
    find = gui.add_text("Find", "", hint=hint)
    look_again_at(find, post)
    return find


def look_again_at(widget: GuiInputHandle[Any], post: Post) -> None:
    """Draw the page again when a widget changes that posts nothing else and says what is listed."""
    widget.on_update(posting(post, lambda _event: LookAgain()))


class WorkBar:
    """How far a job is, what it does, or what it waits for, with a button that cancels it; nothing without a job.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes the action.
    name : of the job.
    cancel : the action that cancels it, by not wanting its result any more.
    """

    def __init__(self, gui: GuiApi, post: Post, name: str, cancel: Action) -> None:
        self.name = name
        self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._note = gui.add_html("", visible=False)
        self._cancel = gui.add_button("Cancel", color="gray", visible=False)
        self._cancel.on_click(posting(post, lambda _event: cancel))

    def follow(self, view: PageView) -> bool:
        """Show how far the job is; return whether it runs."""
        job, waiting = (
            next((each for each in jobs if each.name == self.name), None) for jobs in (view.jobs, view.waiting)
        )
        show(self._bar, visible=job is not None)
        show(self._cancel, visible=job is not None or waiting is not None)
        note = ""
        if job is not None:
            write(self._bar, PERCENT.of(job.fraction))
            note = f"{job.does} {job.fraction:.0%}"
        elif waiting is not None:
            ahead = next((each for each in view.jobs if each.lane is waiting.lane), None)
            note = "waiting" if ahead is None else f"first: {ahead.name} {ahead.fraction:.0%}"
        write_html(self._note, note and f"<div class='c-note' style='padding:2px 6px'>{escaped(note)}</div>")
        return job is not None


class Text:
    """Html that is made anew only where what it is made from has changed, and hidden while there is none.

    Parameters
    ----------
    gui : where it is made.
    order : where it stands among the other widgets; none: behind those that there are.
    """

    def __init__(self, gui: GuiApi, order: float | None = None) -> None:
        self._html = gui.add_html("", visible=False, order=order)
        self._source: object = None

    def write(self, source: object, make: Callable[[], str]) -> None:
        """Write what `make` returns, unless it was made from the same source before."""
        if self._source is not None and self._source == source:
            return
        self._source = source
        content = make()
        write_html(self._html, content)


def write_html(widget: Any, content: str) -> None:
    """Exchange the content of an html element where it is another one; an empty one takes no room."""
    if widget.content != content:
        widget.content = content
    show(widget, visible=bool(content))


def enable(widget: GuiButtonHandle | GuiInputHandle[Any], why_not: str) -> None:
    """Let a button be pressed or a field be filled, or say on it, when it is pointed at, why it cannot be.

    Parameters
    ----------
    widget : with the hint of what it does.
    why_not : one line; empty: it can be used.
    """
    if widget.disabled is not bool(why_not):
        widget.disabled = bool(why_not)
    does = (widget.hint or "").split(NOT_NOW)[0]
    hint = f"{does}{NOT_NOW}{why_not}." if why_not else does
    if widget.hint != hint:
        widget.hint = hint


def show(widget: Any, *, visible: bool) -> None:
    """Show or hide a widget where it is not so already."""
    if widget.visible is not visible:
        widget.visible = visible
