"""Tags as the newest frame saw them: a line from the camera to each, by what became of it."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, crosses, stroke_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.run.sightings import FrameTags
from commission.app.run.view import RunView
from commission.localization.tags import TagUse

CROSS = 0.08
"""Half the width of the cross where a tag was seen [m]."""
STYLES: tuple[tuple[str, tuple[TagUse, ...], theme.Color, str], ...] = (
    ("accepted", (TagUse.ACCEPTED, TagUse.LOCATED), theme.INLIER, "tag seen: accepted"),
    ("rejected", (TagUse.REJECTED,), theme.OUTLIER_ASSOCIATION, "tag seen: rejected by the gate"),
    ("unused", (TagUse.UNKNOWN, TagUse.NONE), theme.NOT_KNOWN, "tag seen: unused, none of the site's or more than one"),
)


class SightingLayer(BaseLayer):
    """Sightings of tags."""

    name = "Tags seen"
    group = LayerGroup.RUN
    rank = 174
    legend = tuple(theme.Legend(text, color, theme.Mark.CROSS) for _, _, color, text in STYLES)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._lines = {
            name: add_cased_lines(scene, f"/run/tags_seen/{name}", color, 1.5) for name, _, color, _ in STYLES
        }
        self._shown: FrameTags | None = None

    def draw(self, view: PageView) -> None:
        """Draw the newest frame."""
        run = view.part(RunView)
        found = None if run is None else run.sightings
        if found is self._shown:
            return
        self._shown = found
        for name, uses, _, _ in STYLES:
            self._lines[name].points = NO_SEGMENTS if found is None else _strokes(found, uses)

    def is_used(self, view: PageView) -> bool:
        """Whether a camera looks for tags."""
        run = view.part(RunView)
        return run is not None and run.result.columns.detected.tags is not None

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return all lines."""
        return tuple(node for lines in self._lines.values() for node in lines.nodes)


def _strokes(found: FrameTags, uses: tuple[TagUse, ...]) -> np.ndarray:
    """Lines from the camera to tags of some uses, and a cross on each."""
    places = found.places[np.isin(found.uses, uses)]
    sight = np.stack([np.broadcast_to(found.camera, places.shape), places], axis=1)
    return stroke_segments(np.concatenate([sight, crosses(places, CROSS)]), theme.Height.DETECTION)
