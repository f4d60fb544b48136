"""Validation areas: around each reflector in view, where a detection of it must lie to be an inlier."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import outline_segments
from commission.app.base.layer import BaseLayer
from commission.app.base.marks import add_lines
from commission.app.base.view import PageView
from commission.app.run.view import RunView


class GateLayer(BaseLayer):
    """Validation ellipses, all in one node."""

    name = "Validation areas"
    rank = 150
    legend = (theme.Legend("validation area (gate)", theme.GATE, theme.Mark.RING),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._lines = add_lines(scene, "/run/gates", theme.GATE, 1.5)

    def draw(self, view: PageView) -> None:
        """Draw the ellipses, larger than they are when asked to."""
        run = view.part(RunView)
        if run is None:
            return
        state = view.state
        outlines = run.gates
        if state.magnify != 1.0 and len(outlines):
            middle = np.mean(outlines, axis=1, keepdims=True)
            outlines = middle + state.magnify * (outlines - middle)
        self._lines.points = outline_segments(outlines, theme.Height.GATE)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the lines."""
        return (self._lines,)
