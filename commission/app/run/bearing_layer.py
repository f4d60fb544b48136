"""Bearings of the newest turn of a goniometer: a line each from where it was, by what became of it."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, stroke_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.run.turn import Turn
from commission.app.run.view import RunView
from commission.localization.bearings import BearingUse

STYLES: dict[BearingUse, tuple[theme.Color, str]] = {
    BearingUse.UNKNOWN: (theme.NOT_KNOWN, "bearing unused: two reflectors fit, or none is named so"),
    BearingUse.REJECTED: (theme.OUTLIER_ASSOCIATION, "bearing rejected: no reflector fits"),
    BearingUse.ACCEPTED: (theme.INLIER, "bearing accepted"),
}


class BearingLayer(BaseLayer):
    """Lines of the bearings of one turn."""

    name = "Bearings"
    group = LayerGroup.RUN
    rank = 172
    legend = tuple(theme.Legend(text, color, theme.Mark.LINE) for color, text in reversed(STYLES.values()))

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._lines = {
            use: add_cased_lines(scene, f"/run/bearings/{use.name.lower()}", color, 1.5)
            for use, (color, _) in STYLES.items()
        }
        self._shown: Turn | None = None

    def draw(self, view: PageView) -> None:
        """Draw the turn before the cursor."""
        run = view.part(RunView)
        turn = None if run is None else run.turn
        if turn is self._shown:
            return
        self._shown = turn
        for use, lines in self._lines.items():
            # What was not looked at, where bearings count nowhere, is unused as well.
            chosen = () if turn is None else (use, BearingUse.NONE) if use == BearingUse.UNKNOWN else (use,)
            lines.points = (
                NO_SEGMENTS
                if turn is None
                else stroke_segments(turn.lines[np.isin(turn.uses, chosen)], theme.Height.DETECTION)
            )

    def is_used(self, view: PageView) -> bool:
        """Whether the drive has bearings alone."""
        run = view.part(RunView)
        return run is not None and run.result.columns.detected.bearings is not None

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return all lines."""
        return tuple(node for lines in self._lines.values() for node in lines.nodes)
