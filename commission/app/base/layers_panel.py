"""Everything that is drawn on the floor: what it looks like, whether it is shown, and how strongly."""

from __future__ import annotations

import json
from collections.abc import Sequence

from viser import GuiApi, LabelHandle

from commission.app.base import actions, theme, viser_private
from commission.app.base.actions import Action
from commission.app.base.inputs import write_html
from commission.app.base.layer import Layer, LayerGroup
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


def legend(layer: Layer, magnify: float) -> str:
    """Return what the marks of a layer mean; it says when ellipses are not true to scale."""
    scale = "" if magnify == 1.0 else f", drawn {magnify:g}x"
    return "".join(
        f"<div class='c-mark'><svg width='18' height='14'>{SHAPES[entry.mark].format(c=theme.css(entry.color))}</svg>"
        f"<span>{escaped(entry.text)}{scale if entry.mark is theme.Mark.RING else ''}</span></div>"
        for entry in layer.legend
    )


def layer_row(layer: Layer, magnify: float, *, shown: bool) -> str:
    """Return a layer with its switch, its opacity and, where it is shown, its legend.

    Parameters
    ----------
    layer : of which.
    magnify : factor of ellipses.
    shown : whether it is switched on.
    """
    name = escaped(layer.name)
    nodes = [node.name for node in layer.nodes() if not isinstance(node, LabelHandle)]
    opacity = (
        f"<input type='range' min='10' max='100' step='5' value='100' aria-label='Opacity of {name} [%]'"
        f" data-nodes='{escaped(json.dumps(nodes))}'>"
    )
    return (
        f"<div class='c-layer' data-layer='{name}'><input type='checkbox'{' checked' if shown else ''}"
        f" aria-label='Show {name}'><span>{name}</span>{opacity if nodes else ''}</div>"
        f"{legend(layer, magnify) if shown else ''}"
    )


def switched(sent: str) -> Action:
    """Return what the page's script asks for (web_assets/layers.js).

    Raises
    ------
    ValueError
        Where it is none of that.
    """
    asked = json.loads(sent)
    match asked:
        case {"layer": str(name), "shown": bool(shown)}:
            return actions.ShowLayer(name, shown)
        case _:
            raise ValueError(f"the page sent {sent[:80]!r}; expected the name of a layer and whether it is shown")


class LayersPanel(BasePanel):
    """Layers in their groups. How strongly they are drawn is each browser's own, and its script's."""

    def __init__(self, gui: GuiApi, post: Post, layers: Sequence[Layer], state: AppState) -> None:
        self._layers = layers
        scale = gui.add_dropdown(
            "Ellipses",
            tuple(_factor(m) for m in MAGNIFICATIONS),
            initial_value=_factor(state.magnify),
            hint="Draw validation areas and pose covariance larger than they are; true to scale is 1x.",
        )
        scale.on_update(posting(post, lambda event: actions.Magnify(float(str(event.target.value).rstrip("x")))))
        inbox = gui.add_text("Layers switched", "", visible=False)
        inbox.on_update(posting(post, lambda event: switched(event.target.value)))
        self._inbox = viser_private.identifier(inbox)
        self._html = gui.add_html("")
        self._shown: tuple[object, ...] = ()

    def draw_slowly(self, view: PageView) -> None:
        """List what there is to draw now, and what is switched off."""
        state = view.state
        listed = [layer for layer in self._layers if layer.name in state.hidden or layer.is_used(view)]
        shown = (state.magnify, state.hidden, [(layer, layer.nodes()) for layer in listed])
        if shown == self._shown:
            return
        self._shown = shown
        groups = []
        for group in LayerGroup:
            rows = "".join(
                layer_row(layer, state.magnify, shown=layer.name not in state.hidden)
                for layer in listed
                if layer.group is group
            )
            groups.append(rows and f"<h4>{group}</h4>{rows}")
        content = f"<div class='c-layers' data-inbox='{self._inbox}'>{''.join(groups)}</div>"
        write_html(self._html, content)


def _factor(magnification: float) -> str:
    return f"{magnification:g}x"
