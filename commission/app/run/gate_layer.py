"""Validation areas: around each reflector in view, where a detection of it must lie to be an inlier."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import outline_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.geometry.arrays import FloatArray


class GateLayer(BaseLayer):
    """Validation ellipses, all in one node."""

    name = "Validation areas"
    group = LayerGroup.RUN
    rank = 150
    legend = (theme.Legend("validation area (gate)", theme.GATE, theme.Mark.RING),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._lines = add_cased_lines(scene, "/run/gates", theme.GATE, 1.5)

    def draw(self, view: PageView) -> None:
        """Draw the ellipses, larger than they are when asked to."""
        run = view.part(RunView)
        if run is None:
            return
        outlines = outline_segments(drawn_gates(run, view.state.magnify), theme.Height.GATE)
        self._lines.draw(outlines, cased=view.floor_is_colored)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the lines."""
        return self._lines.nodes


def drawn_gates(run: RunView, magnify: float) -> FloatArray:
    """(R, n, 2) outlines of the gates [m], map frame, so many times as large as they are."""
    middle = np.mean(run.gates, axis=1, keepdims=True)
    return middle + magnify * (run.gates - middle)
