"""The widget of a field: made from what is said beside the field, in the page's unit. It knows no particular field."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiInputHandle

from commission.site.fields import FieldInfo
from commission.site.quantity import LARGEST, Choice, Quantity, Switch


def add_widget(gui: GuiApi, info: FieldInfo, value: Any, note: str = "") -> GuiInputHandle[Any]:
    """Add the widget that fits a field: slider, number, check box, list of choices or line of text.

    Parameters
    ----------
    gui : where it is made.
    info : what is known about the field.
    value : what it shows, in the unit of code and files.
    note : what stands behind the hint.
    """
    hint = f"{info.hint} {note}".rstrip()
    match info.descriptions[0]:
        case Quantity() as quantity:
            return _number(gui, quantity, held(info, value), hint)
        case Switch(label):
            return gui.add_checkbox(label, bool(value), hint=hint)
        case Choice(label):
            return gui.add_dropdown(label, info.options, initial_value=str(value), hint=hint)
        case description:
            return gui.add_text(description.label, str(value), hint=hint)


def held(info: FieldInfo, value: Any) -> Any:
    """Return what the widget of a field holds while the field has this value."""
    if info.quantity is None:
        return str(value) if info.options else value
    number = info.quantity.on_page(value)
    return round(number) if info.kind is int else float(number)


def meant(info: FieldInfo, content: Any) -> Any:
    """Return the value of a field that a person means by what the widget holds."""
    if info.quantity is None:
        return info.kind(content)
    number = info.quantity.of_page(content)
    return round(number) if info.kind is int else float(number)


def _number(gui: GuiApi, quantity: Quantity, number: float, hint: str) -> GuiInputHandle[Any]:
    """A slider, or a number that is typed; what is beyond its ends moves them."""
    kind = type(number)
    if quantity.slider is not None:
        low, high = quantity.slider
        ends = kind(min(low, number)), kind(max(high, number))
        return gui.add_slider(quantity.title, *ends, kind(quantity.step), number, hint=hint)
    low, high = quantity.entry or _ends(quantity)
    return gui.add_number(
        quantity.title,
        number,
        min=None if low is None else kind(min(low, number)),
        max=None if high is None else kind(max(high, number)),
        step=kind(quantity.step),
        hint=hint,
    )


def _ends(quantity: Quantity) -> tuple[float | None, float | None]:
    """Ends that the bounds themselves allow, in the page's unit; none where there are none."""
    bounds = quantity.bounds
    low = None if bounds.excludes_low or bounds.low == -LARGEST else bounds.low * quantity.scale
    return low, None if bounds.excludes_high or bounds.high == LARGEST else bounds.high * quantity.scale
