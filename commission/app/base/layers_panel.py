"""Legend and switches of everything drawn on the floor."""

from __future__ import annotations

from collections.abc import Sequence

from viser import GuiApi

from commission.app.base import actions, theme
from commission.app.base.layer import Layer
from commission.app.base.panel import BasePanel, Post, escaped, posting
from commission.app.base.state import MAGNIFICATIONS, AppState
from commission.app.base.view import PageView

SHAPES = {
    theme.Mark.LINE: "<line x1='0' y1='7' x2='18' y2='7' stroke='{c}' stroke-width='2'/>",
    theme.Mark.DOT: "<circle cx='9' cy='7' r='4' fill='{c}'/>",
    theme.Mark.RING: "<ellipse cx='9' cy='7' rx='8' ry='5' fill='none' stroke='{c}' stroke-width='1.6'/>",
    theme.Mark.SQUARE: "<rect x='5' y='3' width='8' height='8' fill='{c}'/>",
    theme.Mark.DIAMOND: "<path d='M9 2L14 7L9 12L4 7Z' fill='{c}'/>",
    theme.Mark.CROSS: "<path d='M9 1V13M3 7H15' stroke='{c}' stroke-width='1.8'/>",
}


def legend(layers: Sequence[Layer], magnify: float) -> str:
    """Return the legend of layers; it says when ellipses are not true to scale."""
    scale = "" if magnify == 1.0 else f", drawn {magnify:g}x"
    rows = "".join(
        "<div style='display:flex;align-items:center;gap:8px;height:19px'><svg width='18' height='14'>"
        f"{SHAPES[entry.mark].format(c=theme.css(entry.color))}</svg><span>{escaped(entry.text)}"
        f"{scale if entry.mark is theme.Mark.RING else ''}</span></div>"
        for layer in layers
        for entry in layer.legend
    )
    return f"<div class='c-legend' style='font-size:12px;padding:2px 6px'>{rows}</div>"


class LegendPanel(BasePanel):
    """What the colors and shapes mean."""

    def __init__(self, gui: GuiApi, post: Post, layers: Sequence[Layer], state: AppState) -> None:
        self._layers = layers
        self._html = gui.add_html("")
        self._shown: tuple[object, ...] = ()
        scale = gui.add_dropdown(
            "Ellipses",
            tuple(_factor(m) for m in MAGNIFICATIONS),
            initial_value=_factor(state.magnify),
            hint="Draw validation areas and pose covariance larger than they are; true to scale is 1x.",
        )
        scale.on_update(posting(post, lambda event: actions.Magnify(float(str(event.target.value).rstrip("x")))))

    def draw_slowly(self, view: PageView) -> None:
        """Explain what is drawn now, and say by how much ellipses are magnified."""
        state = view.state
        used = [layer for layer in self._layers if layer.name not in state.hidden and layer.is_used(view)]
        shown = (state.magnify, *(layer.name for layer in used))
        if shown != self._shown:
            self._shown = shown
            self._html.content = legend(used, state.magnify)


class LayersPanel(BasePanel):
    """A switch for each layer."""

    def __init__(self, gui: GuiApi, post: Post, layers: Sequence[Layer], state: AppState) -> None:
        self._switches = {}
        for layer in layers:
            switch = gui.add_checkbox(layer.name, layer.name not in state.hidden)
            switch.on_update(
                posting(post, lambda event, name=layer.name: actions.ShowLayer(name, bool(event.target.value)))
            )
            self._switches[layer.name] = switch

    def draw_slowly(self, view: PageView) -> None:
        """Follow the state."""
        for name, switch in self._switches.items():
            visible = name not in view.state.hidden
            if switch.value is not visible:
                switch.value = visible


def _factor(magnification: float) -> str:
    return f"{magnification:g}x"
