"""Lists of numbers as an engineer types them: one line, and back."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiInputHandle

from commission.app.base import theme, viser_private
from commission.app.base.inputs import Inputs, Read
from commission.app.base.state import AppState
from commission.site.fields import field_info
from commission.site.project import Project

LIKE = {
    "outline": "corners like 0.5 0.3, -0.5 0.3, -0.5 -0.3",
    "wheel_angles_deg": "angles like 0 120 240",
    "blind_sectors_deg": "first and last bearing of each sector like -135 -120, 60 75, or nothing",
    "detection_rates": "distance [m] and share of scans like 5 0.8, 15 0.12, or nothing",
}
"""How lists are typed: numbers with blanks between, pairs of them with commas between."""
PAIRS = frozenset({"outline", "blind_sectors_deg", "detection_rates"})
"""Those of pairs."""


def list_text(value: tuple[Any, ...]) -> str:
    """Return pairs or single numbers as they are typed."""
    if value and isinstance(value[0], tuple):
        return ", ".join(f"{x:.9g} {y:.9g}" for x, y in value)
    return " ".join(f"{number:.9g}" for number in value)


def list_value(name: str, text: str, label: str = "") -> tuple[Any, ...]:
    """Return what was typed.

    Parameters
    ----------
    name : of the field.
    text : what stands in the line.
    label : what the message calls it; empty: its name.

    Raises
    ------
    ValueError
        the text is no such list; says what is expected.
    """
    label = label or name
    try:
        if name not in PAIRS:
            return tuple(float(word) for word in text.split())
        if name != "outline" and not text.strip():
            return ()
        pairs = [tuple(float(word) for word in pair.split()) for pair in text.split(",")]
        if any(len(pair) != 2 for pair in pairs):
            raise ValueError(text)
        return tuple(pairs)
    except ValueError as error:
        raise ValueError(f"{label} is {text!r}; expected {LIKE[name]}{_parted(name, text)}") from error


def _parted(name: str, text: str) -> str:
    """Say where commas belong in numbers that are all there; empty: something else is wrong."""
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        return ""
    if name not in PAIRS or not numbers or len(numbers) % 2:
        return ""
    return f"; perhaps {list_text(tuple(zip(numbers[::2], numbers[1::2], strict=True)))}"


def add_list(gui: GuiApi, inputs: Inputs, name: str, of: tuple[Project, Read]) -> GuiInputHandle[Any]:
    """Add a line of text for several numbers.

    Parameters
    ----------
    gui : where the widget is made.
    inputs : what it is connected to.
    name : the field's dotted name in the project.
    of : a project that has the field, and what reads it in a state.
    """
    project, read = of
    info = field_info(project, name)
    widget = gui.add_text(info.quantity.title if info.quantity else info.label, "", hint=info.hint)
    gui.add_html(theme.whole_line(viser_private.identifier(widget)))

    def shown(state: AppState) -> str | None:
        value = read(state, name)
        return None if value is None else list_text(value)

    inputs.connect(name, widget, lambda text: list_value(info.name, str(text), info.label), shown)
    return widget
