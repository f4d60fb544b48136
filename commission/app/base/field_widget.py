"""The widget of a field: made from what is said beside the field, in the page's unit. It knows no particular field."""

from __future__ import annotations

import math
import typing
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from viser import GuiApi, GuiInputHandle, GuiNumberHandle, GuiSliderHandle

from commission.app.base import viser_private
from commission.site.fields import FieldInfo, field_info, get_field
from commission.site.quantity import LARGEST, Choice, Quantity, Switch, decimals_of


def add_widget(gui: GuiApi, info: FieldInfo, value: Any, note: str = "") -> GuiInputHandle[Any]:
    """Add the widget that fits a field: slider, number, check box, list of choices or line of text.

    Parameters
    ----------
    gui : where it is made.
    info : what is known about the field.
    value : what it shows, in the unit of code and files.
    note : what stands behind the hint.
    """
    hint = hint_of(info, note)
    match info.descriptions[0]:
        case Quantity() as quantity if quantity.none:
            return gui.add_text(quantity.title, held(info, value), hint=f"{hint} Empty: {quantity.none}.")
        case Quantity() as quantity:
            return _number(gui, quantity, held(info, value), hint)
        case Switch(label):
            return gui.add_checkbox(label, bool(value), hint=hint)
        case Choice(label):
            return gui.add_dropdown(label, tuple(map(in_words, info.options)), initial_value=in_words(value), hint=hint)
        case description:
            return gui.add_text(description.label, str(value), hint=hint)


def hint_of(info: FieldInfo, note: str = "") -> str:
    """Return what a widget tells of its field: its hint, what may be entered, and a note behind it."""
    limits = "" if info.quantity is None else info.quantity.limits()
    bounds = f"{limits[0].upper()}{limits[1:]}." if limits else ""
    hint = info.hint
    for option in info.options:
        hint = hint.replace(f"`{option}`", in_words(option))
    return " ".join(part for part in (hint, bounds, note) if part)


def in_words(option: object) -> str:
    """Return an option of a choice as people read it: files have no blanks in it."""
    return str(option).replace("_", " ")


def labelled(info: FieldInfo, label: str) -> FieldInfo:
    """Return a field that a widget calls otherwise: that of one of several things of a kind."""
    return replace(info, descriptions=tuple(replace(each, label=label) for each in info.descriptions))


def held(info: FieldInfo, value: Any) -> Any:
    """Return what the widget of a field holds while the field has this value."""
    if info.quantity is None:
        return in_words(value) if info.options else value
    if info.quantity.none:
        return info.quantity.none if value is None else f"{info.quantity.on_page(value):g}"
    if isinstance(value, tuple | list | np.ndarray):
        return tuple(
            _tidy(info.quantity, float(info.quantity.on_page(float(each))))
            for each in typing.cast("Iterable[Any]", value)
        )
    number = info.quantity.on_page(value)
    return round(number) if info.kind is int else _tidy(info.quantity, float(number))


def _tidy(quantity: Quantity, number: float) -> float:
    """Number of the page without digits that only its unit brings in: 0.1 rad is 5.72958° and not 5.729577951308232.

    Six digits, and of large numbers a thousandth of a step: far below what anybody enters. What is not entered is not
    changed by how it is shown.
    """
    if not number or not math.isfinite(number):
        return number
    six = 5 - math.floor(math.log10(abs(number)))
    return round(number, max(six, decimals_of(quantity.step) + 3))


def meant(info: FieldInfo, content: Any) -> Any:
    """Return the value of a field that a person means by what the widget holds.

    Raises
    ------
    ValueError
        the field's bounds do not allow it; says so in the page's unit.
    """
    if info.options:
        return info.kind(next((each for each in info.options if in_words(each) == content), content))
    if info.quantity is None:
        return content.strip() if info.kind is str else info.kind(content)
    if info.quantity.none:
        return _number_or_none(info.quantity, str(content).strip())
    if isinstance(content, tuple | list):
        return tuple(_allowed(info.quantity, float(each)) for each in typing.cast("Iterable[Any]", content))
    number = _allowed(info.quantity, content)
    return round(number) if info.kind is int else float(number)


def write_saved(widget: GuiInputHandle[Any], content: Any) -> None:
    """Put a tick on a slider where the saved project has it; other widgets have none."""
    if isinstance(widget, GuiSliderHandle):
        inside = isinstance(content, int | float) and widget.min <= content <= widget.max
        viser_private.tick(widget, float(content) if inside else None)


class Tail:
    """What tells the page's script to make a slider logarithmic (web_assets/sliders.js): an element nobody sees.

    Parameters
    ----------
    gui : where it is made.
    quantity : of the slider.
    widget : the slider.
    """

    def __init__(self, gui: GuiApi, quantity: Quantity, widget: GuiInputHandle[Any]) -> None:
        self._field, self._ends = viser_private.identifier(widget), quantity.slider or (0.0, 1.0)
        self._html = gui.add_html(self._content(None))
        self._saved: float | None = None

    def write_saved(self, content: float) -> None:
        """Say where the saved project has it."""
        if content != self._saved:
            self._saved = content
            self._html.content = self._content(content)

    def _content(self, saved: float | None) -> str:
        low, high = self._ends
        return (
            f"<div class='c-tail' data-field='{self._field}' data-low='{low:g}' data-high='{high:g}' "
            f"data-saved='{'' if saved is None else f'{saved:g}'}'></div>"
        )


def write_held(widget: GuiInputHandle[Any], content: Any) -> None:
    """Show in a widget what it holds for a field now; a number beyond the widget's ends moves them."""
    bounded: Any = widget
    if isinstance(widget, GuiNumberHandle | GuiSliderHandle):
        if bounded.min is not None and content < bounded.min:
            bounded.min = content
        if bounded.max is not None and content > bounded.max:
            bounded.max = content
    if widget.value != content:
        widget.value = content


class Entry:
    """A field's widget that posts nothing: what it holds is read when something is done with it.

    Parameters
    ----------
    gui : where it is made.
    name : the field's dotted name.
    of : a value that has the field; the widget begins with what it has.
    """

    def __init__(self, gui: GuiApi, name: str, of: object) -> None:
        self._info = field_info(of, name)
        self.widget = add_widget(gui, self._info, get_field(of, name))

    def read(self) -> Any:
        """Return what it means, in the unit of code and files; raises ValueError when the bounds do not allow it."""
        return meant(self._info, self.widget.value)


def _allowed(quantity: Quantity, content: float) -> float:
    number = quantity.of_page(content)
    refusal = quantity.refusal(number)
    if refusal:
        raise ValueError(refusal)
    return number


def _number_or_none(quantity: Quantity, text: str) -> float | None:
    """Return what a line of text means: a number, with a point or a comma, or nothing that is known."""
    if text.lower() in {"", quantity.none}:
        return None
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        raise ValueError(f"{quantity.title} is {text!r}; expected a number, or {quantity.none}") from None
    return _allowed(quantity, number)


def _number(gui: GuiApi, quantity: Quantity, number: Any, hint: str) -> GuiInputHandle[Any]:
    """A slider, a number that is typed, or two of them; what is beyond its ends moves them."""
    if isinstance(number, tuple):
        pair: Any = number
        return gui.add_vector2(quantity.title, pair, step=quantity.step, hint=hint)
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
