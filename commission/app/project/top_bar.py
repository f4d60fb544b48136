"""The bar at the top, as far as it is about the project: what it is called, saved or not, undo and redo."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

from viser import GuiApi

from commission.app.base import style, theme
from commission.app.base.actions import Action, Redo, Undo
from commission.app.base.inputs import enable, show
from commission.app.base.panel import BasePanel, Post, escaped, posting, shortened, write_label
from commission.app.base.state import AppState, Step
from commission.app.base.view import PageView
from commission.app.project.actions import Reload, Save, TakeOver
from commission.app.project.state import FilesState

LONGEST_NAME = 22
"""Letters of a step's name that fit on a button."""

Modifier: TypeAlias = Literal["cmd/ctrl", "cmd/ctrl+shift"]
Button: TypeAlias = tuple[str, str, Callable[[], Action], Literal["Z", "S"], Modifier]
"""Label, hint, what it asks for, and the key that does the same."""

BUTTONS: tuple[Button, ...] = (
    ("Undo", "Take back the last change (Ctrl+Z)", Undo, "Z", "cmd/ctrl"),
    ("Redo", "Make it again (Ctrl+Shift+Z)", Redo, "Z", "cmd/ctrl+shift"),
    ("Save", "Write the project (Ctrl+Shift+S)", Save, "S", "cmd/ctrl+shift"),
)


def title(state: AppState) -> str:
    """Return the left end of the bar; what does not fit between name and buttons is cut, and shown by the pointer."""
    stands, files = escaped(standing(state)), state.part(FilesState)
    # Where edits might be lost, that is read before the name is.
    is_urgent = bool(files.holder or files.kept_in or files.foreign) or not files.is_protected
    cut = "overflow:hidden;text-overflow:ellipsis"
    name_gives, least = (f"min-width:2em;{cut}", "8em") if is_urgent else (cut, "0")
    return (
        "<div class='c-top' style='display:flex;align-items:center;padding:0 14px;gap:14px;font-size:13px;"
        "white-space:nowrap;overflow:hidden'>"
        f"<b>Commission</b><span style='opacity:.85;{name_gives}' title='{escaped(state.project.name)}'>"
        f"{escaped(state.project.name)}</span>"
        f"<span style='opacity:.55;flex-shrink:9999;min-width:{least};{cut}' title='{stands}'>"
        f"{stands}</span></div>"
    )


def standing(state: AppState) -> str:
    """Return how the project stands on disk, what is most urgent alone."""
    files = state.part(FilesState)
    ways = (
        (files.holder, f"read-only: edited by {files.holder}"),
        (not files.is_protected, "unsaved, and a crash would lose it: the journal cannot be written"),
        (files.kept_in, f"its folder is gone; edits are kept in {files.kept_in}"),
        (files.foreign, f"changed on disk: {', '.join(files.foreign)}"),
        (state.is_changed, "unsaved"),
        (files.saved_at, f"saved {files.saved_at}"),
        (state.folder is None, "bundled project"),
    )
    return next((text for applies, text in ways if applies), "as on disk")


def button_text(label: str, steps: tuple[Step, ...]) -> str:
    """Return what stands on the undo or redo button: the step's name, cut where it would crowd the bar."""
    if not steps:
        return label
    return f"{label} {shortened(steps[-1].name, LONGEST_NAME)}"


def _why_not(label: str, state: AppState, *, foreign: bool) -> str:
    """Return why a button cannot be pressed."""
    if state.read_only:
        return f"Read-only: {state.read_only}"
    if label == "Save":
        return "First say what becomes of the files that somebody else has changed" if foreign else "All is saved"
    return "Nothing has been changed yet" if label == "Undo" else "Nothing has been taken back"


class TitlePanel(BasePanel):
    """The left end of the bar. It brings the page's style, which turns the main panel into a bar."""

    def __init__(self, gui: GuiApi, state: AppState) -> None:
        self._head, self._style = title(state), theme.STYLE + style.BAR_AND_GUIDE
        self._title = gui.add_html(self._style + self._head)

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project's name, and what has become of its files."""
        head = title(view.state)
        if head != self._head:
            self._head = head
            self._title.content = self._style + head


class ProjectButtons(BasePanel):
    """Undo, redo, save; and what to do about files that somebody else has changed."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._buttons = {}
        for label, hint, make, key, modifier in BUTTONS:
            button = gui.add_button(label, hint=hint, color="dark")
            button.on_click(posting(post, lambda _event, make=make: make()))
            self._buttons[label] = button
            command = gui.add_command(label, hotkey=key, modifier=modifier)
            command.on_trigger(posting(post, lambda _event, make=make: make()))
        self._overwrite = gui.add_button(
            "Overwrite", hint="Save over what somebody else has written.", color="red", visible=False
        )
        self._overwrite.on_click(posting(post, lambda _event: Save(overwrite=True)))
        self._reload = gui.add_button(
            "Read again", hint="Take what somebody else has written; undo brings yours back.", visible=False
        )
        self._reload.on_click(posting(post, lambda _event: Reload()))
        self._take_over = gui.add_button(
            "Take over", hint="Edit the project here; where it is edited now, it becomes read-only.", visible=False
        )
        self._take_over.on_click(posting(post, lambda _event: TakeOver()))

    def draw_slowly(self, view: PageView) -> None:
        """Enable what can be done."""
        state = view.state
        foreign = bool(state.part(FilesState).foreign)
        for button in (self._overwrite, self._reload):
            show(button, visible=foreign)
        show(self._take_over, visible=bool(state.read_only))
        wanted = {"Undo": bool(state.undo), "Redo": bool(state.redo), "Save": state.is_changed and not foreign}
        if state.read_only:
            wanted = dict.fromkeys(wanted, False)
        for label, enabled in wanted.items():
            enable(self._buttons[label], "" if enabled else _why_not(label, state, foreign=foreign))
        for label, steps in (("Undo", state.undo), ("Redo", state.redo)):
            write_label(self._buttons[label], button_text(label, steps))
