"""What a file leaves open before it becomes a floor map: unit, layers, heights; a picture's threshold and scale."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.field_widget import add_widget, held, meant, write_held
from commission.app.base.inputs import add_find, enable, write_html
from commission.app.base.panel import Post, escaped, posting, table
from commission.app.base.rows import Rows
from commission.app.floor_map import actions
from commission.app.floor_map.draft import MapDraft, MapOptions, Read, ReadOptions
from commission.io.dxf import Drawing, DrawingLayer
from commission.io.dxf_units import UNITS
from commission.io.image_map import Picture
from commission.io.mesh import Model
from commission.site.fields import field_hints, field_info, get_field
from commission.site.quantity import MILLIMETRES, counted_text

OPTIONS = MapOptions()
"""What the widgets begin with."""
AS_STATED = "as stated"
DARK, LIGHT = "dark", "light"
ALONG_X, ALONG_Y, TYPED = "x axis", "y axis", "a heading"
HEADINGS = {ALONG_X: 0.0, ALONG_Y: 0.5 * math.pi}
MOST_LAYERS = 40
"""Layers that are listed at a time, those with most lines; the others are found by their names."""
_LONGEST_LAYER = 28
NO_FILE = "no file is open to load a floor map from; expected one"


def heights_of(text: str) -> tuple[float, ...]:
    """Return heights as they are typed, with blanks between [m]; raises ValueError that says what is expected."""
    try:
        return tuple(float(word) for word in text.replace(";", " ").replace(", ", " ").split())
    except ValueError as error:
        raise ValueError(f"heights are {text!r}; expected numbers like 0.2 1.8") from error


def layers_by_size(drawing: Drawing, sought: str = "") -> tuple[DrawingLayer, ...]:
    """Return the layers whose names hold a text, upper or lower case; the one with most lines first."""
    found = (layer for layer in drawing.layers if sought.strip().lower() in layer.name.lower())
    return tuple(sorted(found, key=lambda layer: -layer.segments))


def chosen_layers(draft: MapDraft) -> frozenset[str]:
    """Return the names of the layers that hold walls."""
    if not isinstance(draft.read, Drawing):
        return frozenset()
    if draft.options.layers is None:
        return frozenset(layer.name for layer in draft.read.layers if layer.is_visible)
    return frozenset(draft.options.layers)


def facts(draft: MapDraft) -> list[tuple[str, str]]:
    """Return what was read, line by line; escaped."""
    read, rows = draft.read, [("File", escaped(draft.file.name))]
    match read:
        case Drawing():
            corners = read.segments.reshape(-1, 2)
            width, height = np.ptp(corners, axis=0) if len(corners) else (0.0, 0.0)
            rows += [("Drawn in", escaped(read.unit)), ("Measures", f"{width:.1f} x {height:.1f} m")]
            rows += [("Lines", f"{len(read.segments):,} on {counted_text(len(read.layers), 'layer')}")]
        case Model():
            low, high = read.bounds
            width, depth, _ = high - low
            rows += [("Measures", f"{width:.1f} x {depth:.1f} m"), ("Height", f"{low[2]:.2f} to {high[2]:.2f} m")]
            rows += [("Triangles", f"{len(read.triangles):,}")]
        case Picture():
            placement = draft.placement()
            width, height = read.size
            rows += [("Image", f"{width} x {height} pixels")]
            if placement is None:
                rows += [("Points", f"click the {'second' if draft.pixels else 'first'} one on the image")]
            else:
                edge = placement.resolution
                rows += [
                    ("Pixel", MILLIMETRES.text(edge, ".4g")),
                    ("Measures", f"{width * edge:.1f} x {height * edge:.1f} m"),
                ]
    return rows


class MapDraftFields:
    """Widgets for what a file leaves open; only those that its kind needs are visible."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._gui, self._post = gui, post
        self._draft: MapDraft | None = None
        self._widgets: list[tuple[Any, tuple[type[Read], ...], Callable[[MapDraft], Any] | None]] = []
        self._facts = gui.add_html("", visible=False)
        self._add_reading()
        self._add_layers()
        self._field("resolution", (Drawing, Model))
        self._add_picture()
        self._make = gui.add_button(
            "Load as the floor map", visible=False, hint="Replaces the floor map; can be undone."
        )
        self._make.on_click(posting(post, lambda _event: actions.MakeMap()))

    def _posting(self, make: Callable[[GuiEvent[Any], MapDraft], page_actions.Action]) -> Callable[[Any], None]:
        """Return a callback that posts while a file is open; what cannot be meant is reported instead."""

        def action(event: GuiEvent[Any]) -> page_actions.Action:
            if self._draft is None:
                return page_actions.Report(NO_FILE)
            try:
                return make(event, self._draft)
            except ValueError as error:
                return page_actions.Report(str(error))

        return posting(self._post, action)

    def _add(self, widget: Any, kinds: tuple[type[Read], ...], shown: Callable[[MapDraft], Any] | None = None) -> Any:
        """Register a widget for kinds of files; `shown` is its value."""
        widget.visible = False
        self._widgets.append((widget, kinds, shown))
        return widget

    def _field(self, name: str, kinds: tuple[type[Read], ...]) -> Any:
        """Add a number, or a pair, of `MapOptions`."""
        info = field_info(OPTIONS, name)
        widget = add_widget(self._gui, info, get_field(OPTIONS, name))
        widget.on_update(
            self._posting(lambda event, _draft: actions.SetMapOption(name, meant(info, event.target.value)))
        )
        return self._add(widget, kinds, lambda draft: held(info, get_field(draft.options, name)))

    def _add_reading(self) -> None:
        gui = self._gui
        unit = gui.add_dropdown("Unit", (AS_STATED, *UNITS), hint="Unit in which it was made, where the file is wrong.")

        def read_again(_event: GuiEvent[Any], draft: MapDraft) -> page_actions.Action:
            typed = unit.value, up.value
            words = ["" if word == AS_STATED else word for word in typed]
            return actions.SetReading(replace(draft.reading, unit=words[0], up=words[1]))

        self._add(unit, (Drawing, Model), lambda draft: draft.reading.unit or AS_STATED)
        up = gui.add_dropdown("Upward", (AS_STATED, "y", "z"), hint=field_hints(ReadOptions)["up"])
        self._add(up, (Model,), lambda draft: draft.reading.up or AS_STATED)
        for widget in (unit, up):
            widget.on_update(self._posting(read_again))
        info = field_info(OPTIONS, "heights")
        heights = gui.add_text(info.quantity.title if info.quantity else info.label, "", hint=info.hint)
        heights.on_update(
            self._posting(lambda event, _draft: actions.SetMapOption("heights", heights_of(event.target.value)))
        )
        self._add(heights, (Model,), lambda draft: " ".join(f"{height:g}" for height in draft.options.heights))

    def _add_layers(self) -> None:
        gui = self._gui
        self._layers = self._add(gui.add_folder("Layers with walls"), (Drawing,))
        with self._layers:
            gui.add_html(theme.WIDE)
            every = gui.add_button_group("", ("All", "None", "Visible"))
            self._find = add_find(gui, self._post, "Part of a layer's name.")
            self._rest = gui.add_html("", visible=False)
            self._rows = Rows(gui, self._layers, self._post, self._toggled)
        self._listed: tuple[DrawingLayer, ...] = ()
        self._sought = ""

        def several(event: GuiEvent[Any], draft: MapDraft) -> page_actions.Action:
            layers = draft.read.layers if isinstance(draft.read, Drawing) else ()
            word = event.target.value
            names = tuple(layer.name for layer in layers if word == "All" or (word == "Visible" and layer.is_visible))
            return actions.SetMapOption("layers", names)

        every.on_click(self._posting(several))

    def _toggled(self, index: int) -> page_actions.Action:
        """Return the action of a click on a layer's line."""
        draft, listed = self._draft, self._listed
        if draft is None or not isinstance(draft.read, Drawing):
            return page_actions.Report(NO_FILE)
        if index >= len(listed):
            return page_actions.Report("that layer is not listed any more; expected one that is")
        name = listed[index].name
        return actions.SetMapOption("layers", tuple(sorted(chosen_layers(draft) ^ {name})))

    def _add_picture(self) -> None:
        gui, picture = self._gui, (Picture,)
        self._field("distance", picture)
        axis = gui.add_dropdown("A to B is", (ALONG_X, ALONG_Y, TYPED), hint="Direction of B as seen from A.")

        def turned(event: GuiEvent[Any], draft: MapDraft) -> page_actions.Action:
            # Another heading begins beside the one there is: equal to it, it would be that axis.
            heading = HEADINGS.get(event.target.value, draft.options.direction + math.radians(1.0))
            return actions.SetMapOption("direction", heading)

        axis.on_update(self._posting(turned))
        self._add(axis, picture, lambda draft: axis_of(draft.options.direction))
        self._heading = self._field("direction", picture)
        self._field("first_in_map", picture)
        self._field("threshold", picture)
        info = field_info(OPTIONS, "light_walls")
        walls = gui.add_dropdown(info.label, (DARK, LIGHT), hint=info.hint)
        walls.on_update(
            self._posting(lambda event, _draft: actions.SetMapOption("light_walls", event.target.value == LIGHT))
        )
        self._add(walls, picture, lambda draft: LIGHT if draft.options.light_walls else DARK)
        again = gui.add_button("Click both points anew", color="gray", hint="Far apart, of known distance.")
        again.on_click(posting(self._post, lambda _event: actions.ClickPicture()))
        self._add(again, picture)

    def show(self, draft: MapDraft | None) -> None:
        """Follow the draft."""
        self._draft = draft
        for widget, kinds, shown in self._widgets:
            visible = draft is not None and isinstance(draft.read, kinds)
            if widget.visible is not visible:
                widget.visible = visible
            if visible and shown is not None and draft is not None:
                write_held(widget, shown(draft))
        self._facts.visible = self._make.visible = draft is not None
        if draft is None:
            return
        self._facts.content = f"<div style='padding:2px 6px;overflow-wrap:anywhere'>{table(facts(draft))}</div>"
        is_unscaled = isinstance(draft.read, Picture) and draft.placement() is None
        enable(self._make, "click two points of the picture, and type how far apart they are" if is_unscaled else "")
        if isinstance(draft.read, Drawing):
            self._show_layers(draft, draft.read)
        if isinstance(draft.read, Picture):
            self._heading.visible = axis_of(draft.options.direction) == TYPED

    def refresh(self) -> None:
        """Follow what is typed to find a layer, which is no part of the draft."""
        draft = self._draft
        if draft is not None and isinstance(draft.read, Drawing) and self._find.value != self._sought:
            self._show_layers(draft, draft.read)

    def _show_layers(self, draft: MapDraft, drawing: Drawing) -> None:
        """Show a line for each layer that is sought, marked where it holds walls."""
        self._sought = self._find.value
        found, chosen = layers_by_size(drawing, self._sought), chosen_layers(draft)
        self._listed = found[:MOST_LAYERS]
        self._rows.show([layer_line(layer, is_chosen=layer.name in chosen) for layer in self._listed])
        write_html(self._rest, rest_text(len(found), len(drawing.layers)))


def rest_text(found: int, layers: int) -> str:
    """Say what is not listed, and how to come to it."""
    text = ""
    if not found and layers:
        text = "no layer's name holds this text"
    elif found > MOST_LAYERS:
        text = f"the {MOST_LAYERS} with most lines of {found} layers; Find lists others"
    return f"<div class='c-note' style='padding:2px 6px'>{text}</div>" if text else ""


def layer_line(layer: DrawingLayer, *, is_chosen: bool) -> tuple[str, theme.Color]:
    """Return what a layer's line says, as plain text, and its color."""
    name = layer.name if len(layer.name) <= _LONGEST_LAYER else f"{layer.name[: _LONGEST_LAYER - 1]}…"
    return f"{'✓' if is_chosen else '·'} {name}  {layer.segments:,}", theme.CHOSEN_LINE if is_chosen else theme.LINE


def axis_of(direction: float) -> str:
    """Return which axis a direction [rad] is, or that it is another heading."""
    return next((name for name, heading in HEADINGS.items() if heading == direction), TYPED)
